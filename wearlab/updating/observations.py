"""``[[update.data]]``: a CSV file becomes observations in SI, each with its row."""

import csv
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.measured import WHEN, WHERE, Data
from wearlab.scene.problems import Refusal
from wearlab.tables import SEPARATORS, decoded
from wearlab.units import UnitError, convert

LARGEST = 200_000_000  # bytes of a file
LARGEST_NUMBER = 1e30
PLACE_UNITS = {"diameter": "m", "roll_angle": "rad", "path_position": "m"}
CLOCKS = {"cycle": "1", "hours": "s", "mesh_cycles": "1"}


class UpdateError(Refusal):
    """An update cannot be done; its problems tell place and remedy."""


@dataclass(frozen=True)
class Observed:
    """The observations of one block.

    Parameters
    ----------
    data : the block
    clock : cycle | hours | mesh_cycles
    time : (n,) when, by that clock; hours in s
    value : (n,) what was measured [SI], NaN where it was below a limit of detection
    sd : (n,) standard error of each, from its column [SI], 0 without one
    below : (n,) limit of detection where the value is NaN [SI]
    place_kind : diameter | roll_angle | path_position, None for what has no place
    place : (n,) there [SI], NaN without one
    row : (n,) line of the file
    fingerprint : hash of the file's bytes
    """

    data: Data
    clock: str
    time: Array
    value: Array
    sd: Array
    below: Array
    place_kind: str | None
    place: Array
    row: Index
    fingerprint: str

    def __len__(self) -> int:
        return len(self.time)

    @property
    def censored(self) -> Flags:
        """Which values were below the limit of detection."""
        return np.isnan(self.value)


def read_observations(data: Data) -> Observed:
    """Return the observations of a block's file, in its order.

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    content = _bytes(data)
    line, header, row, cells = _rows(content, data)
    clock = next((name for name in WHEN if getattr(data.columns, name) is not None), "cycle")
    place_kind = next((name for name in WHERE if getattr(data.columns, name) is not None), None)
    names = {
        "time": getattr(data.columns, clock) or clock,
        "value": data.columns.value or data.quantity,
        "sd": data.columns.sd,
        "below": data.columns.below,
        "place": getattr(data.columns, place_kind) if place_kind else None,
    }
    for name, column in names.items():
        if column is not None and column not in header:
            raise UpdateError(
                f"{data.file}: line {line}: no column {column!r} for {name}; there are "
                f"{', '.join(header)}: name it in {data.place}.columns"
            )
    unknown = set(data.units) - set(header)
    if unknown:
        raise UpdateError(f"{data.place}.units.{min(unknown)}: the file has no such column")
    wanted = {"time": CLOCKS[clock], "place": PLACE_UNITS.get(place_kind or "", "1")}
    columns = {
        name: _column(data, cells[header.index(column)], row, column, wanted.get(name, data.si), name)
        for name, column in names.items()
        if column is not None
    }
    nothing = np.full(len(row), np.nan)
    seen = Observed(
        data,
        clock,
        columns["time"],
        columns["value"],
        np.nan_to_num(columns.get("sd", np.zeros(len(row)))),
        columns.get("below", nothing),
        place_kind,
        columns.get("place", nothing),
        row,
        hashlib.sha256(content).hexdigest(),
    )
    _refuse_impossible(seen, names)
    return seen


def _bytes(data: Data) -> bytes:
    path = Path(data.file)
    try:
        if path.stat().st_size > LARGEST:
            raise UpdateError(f"{path}: more than {LARGEST:,} bytes; thin it out")
        return path.read_bytes()
    except OSError as error:
        raise UpdateError(f"{data.place}.file: {path}: cannot be read ({error.strerror or error})") from error


def _rows(content: bytes, data: Data) -> tuple[int, list[str], Index, list[tuple[str, ...]]]:
    """Return line and names of the header, the lines of the rows below it, and the cells of each column."""
    text, _ = decoded(content)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise UpdateError(f"{data.file}: has no header line")
    numbers = np.array([n for n, _ in lines[1:]], np.int64)
    separator = next((mark for mark in SEPARATORS if mark and mark in lines[0][1]), ",")
    reader = csv.reader((line for _, line in lines), delimiter=separator)
    try:
        header = [cell.strip() for cell in next(reader)]
        rows = list(reader)
    except csv.Error as error:
        raise UpdateError(f"{data.file}: line {lines[reader.line_num - 1][0]}: {error}") from None
    twice = next((name for name in header if name and header.count(name) > 1), None)
    if twice is not None:
        raise UpdateError(f"{data.file}: line {lines[0][0]}: column {twice!r} stands twice; rename one")
    wrong = next((i for i, row in enumerate(rows) if len(row) != len(header)), None)
    if wrong is not None or len(rows) != len(numbers):
        i = len(rows) - 1 if wrong is None else wrong
        raise UpdateError(f"{data.file}: line {numbers[i]}: {len(rows[i])} columns instead of {len(header)}")
    columns = list(zip(*rows, strict=True)) or [()] * len(header)
    if separator != ",":  # then a comma is a decimal one
        columns = [tuple(map(_pointed, cells)) for cells in columns]
    return lines[0][0], header, numbers, columns


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell


def _column(data: Data, cells: tuple[str, ...], lines: Index, column: str, unit: str, name: str) -> Array:
    """Return the numbers of a column in SI."""
    own = data.units.get(column)
    if name == "time" and unit == "s" and own is None:
        own = "h"
    if own is None and unit not in ("1", ""):
        raise UpdateError(
            f'{data.place}.units: column {column!r} needs its unit: units = {{ {column} = "…" }}'
        )
    try:
        scale = 1.0 if own is None else convert(1.0, own, unit)
    except UnitError as error:
        raise UpdateError(f"{data.place}.units.{column}: {error}") from None
    empty = np.array([not cell.strip() for cell in cells], bool)
    try:
        values = np.array(["nan" if none else cell for cell, none in zip(cells, empty, strict=True)], float)
    except ValueError:
        values = np.array([_number(cell) for cell in cells])
    wrong = ~(np.abs(values) < LARGEST_NUMBER) & ~(empty & (name in ("value", "below", "sd")))
    if wrong.any():
        i = int(np.argmax(wrong))
        cell = cells[i].strip()
        huge = "number that can be measured" if np.isfinite(values[i]) else "finite number"
        said = f"{cell[:40]!r} is no {huge}" if cell else "is empty"
        raise UpdateError(f"{data.file}: line {lines[i]}, column {column!r}: {said}")
    return np.asarray(values * scale)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _refuse_impossible(seen: Observed, names: dict[str, str | None]) -> None:
    """Refuse what cannot be a measurement, by row and column."""
    file = seen.data.file

    def refuse(wrong: Flags, name: str, values: Array, said: str) -> None:
        if wrong.any():
            i = int(np.argmax(wrong))
            shown = "" if math.isnan(values[i]) else f"{values[i]:g} "
            raise UpdateError(f"{file}: line {seen.row[i]}, column {names[name]!r}: {shown}{said}")

    refuse(seen.time < 0.0, "time", seen.time, "is before the first cycle")
    refuse(seen.censored & np.isnan(seen.below), "value", seen.value, "is empty, and no limit of detection")
    refuse(seen.sd < 0.0, "sd", seen.sd, "is no standard error")
    error = seen.data.error
    if error.sd is None and not error.relative:
        refuse(seen.sd <= 0.0, "sd", seen.sd, "is required: the block's error has no other")
    if isinstance(seen.data.since, float):
        refuse(seen.time < seen.data.since, "time", seen.time, f"is before since = {seen.data.since:g}")

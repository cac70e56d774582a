"""``[[update.data]]``: a CSV file becomes observations in SI, each with its row."""

import csv
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.measured import WHEN, WHERE, Data
from wearlab.tables import SEPARATORS, decoded
from wearlab.units import UnitError, convert
from wearlab.updating.errors import UpdateError

LARGEST = 200_000_000  # bytes of a file
PLACE_UNITS = {"diameter": "m", "roll_angle": "rad", "path_position": "m"}
CLOCKS = {"cycle": "1", "hours": "s", "mesh_cycles": "1"}


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
    rows = _rows(content, data)
    header, body = rows[0], rows[1:]
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
        if column is not None and column not in header[1]:
            raise UpdateError(
                f"{data.file}: line {header[0]}: no column {column!r} for {name}; there are "
                f"{', '.join(header[1])}: name it in {data.place}.columns"
            )
    unknown = set(data.units) - set(header[1])
    if unknown:
        raise UpdateError(f"{data.place}.units.{min(unknown)}: the file has no such column")
    wanted = {"time": CLOCKS[clock], "place": PLACE_UNITS.get(place_kind or "", "1")}
    columns = {
        name: _column(data, header[1], body, column, wanted.get(name, data.si), name)
        for name, column in names.items()
        if column is not None
    }
    nothing = np.full(len(body), np.nan)
    row = np.array([number for number, _ in body], np.int64)
    seen = Observed(
        data,
        clock,
        columns["time"],
        columns["value"],
        np.nan_to_num(columns.get("sd", np.zeros(len(body)))),
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


def _rows(content: bytes, data: Data) -> list[tuple[int, list[str]]]:
    """Return the lines that are no comments, each with its number, the header first."""
    text, _ = decoded(content)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise UpdateError(f"{data.file}: has no header line")
    separator = next((mark for mark in SEPARATORS if mark and mark in lines[0][1]), ",")
    rows = [
        (n, [cell.strip() for cell in row])
        for n, line in lines
        for row in csv.reader([line], delimiter=separator)
    ]
    if separator != ",":  # then a comma is a decimal one
        rows = [rows[0], *((n, [_pointed(cell) for cell in cells]) for n, cells in rows[1:])]
    width = len(rows[0][1])
    for number, row in rows[1:]:
        if len(row) != width:
            raise UpdateError(f"{data.file}: line {number}: {len(row)} columns instead of {width}")
    return rows


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell


def _column(
    data: Data, header: list[str], body: list[tuple[int, list[str]]], column: str, unit: str, name: str
) -> Array:
    at = header.index(column)
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
    values = np.empty(len(body))
    for i, (number, row) in enumerate(body):
        values[i] = _number(row[at], data.file, number, column, empty=name in ("value", "below", "sd"))
    return values * scale


def _number(text: str, file: Path, line: int, column: str, *, empty: bool) -> float:
    if not text and empty:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        said = f"{text!r} is no finite number" if text else "is empty"
        raise UpdateError(f"{file}: line {line}, column {column!r}: {said}")
    return value


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

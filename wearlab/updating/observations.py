"""``[[update.data]]``: a CSV file becomes observations in SI, each with its row."""

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.update_options import WHEN, WHERE, Data, Days, RecordBlock
from wearlab.files import read_regular
from wearlab.scene.problems import Refusal
from wearlab.tables import LARGEST_FILE, ReadTable, TableError, in_unit, read_table
from wearlab.units import HOUR

DAYS_A_YEAR = 365.2425
HOURS_A_YEAR = 24.0 * DAYS_A_YEAR
PLACE_UNITS = {"diameter": "m", "roll_angle": "rad", "path_position": "m"}
CLOCKS = {"cycle": "1", "hours": "s", "mesh_cycles": "1", "date": ""}


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


def read_observations(
    data: Data,
    days: Days | None = None,
    unit: str | None = None,
    hours_at: Callable[[np.ndarray[Any, Any], Days | None], Array] | None = None,
) -> Observed:
    """Return the observations of a block's file, in its order.

    Parameters
    ----------
    data : the block
    days : which day it was after how many operating hours, for a column of dates
    unit : of a fleet, whose rows are meant; None: all
    hours_at : operating seconds at dates, by a record of what ran

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    table, content, names = _table(data)
    path = Path(data.file)
    clock, place_kind = _kinds(data)
    unknown = next((column for column in sorted(data.units) if table.find(column) is None), None)
    if unknown is not None:
        raise UpdateError(f"{data.place}.units.{unknown}: the file has no such column")
    held = np.ones(len(table), bool)
    if unit is not None:
        held = np.array([text == unit for text in table.cells[str(names["unit"])]])
    units = {"time": CLOCKS[clock], "place": PLACE_UNITS.get(place_kind or "", "1")}
    try:
        columns = {
            name: _dates(data, table, str(found), days, held, hours_at)
            if name == "time" and clock == "date"
            else numbers_of(data, table, str(found), units.get(name, data.si), name)
            for name, found in names.items()
            if name != "unit"
        }
    except TableError as error:
        raise UpdateError(
            f"{path.parent / str(error)}" if str(error).startswith(table.file) else f"{data.place}.{error}"
        ) from None
    nothing = np.full(len(table), np.nan)
    seen = Observed(
        data,
        "hours" if clock == "date" else clock,
        columns["time"],
        columns["value"],
        np.nan_to_num(columns.get("sd", np.zeros(len(table)))),
        columns.get("below", nothing),
        place_kind,
        columns.get("place", nothing),
        np.array(table.lines, np.int64),
        hashlib.sha256(content).hexdigest(),
    )
    if unit is not None:
        parts = ("time", "value", "sd", "below", "place", "row")
        seen = replace(seen, **{part: getattr(seen, part)[held] for part in parts})
    _refuse_impossible(seen, names)
    return seen


def _kinds(data: Data) -> tuple[str, str | None]:
    """Return by which clock a block is, and by what it says where on the flank."""
    clock = next((name for name in WHEN if getattr(data.columns, name) is not None), "cycle")
    return clock, next((name for name in WHERE if getattr(data.columns, name) is not None), None)


def _table(data: Data) -> tuple[ReadTable, bytes, dict[str, str]]:
    """Return a block's table, its bytes, and which column says what.

    Raises
    ------
    UpdateError : it cannot be read, or a column is not there
    """
    path, (clock, place_kind) = Path(data.file), _kinds(data)
    try:
        table = read_table(path)
        content = read_regular(path, LARGEST_FILE)
    except (TableError, OSError) as error:
        raise UpdateError(f"{data.place}.file: {path}: cannot be read ({error})") from None
    wanted = {
        "time": getattr(data.columns, clock) or clock,
        "value": data.columns.value or data.quantity,
        "sd": data.columns.sd,
        "unit": data.columns.unit,
        "below": data.columns.below,
        "place": getattr(data.columns, place_kind) if place_kind else None,
    }
    names = {name: table.find(column) for name, column in wanted.items() if column is not None}
    for name, found in names.items():
        if found is None:
            raise UpdateError(
                f"{path}: line {table.header_line}: no column {wanted[name]!r} for {name}; there are "
                f"{', '.join(table.names)}: name it in {data.place}.columns"
            )
    return table, content, {name: str(found) for name, found in names.items()}


def units_of(data: Data) -> list[str]:
    """Return the units of a fleet that a block's file names, in its order.

    Raises
    ------
    UpdateError : the file cannot be read, or a row names no unit
    """
    table, _, names = _table(data)
    texts = table.cells[str(names["unit"])]
    if "" in texts:
        line = table.lines[texts.index("")]
        raise UpdateError(f"{data.file}: line {line}, column {names['unit']!r}: is empty: which unit is it?")
    return list(dict.fromkeys(texts))


def calendar_of(data: Data, unit: str, days: Days | None) -> Days | None:
    """Return which day it was after how many hours of a unit, by its columns of both, and how they go on.

    They go on as ``days`` says, else as from the unit's first inspection to its last.

    Raises
    ------
    UpdateError : a date cannot be read, or there are more hours than the days between have
    """
    table, _, names = _table(data)
    if data.columns.hours is None or data.columns.date is None:
        return days
    held = np.array([text == unit for text in table.cells[str(names["unit"])]])
    if not held.any():
        return days
    try:
        dates = table.dates(str(table.find(data.columns.date)), data.date_format)[held]
    except TableError as error:
        raise UpdateError(f"{Path(data.file).parent / str(error)}") from None
    hours = numbers_of(data, table, str(names["time"]), "s", "time")[held] / HOUR
    first, last = int(np.argmin(hours)), int(np.argmax(hours))
    years = float((dates[last] - dates[first]) / np.timedelta64(1, "D")) / DAYS_A_YEAR
    rate = None if days is None else days.hours_per_year
    if rate is None and years > 0.0:
        rate = float(hours[last] - hours[first]) / years
        if rate > 1.01 * HOURS_A_YEAR:
            row = table.lines[int(np.flatnonzero(held)[last])]
            raise UpdateError(
                f"{data.file}: line {row}: unit {unit!r} ran {rate:.0f} hours a year since its first "
                "inspection, more than a year has: look at its dates and hours"
            )
    if rate is None or not rate > 0.0:
        return None
    return Days(dates[last].astype("datetime64[D]").item(), float(hours[last]), rate)


def numbers_of(data: Data | RecordBlock, table: ReadTable, column: str, unit: str, name: str) -> Array:
    """Return the numbers of a column in SI."""
    given = {table.find(written): own for written, own in data.units.items()}
    own = given.get(column) or table.units[column] or ("h" if unit == "s" else None)
    if own is None and unit not in ("1", ""):
        raise UpdateError(
            f'{data.place}.units: column {column!r} needs its unit: units = {{ {column} = "…" }}'
        )
    numbers = table.numbers(column, empty=name in ("value", "below", "sd"))
    return numbers if own is None else in_unit(numbers, own, unit, column)


def _dates(
    data: Data, table: ReadTable, column: str, days: Days | None, held: Flags, hours_at: Any = None
) -> Array:
    """Return the operating seconds at dates, by a record, or by the hours of a year in operation."""
    if hours_at is not None:
        seconds: Array = hours_at(table.dates(column, data.date_format), days)
        wrong = held & ~(seconds >= 0.0)
        if wrong.any():
            row = table.lines[int(np.argmax(wrong))]
            raise UpdateError(
                f"{data.file}: line {row}, column {column!r}: lies outside update.record: let it begin "
                "earlier, or give update.calendar for what comes after it"
            )
        return seconds
    if days is None or days.hours is None:
        raise UpdateError(
            f"{data.place}.columns.date: dates need update.calendar = {{ date, hours, hours_per_year }}: "
            "a day, the operating hours on it, and how they go on"
        )
    dates = table.dates(column, data.date_format)
    passed = (dates - np.datetime64(days.day, "s")).astype(float) / 86400.0
    hours = days.hours + passed * days.hours_per_year / DAYS_A_YEAR
    if (hours < 0.0).any():
        raise UpdateError(
            f"{data.file}: line {table.lines[int(np.argmax(hours < 0.0))]}, column {column!r}: is before the "
            "first operating hour, by update.calendar"
        )
    return np.asarray(hours * HOUR)


def _refuse_impossible(seen: Observed, names: Mapping[str, str | None]) -> None:
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

"""Files of measurements in SI: ``[[update.data]]``, what was seen, and ``[update.record]``, what really ran.

Under each condition of a record wear goes on as a run of it does from the same wear. So
a record is a clock: cycles of equal wear over operating time, said in cycles of the
scene's own speed. From its end on the scene's own conditions go on.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from wearlab import files, units
from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.update_options import WHEN, WHERE, Data, Days, RecordBlock
from wearlab.scene import Scene, problems
from wearlab.tables import LARGEST_FILE, ReadTable, TableError, in_unit, read_table
from wearlab.updating.calendar import (
    DAYS_A_YEAR,
    HOURS_A_YEAR,
    Calendar,
    Dates,
    day_number,
    day_text,
)

PLACE_UNITS = {"diameter": "m", "roll_angle": "rad", "path_position": "m"}
CLOCKS = {"cycle": "1", "hours": "s", "mesh_cycles": "1", "date": ""}
# of the hours by the calendar, by which those of a record may differ without a word
UNLIKE = 0.05
# conditions that are run as they are; of more, the means of TORQUES by SPEEDS classes
MOST = 12
TORQUES, SPEEDS = 6, 2


class UpdateError(problems.Refusal):
    """An update cannot be done; its problems tell place and remedy."""


class MeasuredColumns:
    """The columns of a block's file by what they say.

    Parameters
    ----------
    block : that names file, columns and units

    Raises
    ------
    UpdateError : the file cannot be read
    """

    def __init__(self, block: Data | RecordBlock) -> None:
        self.block = block
        self.path = Path(block.file)
        self.names: dict[str, str] = {}
        try:
            self.table: ReadTable = read_table(self.path)
            self.fingerprint = hashlib.sha256(
                files.read_regular(self.path, LARGEST_FILE)
            ).hexdigest()
        except (TableError, OSError) as error:
            raise UpdateError(
                f"{block.place}.file: {self.path}: cannot be read ({error})"
            ) from None

    def find(self, columns_by_role: Mapping[str, str | None], unit: str | None) -> None:
        """Find the column of each role, None where there is none.

        Of one unit where the file has many.

        Raises
        ------
        UpdateError : a column is not there
        """
        for role, column in (
            (role, column)
            for role, column in columns_by_role.items()
            if column is not None
        ):
            if (column_found := self.table.find(column)) is None:
                begins = f"{column} [", f"{column} ("
                strange = next(
                    (n for n in self.table.names if n.startswith(begins)), ""
                )
                unknown = (
                    f"{strange[len(column) :].strip()} in its header is no unit that "
                    "is known: "
                )
                hint = f" as {strange!r}, and its unit in units" if strange else ""
                listed = (
                    f"there are {', '.join(self.table.names)}: "
                    f"{unknown if strange else ''}"
                )
                message = (
                    f"line {self.table.header_line}: no column {column!r} for {role}; "
                    f"{listed}"
                )
                raise UpdateError(
                    f"{self.path}: {message}name it in {self.block.place}.columns{hint}"
                )
            self.names[role] = column_found
        if unit is not None and "unit" in self.names:
            self.table = self.table.where(self.names["unit"], unit)
        self.lines = np.array(self.table.lines, np.int64)

    def __len__(self) -> int:
        return len(self.lines)

    def numbers(self, role: str, unit: str, *, empty: bool = False) -> Array:
        """Return the numbers of a role in SI, NaN where a cell may be empty."""
        column = self.names[role]
        stated_units = {
            self.table.find(written): column_unit
            for written, column_unit in self.block.units.items()
        }
        column_unit = (
            stated_units.get(column)
            or self.table.units[column]
            or ("h" if unit == "s" else None)
        )
        if column_unit is None and unit not in ("1", ""):
            bare = re.fullmatch(r"[A-Za-z0-9_-]+", column)
            example = (
                f"units = {{ "
                f'{column if bare else json.dumps(column, ensure_ascii=False)} = "…" }}'
            )
            raise UpdateError(
                f"{self.block.place}.units: column {column!r} needs its unit: {example}"
            )
        try:
            numbers = self.table.numbers(column, empty=empty)
            return (
                numbers
                if column_unit is None
                else in_unit(numbers, column_unit, unit, column)
            )
        except TableError as error:
            raise self._at(error) from None

    def censored(self, role: str, unit: str) -> tuple[Array, Array]:
        """Return the numbers of a role in SI, NaN where a cell is empty or ``<0.1``, and the limits told."""
        texts = self.table.cells[self.names[role]]
        less = np.array([text.startswith("<") for text in texts], bool)
        bare = {self.names[role]: tuple(text.lstrip("< ") for text in texts)}
        self.table = replace(self.table, cells={**self.table.cells, **bare})
        numbers = self.numbers(role, unit, empty=True)
        return np.where(less, np.nan, numbers), np.where(less, numbers, np.nan)

    def dates(self, role: str) -> Dates:
        """Return the dates of a role."""
        try:
            return self.table.dates(self.names[role], self.block.date_format)
        except TableError as error:
            raise self._at(error) from None

    def _at(self, error: TableError) -> UpdateError:
        named = str(error).startswith(self.table.file)
        return UpdateError(
            f"{self.path.parent / str(error)}"
            if named
            else f"{self.block.place}.{error}"
        )

    def refuse(
        self, wrong: Flags, role: str, message: str, values: Array | None = None
    ) -> None:
        """Refuse what cannot be, by line and column.

        Raises
        ------
        UpdateError : something is wrong
        """
        if wrong.any():
            i = int(np.argmax(wrong))
            shown = (
                ""
                if values is None
                else f"{self.table.cells[self.names[role]][i]} ".lstrip()
            )
            place = f"{self.path}: line {self.lines[i]}, column {self.names[role]!r}"
            raise UpdateError(f"{place}: {shown}{message}")


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


def columns_of(
    data: Data, unit: str | None = None
) -> tuple[MeasuredColumns, str, str | None]:
    """Return the columns of a block, its clock, and by what it says where on the flank.

    Raises
    ------
    UpdateError : the file cannot be read, or a column is not there
    """
    named = data.columns
    columns = MeasuredColumns(data)
    usual = {
        name: columns.table.column_of(name, {})
        for name in ("cycle", "hours", "date", data.quantity)
    }
    when = {
        name: column for name in WHEN if (column := getattr(named, name)) is not None
    }
    when = when or {
        name: column for name in WHEN if (column := usual.get(name)) is not None
    }
    clock = next(iter(when), "cycle")
    place = next((name for name in WHERE if getattr(named, name) is not None), None)
    roles = {
        "time": when.get(clock, clock),
        "value": named.value or usual[data.quantity] or data.quantity,
    }
    roles |= {"sd": named.sd, "below": named.below, "unit": named.unit}
    roles |= {"date": when.get("date") if clock == "hours" else None}
    columns.find(roles | {"place": getattr(named, place) if place else None}, unit)
    return columns, clock, place


def read_observations(
    data: Data, calendar: Calendar | None = None, unit: str | None = None
) -> Observed:
    """Return the observations of a block's file, in its order.

    Parameters
    ----------
    data : the block
    calendar : which day it was after how many operating hours, for a column of dates
    unit : of a fleet, whose rows are meant; None: all

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    columns, clock, place_kind = columns_of(data, unit)
    for column in sorted(data.units):
        if columns.table.find(column) is None:
            raise UpdateError(
                f"{data.place}.units.{column}: the file has no such column"
            )
    (value, below) = columns.censored("value", data.si)
    has = columns.names
    time = (
        _seconds(columns, calendar)
        if clock == "date"
        else columns.numbers("time", CLOCKS[clock])
    )
    sd = (
        np.nan_to_num(columns.numbers("sd", data.si, empty=True))
        if "sd" in has
        else np.zeros(len(time))
    )
    if "below" in has:
        below = np.where(
            np.isnan(below), columns.numbers("below", data.si, empty=True), below
        )
    nowhere = np.full(len(time), np.nan)
    place = (
        nowhere
        if place_kind is None
        else columns.numbers("place", PLACE_UNITS[place_kind])
    )
    columns.refuse(time < 0.0, "time", "is before the first cycle", time)
    message = (
        "is empty, and no limit of detection: write the value, name its limit of "
        "detection "
    )
    message += "(columns.below, or <0.1 in the cell), or delete the row"
    columns.refuse(np.isnan(value) & np.isnan(below), "value", message)
    columns.refuse(sd < 0.0, "sd", "is no standard error", sd)
    if data.error.sd is None and not data.error.relative:
        columns.refuse(
            sd <= 0.0, "sd", "is required: the block's error has no other", sd
        )
    if isinstance(data.since, float):
        columns.refuse(
            time < data.since, "time", f"is before since = {data.since:g}", time
        )
    if data.error.gain_sd:
        message = (
            "is empty: with error.gain_sd no value may be below a limit of detection"
        )
        columns.refuse(np.isnan(value), "value", message)
    held = (place_kind, place, columns.lines, columns.fingerprint)
    return Observed(
        data, "hours" if clock == "date" else clock, time, value, sd, below, *held
    )


def _seconds(columns: MeasuredColumns, calendar: Calendar | None) -> Array:
    """Return the operating seconds at dates, by a record, or by the hours of a year in operation."""
    dates = columns.dates("time")
    if calendar is None or np.isnan(calendar.time[-1]):
        message = (
            "dates need update.calendar = { date, hours, hours_per_year }: a day, the "
            "operating hours on "
        )
        raise UpdateError(
            f"{columns.block.place}.columns.date: {message}it, and how they go on"
        )
    hours = calendar.hours(dates)
    message = (
        f"is before the first operating hour: {calendar.time[-1]:g} h on "
        f"{day_text(calendar.day[-1])}, "
    )
    message += f"{calendar.a_year:g} h a year, by update.calendar"
    if calendar.recorded:
        message = (
            "lies outside update.record: let it begin earlier, or give update.calendar "
            "for what follows"
        )
    columns.refuse(~(hours >= 0.0), "time", message, hours)
    return hours * units.HOUR


def units_of(data: Data) -> list[str]:
    """Return the units of a fleet that a block's file names, in its order.

    Raises
    ------
    UpdateError : the file cannot be read, or a row names no unit
    """
    columns, *_ = columns_of(data)
    texts = np.array(columns.table.cells[columns.names["unit"]], dtype=object)
    columns.refuse(np.asarray(texts == "", bool), "unit", "is empty: which unit is it?")
    return list(dict.fromkeys(texts))


def calendar_of(data: Data, unit: str | None, days: Days | None) -> Calendar | None:
    """Return which day it was after how many hours of a unit, by its columns of both, and how they go on.

    They go on as ``days`` says, else as from the unit's first inspection to its last.

    Raises
    ------
    UpdateError : a date cannot be read, or there are more hours than the days between
        have
    """
    columns, *_ = columns_of(data, unit)
    if "date" not in columns.names or not len(columns):
        return None
    day = day_number(columns.dates("date"))
    hours = columns.numbers("time", "s") / units.HOUR
    order = np.lexsort((day, hours))
    day = day[order]
    hours = hours[order]
    lines = columns.lines[order]
    if (back := np.diff(day) < 0.0).any():
        text = (
            "line {1} has more hours than line {0}, and an earlier date: look at both"
        )
        raise UpdateError(f"{data.file}: {text.format(*lines[int(np.argmax(back)) :])}")
    if days is not None:
        return Calendar(day, hours, days.hours_per_year)
    rate = (
        float(np.ptp(hours) / np.ptp(day)) * DAYS_A_YEAR if np.ptp(day) > 0.0 else 0.0
    )
    if rate > 1.01 * HOURS_A_YEAR:
        message = (
            f"line {lines[-1]}: {'it' if unit is None else f'unit {unit!r}'} ran "
            f"{rate:.0f} hours a year "
        )
        message += (
            "since its first inspection, more than a year has: look at its dates and "
            "hours"
        )
        raise UpdateError(f"{data.file}: {message}")
    return Calendar(day, hours, rate) if rate > 0.0 else None


@dataclass(frozen=True)
class OperatingRecord:
    """What ran, one condition after another.

    Parameters
    ----------
    time : (n+1,) operating time at the ends of the conditions [s], from 0 on
    torque, speed : (n,) of each [N m], [rad/s]; 0 where nothing wears
    dates : (n+1,) when that was, None where it is not said
    mixed : whether their order is not known: bins
    fingerprint : hash of the file's bytes
    share : of the time between dates that is in operation
    """

    time: Array
    torque: Array
    speed: Array
    dates: Dates | None
    mixed: bool
    fingerprint: str
    share: float = 1.0

    def conditions(self) -> tuple[Array, Index]:
        """Return the conditions that are run, (c, 2), and which of them each piece is.

        −1 without wear.
        """
        numbers = np.full(len(self.torque), -1)
        works = np.flatnonzero((self.torque > 0.0) & (self.speed > 0.0))
        operating = np.stack([self.torque, self.speed], axis=1)[works]
        distinct, index = np.unique(operating, axis=0, return_inverse=True)
        if len(distinct) > MOST:
            counts = np.array([TORQUES, SPEEDS])
            low = operating.min(axis=0)
            share = (operating - low) / np.maximum(np.ptp(operating, axis=0), 1e-300)
            classes = np.minimum((counts * share).astype(np.intp), counts - 1)
            _, index = np.unique(classes @ [SPEEDS, 1], return_inverse=True)
            weight = (np.diff(self.time) * self.speed)[works]
            sums = [
                np.bincount(index, weight * column) / np.bincount(index, weight)
                for column in operating.T
            ]
            distinct = np.stack(sums, axis=1)
        numbers[works] = index.ravel()
        return distinct, numbers

    def scenes(self, scene: Scene) -> dict[str, Scene]:
        """Return a scene with each of its conditions, under what it is called."""
        assert scene.operation is not None
        operation = scene.operation.model_dump()
        scenes = {}
        removed = {
            f"operation.{key}": None
            for key in ("duty", "power")
            if operation.get(key) is not None
        }
        for n, (torque, speed) in enumerate(self.conditions()[0].tolist(), 1):
            condition = {
                "operation.torque": f"{torque!r} N*m",
                "operation.speed": f"{speed!r} rad/s",
            }
            scenes[f"update.record: its run {n} at {torque:g} N m"] = scene.replace(
                {**removed, **condition}
            )
        return scenes

    def calendar(self, a_year: float | None) -> Calendar | None:
        """Return its calendar, which goes on at so many hours a year, else at its own.

        None without dates.
        """
        if self.dates is None:
            return None
        day = day_number(self.dates)
        hours = self.time / units.HOUR
        return Calendar(
            day,
            hours,
            a_year or float(hours[-1] / np.ptp(day)) * DAYS_A_YEAR,
            recorded=True,
        )

    def excess(self, a_year: float | None) -> tuple[float, float] | None:
        """Return its hours, every one between its dates, and those at so many a year, where they differ."""
        if self.dates is None or a_year is None or self.share < 1.0:
            return None
        hours = float(self.time[-1]) / units.HOUR
        expected = float(np.ptp(day_number(self.dates))) / DAYS_A_YEAR * a_year
        return None if abs(hours - expected) <= UNLIKE * expected else (hours, expected)


def read_record(
    block: RecordBlock, unit: str | None, a_year: float | None
) -> OperatingRecord | None:
    """Return what ran, of one unit where the file has many.

    None where it has no row of it.

    Between its dates are the hours of a year that it says; else, without a row of a
    standstill, those that the calendar says; else every hour.

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    named = block.columns
    columns = MeasuredColumns(block)
    (when,) = (
        name
        for name in ("hours", "date", "duration")
        if getattr(named, name) is not None
    )
    columns.find(
        {
            "time": getattr(named, when),
            **named.model_dump(include={"torque", "speed", "unit"}),
        },
        unit,
    )
    if not len(columns):
        return None
    torque, speed = (
        columns.numbers(n, si, empty=True)
        for n, si in (("torque", "N m"), ("speed", "rad/s"))
    )
    dates = columns.dates("time") if when == "date" else None
    time = (
        columns.numbers("time", "s")
        if dates is None
        else (dates - dates[0]) / np.timedelta64(1, "s")
    )
    bins = when == "duration"
    share = 1.0
    last = np.arange(len(time)) == (-1 if bins else len(time) - 1)
    for name, values in (("torque", torque), ("speed", speed)):
        columns.refuse(
            np.isnan(values) & ~last, name, "is empty; 0 stands for a standstill"
        )
        columns.refuse(values < 0.0, name, f"is negative: give the size of the {name}")
    if bins:
        columns.refuse(time < 0.0, "time", "is no length of time")
        ends = np.append(0.0, np.cumsum(time))
    else:
        if len(time) < 2:
            place = f"{columns.path}: line {columns.lines[0]}"
            raise UpdateError(
                f"{place}: a row holds until the next: at least two are needed"
            )
        columns.refuse(
            np.append(False, np.diff(time) <= 0.0),
            "time",
            "is not after the row before it",
        )
        columns.refuse(time < 0.0, "time", "is before the first hour")
        begins = (
            f"the record begins after {time[0] / units.HOUR:g} h: begin at 0 with what "
            "ran until then"
        )
        columns.refuse((time > 0.0) & (np.arange(len(time)) == 0), "time", begins)
        torque = torque[:-1]
        speed = speed[:-1]
        # hours in operation: a standstill has none
        a_year = block.hours_per_year or (None if (speed == 0.0).any() else a_year)
        share = 1.0 if dates is None or a_year is None else a_year / HOURS_A_YEAR
        ends = (
            time
            if dates is None
            else np.append(0.0, np.cumsum(share * np.diff(time) * (speed > 0.0)))
        )
    if not (np.diff(ends) * speed).any():
        raise UpdateError(f"{columns.path}: nothing ran: speed is 0 in every row")
    return OperatingRecord(ends, torque, speed, dates, bins, columns.fingerprint, share)

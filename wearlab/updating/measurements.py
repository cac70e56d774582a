"""Files of measurements in SI: what was seen, and what really ran.

They are named in ``[[update.data]]`` and ``[update.record]``. Under each condition of a
record wear goes on as a run of it does from the same wear. So a record is a clock:
cycles of equal wear over operating time, in cycles of the scene's own speed. From its
end on the scene's own conditions go on.
"""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from wearlab import files, units
from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.update_options import (
    OIL_AGES,
    PPM,
    WHEN,
    WHERE,
    Data,
    RecordBlock,
)
from wearlab.scene import Scene, problems
from wearlab.scene.duty_file import with_middles
from wearlab.schema import VARIABLES
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
# conditions that are run as they are; of more, the means of classes of both
MAX_CONDITIONS = 12
TORQUE_CLASSES = 6
SPEED_CLASSES = 2


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
            self.table: ReadTable = read_table(
                self.path, sheet=block.sheet, decimal=block.decimal
            )
            self.fingerprint = hashlib.sha256(
                files.read_regular(self.path, LARGEST_FILE)
            ).hexdigest()
        except (TableError, OSError) as error:
            raise UpdateError(
                f"{block.place}.file: {self.path}: cannot be read ({error})"
            ) from None

    def find(self, columns_by_role: Mapping[str, str | None], unit: str | None) -> None:
        """Find the column of each role.

        Parameters
        ----------
        columns_by_role : None where there is none
        unit : of which rows are kept, where the file has many

        Raises
        ------
        UpdateError : a column is not there
        """
        for role, column in columns_by_role.items():
            if column is None:
                continue
            name = self.table.find(column)
            if name is None and column == role:  # not named by the campaign file
                name = self.table.column_of(role, {})
            if name is None:
                raise self._no_column(role, column)
            self.names[role] = name
        if unit is not None and "unit" in self.names:
            self.table = self.table.where(self.names["unit"], unit)
        self.lines = np.array(self.table.lines, np.int64)

    def with_middles(
        self, columns: Mapping[str, str | Sequence[str]]
    ) -> dict[str, str]:
        """Return the column of each load; of a range one of its middles is added.

        Parameters
        ----------
        columns : torque and speed → header, or the two of a range

        Raises
        ------
        UpdateError : a range has two units, or two signs
        """
        named = {role: header for role, header in columns.items() if header != role}
        units_of = dict(self.block.units)
        for role, header in named.items():
            if not isinstance(header, str) and header[0] in units_of:
                units_of[role] = units_of[header[0]]
        try:
            self.table, plain = with_middles(
                self.table, named, units_of, may_be_empty=True
            )
        except TableError as error:
            raise self._at(error) from None
        return {role: plain.get(role, role) for role in columns}

    def _no_column(self, role: str, column: str) -> UpdateError:
        """Return a refusal of a column that the file does not have."""
        begins = f"{column} [", f"{column} ("
        names = self.table.names
        with_unit = next((name for name in names if name.startswith(begins)), "")
        listed = f"there are {', '.join(names)}: "
        hint = ""
        if with_unit:
            unit = with_unit[len(column) :].strip()
            listed += f"{unit} in its header is no unit that is known: "
            hint = f" as {with_unit!r}, and its unit in units"
        return UpdateError(
            f"{self.path}: line {self.table.header_line}: no column {column!r} for "
            f"{role}; {listed}name it in {self.block.place}.columns{hint}"
        )

    def __len__(self) -> int:
        return len(self.lines)

    def numbers(self, role: str, unit: str, *, empty: bool = False) -> Array:
        """Return the numbers of a role in SI, NaN where a cell is empty.

        Parameters
        ----------
        role : of the column
        unit : SI unit of the numbers
        empty : whether cells may be empty
        """
        column = self.names[role]
        column_unit = self._unit_of(column) or ("h" if unit == "s" else None)
        if column_unit is None and unit not in ("1", "", PPM):
            bare = re.fullmatch(r"[A-Za-z0-9_-]+", column)
            key = column if bare else json.dumps(column, ensure_ascii=False)
            raise UpdateError(
                f"{self.block.place}.units: column {column!r} needs its unit: "
                f'units = {{ {key} = "…" }}'
            )
        try:
            numbers = self.table.numbers(column, empty=empty)
            if column_unit is None:
                return numbers
            return in_unit(numbers, column_unit, unit, column)
        except TableError as error:
            raise self._at(error) from None

    def _unit_of(self, column: str) -> str | None:
        """Return the unit that the block, else the file, gives a column."""
        stated = {
            self.table.find(written): unit for written, unit in self.block.units.items()
        }
        return stated.get(column) or self.table.units[column]

    def censored(self, role: str, unit: str) -> tuple[Array, Array]:
        """Return the numbers of a role in SI, and limits of cells such as ``<0.1``.

        Each is NaN where a cell tells the other, or nothing.

        Parameters
        ----------
        role : of the column
        unit : SI unit of the numbers
        """
        texts = self.table.cells[self.names[role]]
        if "<" not in "".join(texts):
            numbers = self.numbers(role, unit, empty=True)
            return numbers, np.full_like(numbers, np.nan)

        less = np.array([text.startswith("<") for text in texts], bool)
        bare = {self.names[role]: tuple(text.lstrip("< ") for text in texts)}
        self.table = replace(self.table, cells={**self.table.cells, **bare})
        numbers = self.numbers(role, unit, empty=True)
        return np.where(less, np.nan, numbers), np.where(less, numbers, np.nan)

    def refuse_unlike_ppm(self, role: str) -> None:
        """Refuse a unit that is no share of a mass, of iron in oil.

        Parameters
        ----------
        role : of the column

        Raises
        ------
        UpdateError : its unit is another
        """
        unit = self._unit_of(self.names[role])
        if unit is not None and not units.comparable(unit, "1"):
            raise UpdateError(
                f"{self.block.place}.units: {self.names[role]}: {unit!r} is no share "
                "of the oil's mass: ppm, mg/kg, or percent"
            )

    def dates(self, role: str) -> Dates:
        """Return the dates of a role."""
        try:
            return self.table.dates(self.names[role], self.block.date_format)
        except TableError as error:
            raise self._at(error) from None

    def _at(self, error: TableError) -> UpdateError:
        """Return a refusal with the place of what a table cannot read."""
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

        Parameters
        ----------
        wrong : which rows are
        role : of the column
        message : what is wrong
        values : of the column, where the message begins with the cell

        Raises
        ------
        UpdateError : something is wrong
        """
        if not wrong.any():
            return
        i = int(np.argmax(wrong))
        column = self.names[role]
        if values is not None:
            message = f"{self.table.cells[column][i]} ".lstrip() + message
        place = f"{self.path}: line {self.lines[i]}, column {column!r}"
        raise UpdateError(f"{place}: {message}")


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
    since : (n,) from when each value counts, by that clock, NaN from the first cycle;
        None where none has such a time
    place_kind : diameter | roll_angle | path_position, None for what has no place
    place : (n,) there [SI], NaN without one
    row : (n,) line of the file
    fingerprint : hash of the file's bytes
    unread : columns of the file that say when, too, and are not read
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
    since: Array | None = None
    unread: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time)

    @property
    def censored(self) -> Flags:
        """Which values were below the limit of detection."""
        return np.isnan(self.value)

    @property
    def display_unit(self) -> str:
        """The unit in which people read its values."""
        declared = VARIABLES.get(self.data.quantity)
        return self.data.si if declared is None else declared.display_units


def reach_text(observations: Sequence[Observed]) -> str:
    """Return how far values and times of some observations reach, in words.

    Who reads it sees whether the file was read as it was meant.

    Parameters
    ----------
    observations : of one quantity, by one clock
    """
    first = observations[0]
    unit = first.display_unit
    value = np.concatenate([observed.value for observed in observations])
    below = np.concatenate([observed.below for observed in observations])
    time = np.concatenate([observed.time for observed in observations])
    texts = []
    if not np.isnan(value).all():
        texts.append(_span(units.convert(value, first.data.si or "1", unit), unit))
    is_censored = np.isnan(value)
    if is_censored.any():
        limits = units.convert(below[is_censored], first.data.si or "1", unit)
        texts.append(f"{int(is_censored.sum())} below {_span(limits, unit)}")
    if first.clock == "hours":
        return f"{', '.join(texts)}, at {_span(time / units.HOUR, 'h')}"
    unit_of_time = {"cycle": "cycles"}.get(first.clock, "mesh cycles")
    return f"{', '.join(texts)}, at {_span(time, unit_of_time)}"


def _span(numbers: Array, unit: str) -> str:
    """Return the smallest and the largest of numbers with their unit."""
    ends = dict.fromkeys(
        f"{end:.6g}" for end in (np.nanmin(numbers), np.nanmax(numbers))
    )
    return f"{' to '.join(ends)} {'' if unit == '1' else unit}".rstrip()


def columns_of(
    data: Data, unit: str | None = None
) -> tuple[MeasuredColumns, str, str | None]:
    """Return the columns of a block, its clock, and by what it says where on the flank.

    Parameters
    ----------
    data : the block
    unit : of a fleet, whose rows are meant [all]

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
    stated = {name: getattr(named, name) for name in WHEN}
    times = {name: column for name, column in stated.items() if column is not None}
    if not times:
        usual_times = {name: usual.get(name) for name in WHEN}
        times = {n: column for n, column in usual_times.items() if column is not None}
    clock = next(iter(times), "cycle")
    place = next((name for name in WHERE if getattr(named, name) is not None), None)
    roles = {
        "time": times.get(clock, clock),
        "value": named.value or usual[data.quantity] or data.quantity,
        "sd": named.sd,
        "below": named.below,
        "oil_hours": named.oil_hours,
        "oil_changed": named.oil_changed,
        "unit": named.unit,
        "date": times.get("date") if clock == "hours" else None,
        "place": getattr(named, place) if place else None,
    }
    columns.find(roles, unit)
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

    scale = 1.0
    unit = data.si
    if data.oil is not None:
        columns.refuse_unlike_ppm("value")
        unit = PPM
        scale = 1e-6 * data.oil.per_share
    value, below = (scale * part for part in columns.censored("value", unit))
    if clock == "date":
        time = _seconds(columns, calendar)
    else:
        time = columns.numbers("time", CLOCKS[clock])
    sd = np.zeros(len(time))
    if "sd" in columns.names:
        sd = scale * np.nan_to_num(columns.numbers("sd", unit, empty=True))
    if "below" in columns.names:
        limits = scale * columns.numbers("below", unit, empty=True)
        below = np.where(np.isnan(below), limits, below)
    place = np.full(len(time), np.nan)
    if place_kind is not None:
        place = columns.numbers("place", PLACE_UNITS[place_kind])

    observed = Observed(
        data=data,
        clock="hours" if clock == "date" else clock,
        time=time,
        value=value,
        sd=sd,
        below=below,
        place_kind=place_kind,
        place=place,
        row=columns.lines,
        fingerprint=columns.fingerprint,
        since=_oil_changes(columns, clock, time, calendar),
        unread=_unread_times(columns),
    )
    _refuse_odd_observations(columns, observed)
    return observed


def _unread_times(columns: MeasuredColumns) -> tuple[str, ...]:
    """Return the columns of a file that say when, too, beside the one that is read."""
    read = {columns.names.get(role) for role in ("time", "date")}
    usual = [columns.table.column_of(name, {}) for name in ("cycle", "hours", "date")]
    return tuple(name for name in usual if name is not None and name not in read)


def _oil_changes(
    columns: MeasuredColumns, clock: str, time: Array, calendar: Calendar | None
) -> Array | None:
    """Return when the oil of each sample was new [s], None where that is not said."""
    ages = [role for role in OIL_AGES if role in columns.names]
    if not ages:
        return None
    (role,) = ages
    if clock not in ("hours", "date"):
        raise UpdateError(
            f"{columns.block.place}.columns.{role}: goes with hours or dates: say when "
            "samples were taken by one of them"
        )
    if role == "oil_changed":
        changed = _seconds(columns, calendar, role)
    else:
        changed = time - columns.numbers(role, "s")
        early = "is more than the hours of the gearbox at the sample"
        columns.refuse(changed < -units.HOUR, role, early)
    columns.refuse(changed > time, role, "is after the sample")
    unused = "is the time of the sample itself: nothing is worn off since"
    columns.refuse(changed == time, role, unused)
    return np.maximum(changed, 0.0)


def _refuse_odd_observations(columns: MeasuredColumns, observed: Observed) -> None:
    """Refuse observations that cannot be, by line and column."""
    data = observed.data
    time = observed.time
    sd = observed.sd
    missing = np.isnan(observed.value)
    columns.refuse(time < 0.0, "time", "is before the first cycle", time)
    no_limit = (
        "is empty, and no limit of detection: write the value, name its limit of "
        "detection (columns.below, or <0.1 in the cell), or delete the row"
    )
    columns.refuse(missing & np.isnan(observed.below), "value", no_limit)
    columns.refuse(sd < 0.0, "sd", "is no standard error", sd)
    if data.error.sd is None and not data.error.relative:
        no_error = "is required: the block's error has no other"
        columns.refuse(sd <= 0.0, "sd", no_error, sd)
    if isinstance(data.since, float):
        early = f"is before since = {data.since:g}"
        columns.refuse(time < data.since, "time", early, time)
    if data.error.gain_sd:
        censored = (
            "is empty: with error.gain_sd no value may be below a limit of detection"
        )
        columns.refuse(missing, "value", censored)


def _seconds(
    columns: MeasuredColumns, calendar: Calendar | None, role: str = "time"
) -> Array:
    """Return the operating seconds at dates, by a record, or by the hours of a year."""
    dates = columns.dates(role)
    if calendar is None or np.isnan(calendar.time[-1]):
        raise UpdateError(
            f"{columns.block.place}.columns.date: dates need update.calendar = "
            "{ date, hours, hours_per_year }: a day, the operating hours on it, and "
            "how they go on"
        )
    hours = calendar.hours(dates)
    if calendar.recorded:
        message = (
            "lies outside update.record: let it begin earlier, or give update.calendar "
            "for what follows"
        )
    else:
        message = (
            f"is before the first operating hour: {calendar.time[-1]:g} h on "
            f"{day_text(calendar.day[-1])}, {calendar.a_year:g} h a year, by "
            "update.calendar"
        )
    # oil may have been filled in before the first hour
    early = np.isnan(hours) if role == "oil_changed" else ~(hours >= 0.0)
    columns.refuse(early, role, message, hours)
    return hours * units.HOUR


def units_of(data: Data) -> list[str]:
    """Return the units of a fleet that a block or its file names, in its order.

    Parameters
    ----------
    data : the block

    Raises
    ------
    UpdateError : the file cannot be read, or a row names no unit
    """
    if data.unit is not None:
        return [data.unit]
    columns, *_ = columns_of(data)
    texts = np.array(columns.table.cells[columns.names["unit"]], dtype=object)
    columns.refuse(np.asarray(texts == "", bool), "unit", "is empty: which unit is it?")
    return list(dict.fromkeys(texts))


@dataclass(frozen=True)
class OperatingRecord:
    """What ran, one condition after another.

    Parameters
    ----------
    time : (n+1,) operating time at the ends of the conditions [s], from 0 on
    torque : (n,) of each [N m]; negative where it loads the back flanks, 0 where
        nothing wears
    speed : (n,) of each, without sense [rad/s]; 0 of a standstill
    dates : (n+1,) when that was, None where it is not said
    mixed : whether their order is not known: bins
    fingerprint : hash of the file's bytes
    share : of the time between dates that is in operation
    counted : whether the hours are those that tables or calendar know
    """

    time: Array
    torque: Array
    speed: Array
    dates: Dates | None
    mixed: bool
    fingerprint: str
    share: float = 1.0
    counted: bool = False

    def conditions(self) -> tuple[Array, Index]:
        """Return the conditions that are run, (c, 2), and which of them each piece is.

        −1 without wear of the front flanks.
        """
        works = np.flatnonzero((self.torque > 0.0) & (self.speed > 0.0))
        operating = np.stack([self.torque, self.speed], axis=1)[works]
        distinct, index = np.unique(operating, axis=0, return_inverse=True)
        if len(distinct) > MAX_CONDITIONS:
            weight = (np.diff(self.time) * self.speed)[works]
            distinct, index = _classes_of(operating, weight)
        numbers = np.full(len(self.torque), -1)
        numbers[works] = index.ravel()
        return distinct, numbers

    @property
    def reversed_work(self) -> float:
        """Torque times turns that load back flanks, over those of front flanks."""
        work = self.torque * self.speed * np.diff(self.time)
        front = float(work[work > 0.0].sum())
        back = float(-work[work < 0.0].sum())
        return back / front if front > 0.0 else np.inf * back if back else 0.0

    def since(self, seconds: float) -> "OperatingRecord | None":
        """Return what ran after an operating time, from 0 on; None after its end.

        Of bins, whose order is not known, every one was as far.

        Parameters
        ----------
        seconds : operating time [s]
        """
        left = float(self.time[-1]) - seconds
        if left <= 0.0:
            return None
        if self.mixed:
            share = left / float(self.time[-1])
            return replace(self, time=share * self.time)
        pieces = self.time[1:] > seconds
        begins = np.append(0.0, self.time[1:][pieces] - seconds)
        dates = self.dates
        if dates is not None:
            dates = np.append(dates[:-1][pieces][:1], dates[1:][pieces])
        torque = self.torque[pieces]
        speed = self.speed[pieces]
        return replace(self, time=begins, torque=torque, speed=speed, dates=dates)

    def scenes(self, scene: Scene) -> dict[str, Scene]:
        """Return a scene with each of its conditions, under what it is called.

        Parameters
        ----------
        scene : of the case
        """
        assert scene.operation is not None
        operation = scene.operation.model_dump()
        removed = {
            f"operation.{key}": None
            for key in ("duty", "power")
            if operation.get(key) is not None
        }
        scenes = {}
        conditions, _ = self.conditions()
        for number, (torque, speed) in enumerate(conditions.tolist(), 1):
            changes = {
                **removed,
                "operation.torque": f"{torque!r} N*m",
                "operation.speed": f"{speed!r} rad/s",
            }
            name = f"update.record: its run {number} at {torque:g} N m"
            scenes[name] = scene.replace(changes)
        return scenes

    def calendar(self, a_year: float | None) -> Calendar | None:
        """Return its calendar, None without dates.

        Parameters
        ----------
        a_year : hours in a year with which it goes on [its own]
        """
        if self.dates is None:
            return None
        day = day_number(self.dates)
        hours = self.time / units.HOUR
        rate = a_year or float(hours[-1] / np.ptp(day)) * DAYS_A_YEAR
        return Calendar(day, hours, rate, recorded=True)

    def excess(self, a_year: float | None) -> tuple[float, float] | None:
        """Return its hours, every one between its dates, and those by a calendar.

        None where they do not differ.

        Parameters
        ----------
        a_year : hours in a year by the calendar
        """
        if self.counted or self.dates is None or a_year is None or self.share < 1.0:
            return None
        hours = float(self.time[-1]) / units.HOUR
        years = float(np.ptp(day_number(self.dates))) / DAYS_A_YEAR
        expected = years * a_year
        return None if abs(hours - expected) <= UNLIKE * expected else (hours, expected)


def _classes_of(operating: Array, weight: Array) -> tuple[Array, Index]:
    """Return means of classes of torque and speed, and the class of each condition.

    ``operating`` are the conditions, (n, 2), ``weight`` their cycles.
    """
    counts = np.array([TORQUE_CLASSES, SPEED_CLASSES])
    low = operating.min(axis=0)
    share = (operating - low) / np.maximum(np.ptp(operating, axis=0), 1e-300)
    classes = np.minimum((counts * share).astype(np.intp), counts - 1)
    _, index = np.unique(classes @ [SPEED_CLASSES, 1], return_inverse=True)
    total = np.bincount(index, weight)
    means = [np.bincount(index, weight * column) / total for column in operating.T]
    return np.stack(means, axis=1), index


def read_record(
    block: RecordBlock, unit: str | None, a_year: float | None
) -> OperatingRecord | None:
    """Return what ran, of one unit where the file has many.

    None where it has no row of it. Between its dates are the hours of a year that it
    says; else, without a row of a standstill, those that the calendar says; else every
    hour.

    Parameters
    ----------
    block : that names file, columns and units
    unit : of a fleet, whose rows are meant; None: all
    a_year : hours of a year by the calendar

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    named = block.columns
    columns = MeasuredColumns(block)
    clocks = ("hours", "date", "duration", "cycles")
    (when,) = (name for name in clocks if getattr(named, name) is not None)
    columns.find({"unit": named.unit}, unit)
    loads = columns.with_middles(named.model_dump(include={"torque", "speed"}))
    columns.find({"time": getattr(named, when), **loads}, None)
    if not len(columns):
        return None

    torque = columns.numbers("torque", "N m", empty=True)
    speed = np.abs(columns.numbers("speed", "rad/s", empty=True))
    dates = columns.dates("time") if when == "date" else None
    if dates is not None:
        time = (dates - dates[0]) / np.timedelta64(1, "s")
    elif when == "cycles":
        time = _time_of_cycles(columns, speed)
    else:
        time = columns.numbers("time", "s")

    is_bins = when in ("duration", "cycles")
    _refuse_odd_conditions(columns, {"torque": torque, "speed": speed}, is_bins)
    share = 1.0
    if is_bins:
        columns.refuse(time < 0.0, "time", "is no length of time")
        ends = np.append(0.0, np.cumsum(time))
    else:
        _refuse_odd_times(columns, time)
        torque = torque[:-1]
        speed = speed[:-1]
        ends = time
        if dates is not None:
            # hours in operation: a standstill has none
            stands = (speed == 0.0).any()
            a_year = block.hours_per_year or (None if stands else a_year)
            share = 1.0 if a_year is None else a_year / HOURS_A_YEAR
            seconds = share * np.diff(time) * (speed > 0.0)
            ends = np.append(0.0, np.cumsum(seconds))
    if not (np.diff(ends) * speed).any():
        raise UpdateError(f"{columns.path}: nothing ran: speed is 0 in every row")
    return OperatingRecord(
        time=ends,
        torque=torque,
        speed=speed,
        dates=dates,
        mixed=is_bins,
        fingerprint=columns.fingerprint,
        share=share,
    )


def _time_of_cycles(columns: MeasuredColumns, speed: Array) -> Array:
    """Return the time of bins of so many revolutions of the input member (n,) [s].

    Parameters
    ----------
    columns : of the file, of which "time" tells the revolutions
    speed : (n,) of the input member [rad/s]
    """
    cycles = columns.numbers("time", "1")
    columns.refuse(
        ~(speed > 0.0), "speed", "tells no time of its cycles: give duration in hours"
    )
    return np.asarray(cycles * 2.0 * np.pi / speed)


def _refuse_odd_conditions(
    columns: MeasuredColumns, conditions: Mapping[str, Array], is_bins: bool
) -> None:
    """Refuse torques and speeds that are missing.

    Those of the last row may be missing, where a row holds until the next.
    """
    count = len(columns)
    last = np.arange(count) == (-1 if is_bins else count - 1)
    for name, values in conditions.items():
        missing = np.isnan(values) & ~last
        columns.refuse(missing, name, "is empty; 0 stands for a standstill")


def _refuse_odd_times(columns: MeasuredColumns, time: Array) -> None:
    """Refuse times of rows, each of which holds until the next."""
    if len(time) < 2:
        raise UpdateError(
            f"{columns.path}: line {columns.lines[0]}: a row holds until the next: at "
            "least two are needed"
        )
    falls = np.append(False, np.diff(time) <= 0.0)
    columns.refuse(falls, "time", "is not after the row before it")
    columns.refuse(time < 0.0, "time", "is before the first hour")
    late = (
        f"the record begins after {time[0] / units.HOUR:g} h: begin at 0 with what ran "
        "until then"
    )
    is_first = np.arange(len(time)) == 0
    columns.refuse((time > 0.0) & is_first, "time", late)

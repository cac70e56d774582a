"""One clock for a unit: its tables, its record and its calendar tell the same hours.

Operating hours are known on some days: those of rows with hours and date, the day of
``update.calendar`` with its hours, and the day on which a record begins, 0 h. Between
two of them hours pass where the record ran, evenly. Days that cannot all be true are
refused, with the two that contradict each other.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab import units
from wearlab.arrays import Array
from wearlab.campaign.update_options import Data, Days, RecordBlock, UpdateSpec
from wearlab.updating.calendar import (
    DAY,
    DAYS_A_YEAR,
    EPOCH,
    HOURS_A_YEAR,
    Calendar,
    day_number,
    day_text,
)
from wearlab.updating.measurements import (
    UNLIKE,
    OperatingRecord,
    UpdateError,
    columns_of,
    read_record,
)

CALENDAR = "update.calendar"
DAY_HOURS = 24.0
# days by which two sources may differ without a word: dates are whole days
NEARBY = 1.0
# of the hours between two days, by which there may be more than the days have
ROUNDED = 0.01


class KnownDay(NamedTuple):
    """A day on which operating hours are known.

    Parameters
    ----------
    day : days since 1970
    hours : operating hours then
    source : the file and line, or the key, that says so
    """

    day: float
    hours: float
    source: str

    @property
    def text(self) -> str:
        """How messages call it."""
        return f"{self.source} has {self.hours:,.0f} h on {day_text(self.day)}"


class UnitClock(NamedTuple):
    """The clock of a unit.

    Parameters
    ----------
    record : what ran, by this clock; None without a record
    calendar : which day it was after how many hours, None where that is not known
    of_dates : the calendar by which dates of measurements are read
    """

    record: OperatingRecord | None
    calendar: Calendar | None
    of_dates: Calendar | None


def clock_of(
    spec: UpdateSpec, unit: str | None, days: Days | None, *, common: bool = False
) -> UnitClock:
    """Return the clock of a unit.

    Parameters
    ----------
    spec : names tables and record
    unit : of a fleet, whose rows are meant; None: all
    days : the calendar that the file gives it
    common : whether that is the calendar of a whole fleet

    Raises
    ------
    UpdateError : a file cannot be read, or two days contradict each other
    """
    known = [day for data in spec.data for day in days_of_rows(data, unit)]
    if known and days is not None and not common:
        _refuse_another_last_day(days, known)
    if days is not None and days.hours is not None:
        known.append(KnownDay(float(day_number(days.date)), days.hours, CALENDAR))
    known.sort(key=lambda one: (one.hours, one.day))

    a_year = None if days is None else days.hours_per_year
    record = None if spec.record is None else read_record(spec.record, unit, a_year)
    if record is not None and record.dates is not None:
        assert spec.record is not None
        return _clock_of_record(spec.record, record, known, a_year)

    calendar = _calendar_of_days(spec, unit, days)
    _refuse_contradictions(known)
    return UnitClock(record, calendar, calendar)


def _calendar_of_days(
    spec: UpdateSpec, unit: str | None, days: Days | None
) -> Calendar | None:
    """Return the calendar of tables and of the file, without a record."""
    stated = None if days is None else Calendar.of(days)
    found = (calendar_of(data, unit, days) for data in spec.data)
    tables = [calendar for calendar in found if calendar is not None]
    if not tables:
        return stated
    if stated is not None and not np.isnan(stated.time).any():
        tables.append(stated)
    return tables[0].joined(tables[1:])


def days_of_rows(data: Data, unit: str | None) -> list[KnownDay]:
    """Return the days that rows with both hours and a date know, hours rising.

    Parameters
    ----------
    data : the block
    unit : of a fleet, whose rows are meant; None: all

    Raises
    ------
    UpdateError : a date cannot be read, or dates fall as hours rise
    """
    if data.at is not None:
        return []
    columns, *_ = columns_of(data, unit)
    if "date" not in columns.names or not len(columns):
        return []
    day = day_number(columns.dates("date"))
    hours = columns.numbers("time", "s") / units.HOUR
    order = np.lexsort((day, hours))
    known = [
        KnownDay(float(day[row]), float(hours[row]), f"line {columns.lines[row]}")
        for row in order
    ]
    for one, after in pairwise(known):
        if after.day < one.day:
            raise UpdateError(
                f"{data.file}: {after.source} has more hours than {one.source}, and an "
                "earlier date: look at both"
            )
    return [one._replace(source=f"{data.file}: {one.source}") for one in known]


def calendar_of(data: Data, unit: str | None, days: Days | None) -> Calendar | None:
    """Return which day it was after how many hours of a unit, by its columns of both.

    Parameters
    ----------
    data : the block
    unit : of a fleet, whose rows are meant; None: all
    days : says how hours go on; None: as from the unit's first inspection to its last

    Raises
    ------
    UpdateError : a date cannot be read, or there are more hours than the days between
        have
    """
    known = days_of_rows(data, unit)
    if not known:
        return None
    day = np.array([one.day for one in known])
    hours = np.array([one.hours for one in known])
    if days is not None:
        return Calendar(day, hours, days.hours_per_year)
    span = np.ptp(day)
    rate = float(np.ptp(hours) / span) * DAYS_A_YEAR if span > 0.0 else 0.0
    if rate > 1.01 * HOURS_A_YEAR:
        subject = "it" if unit is None else f"unit {unit!r}"
        raise UpdateError(
            f"{known[-1].source}: {subject} ran {rate:.0f} hours a year since its "
            "first inspection, more than a year has: look at its dates and hours"
        )
    return Calendar(day, hours, rate) if rate > 0.0 else None


def _refuse_another_last_day(days: Days, known: Sequence[KnownDay]) -> None:
    """Refuse a calendar whose day of the last inspection is not that of the tables."""
    last = max(known, key=lambda one: one.hours)
    stated = float(day_number(days.date))
    if days.hours is None and abs(stated - last.day) > NEARBY:
        raise UpdateError(
            f"{CALENDAR}.date: {days.date} is said to be the day of the last "
            f"inspection, but {last.text}: give that day, or the operating hours on "
            f"{days.date} (calendar.hours)"
        )


def _refuse_contradictions(known: Sequence[KnownDay]) -> None:
    """Refuse days of which a later one has fewer hours, or more than there were.

    Parameters
    ----------
    known : days, hours rising
    """
    for one, after in pairwise(known):
        elapsed = after.day - one.day
        if elapsed < -NEARBY:
            raise _contradiction(one, after, "more hours on an earlier day")
        allowed = (1.0 + ROUNDED) * DAY_HOURS * (max(elapsed, 0.0) + NEARBY)
        if after.hours - one.hours > allowed:
            raise _contradiction(one, after, "more hours than the days between have")


def _contradiction(one: KnownDay, after: KnownDay, why: str) -> UpdateError:
    """Return the refusal of two days."""
    return UpdateError(
        f"{one.text}, {after.text}: {why}; the two contradict each other: correct one "
        "of them"
    )


def _clock_of_record(
    block: RecordBlock,
    record: OperatingRecord,
    known: Sequence[KnownDay],
    a_year: float | None,
) -> UnitClock:
    """Return the clock of a unit with a record by dates."""
    if not known:
        calendar = record.calendar(a_year)
        assert calendar is not None
        # of what follows it nothing is told without hours of a year
        ahead = np.nan if a_year is None else a_year
        return UnitClock(record, calendar, calendar._replace(a_year=ahead))

    assert record.dates is not None
    begin = KnownDay(float(day_number(record.dates[0])), 0.0, str(block.file))
    for one in known:
        if one.day <= begin.day and one.hours > DAY_HOURS:
            raise UpdateError(
                f"{begin.text}, where a record begins, but {one.text}: let the record "
                "begin on the day of 0 h"
            )
    _refuse_contradictions(known)
    later = [one for one in known if one.day > begin.day]
    days = [begin, *later]
    _refuse_contradictions(days)
    if not later:
        calendar = record.calendar(a_year)
        assert calendar is not None
        return UnitClock(record, calendar, calendar)

    running = _RunningTime.of(record)
    _refuse_idle_hours(running, days)
    if block.hours_per_year is not None:
        _refuse_another_pace(block, running, later)
    return _clock_by_days(block, record, running, days, a_year)


class _RunningTime(NamedTuple):
    """For how many days a record ran until days, as if without a stop.

    Parameters
    ----------
    day : days since 1970 at which rows end
    ran : days that it had run by then
    """

    day: Array
    ran: Array

    @classmethod
    def of(cls, record: OperatingRecord) -> "_RunningTime":
        """Return the running time of a record."""
        assert record.dates is not None
        day = day_number(record.dates)
        ran = np.append(0.0, np.cumsum(np.diff(day) * (record.speed > 0.0)))
        return cls(day, ran)

    def until(self, day: Array) -> Array:
        """Return how many days it ran until days; after its end it goes on."""
        beyond = np.maximum(day - self.day[-1], 0.0)
        return np.interp(day, self.day, self.ran) + beyond


def _refuse_idle_hours(running: _RunningTime, days: Sequence[KnownDay]) -> None:
    """Refuse hours that passed while the record stood still, or none while it ran."""
    for one, after in pairwise(days):
        ran = float(np.diff(running.until(np.array([one.day, after.day])))[0])
        hours = after.hours - one.hours
        if hours > (1.0 + ROUNDED) * DAY_HOURS * (ran + NEARBY):
            why = f"update.record ran for {ran:.0f} days between, with fewer hours"
            raise _contradiction(one, after, why)
        if hours <= 0.0 and ran > NEARBY:
            why = f"update.record ran for {ran:.0f} days between, which count no hour"
            raise _contradiction(one, after, why)


def _refuse_another_pace(
    block: RecordBlock, running: _RunningTime, later: Sequence[KnownDay]
) -> None:
    """Refuse hours of a year that put known hours on other days."""
    assert block.hours_per_year is not None
    hours_a_day = block.hours_per_year / DAYS_A_YEAR
    for one in later:
        ran = one.hours / hours_a_day
        beyond = max(ran - running.ran[-1], 0.0)
        day = float(np.interp(ran, running.ran, running.day)) + beyond
        elapsed = one.day - running.day[0]
        if abs(day - one.day) > max(UNLIKE * elapsed, NEARBY):
            raise UpdateError(
                f"{block.place}.hours_per_year: {block.hours_per_year:g} puts these "
                f"hours on {day_text(day)}, but {one.text}: leave hours_per_year out, "
                "and the record counts the hours of the table"
            )


def _clock_by_days(
    block: RecordBlock,
    record: OperatingRecord,
    running: _RunningTime,
    days: Sequence[KnownDay],
    a_year: float | None,
) -> UnitClock:
    """Return the clock of a record whose hours are those that days know.

    Its rows are parted at these days.
    """
    known_day = np.maximum.accumulate([one.day for one in days])
    known_hours = np.array([one.hours for one in days])
    known_ran = running.until(known_day)

    # from the last known day on: what is said of a year, else as until then
    stands = bool((record.speed == 0.0).any())
    pace = known_hours[-1] / max(known_ran[-1], 1e-9) * DAYS_A_YEAR
    pace = block.hours_per_year or (None if stands else a_year) or pace
    day = np.union1d(running.day, known_day)
    ran = running.until(day)
    hours = np.interp(ran, known_ran, known_hours)
    hours += pace / DAYS_A_YEAR * np.maximum(ran - known_ran[-1], 0.0)

    inside = day <= running.day[-1]
    row = np.searchsorted(running.day, day[inside], side="right") - 1
    row = np.minimum(row[:-1], len(record.speed) - 1)
    seconds = np.round(day[inside] * (DAY / np.timedelta64(1, "s")))
    clocked = replace(
        record,
        time=hours[inside] * units.HOUR,
        torque=record.torque[row],
        speed=record.speed[row],
        dates=EPOCH + seconds.astype("timedelta64[s]"),
        counted=True,
    )
    ahead = a_year or float(hours[-1] / np.ptp(day)) * DAYS_A_YEAR
    last = float(known_day[-1])
    calendar = Calendar(day, hours, ahead, recorded=True, counted_until=last)
    return UnitClock(clocked, calendar, calendar)

"""Dates and operating hours: straight between days that are known.

Beyond them so many hours a year pass.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.campaign.update_options import Days
from wearlab.units import HOUR

Dates = NDArray[np.datetime64]
DAYS_A_YEAR = 365.2425
HOURS_A_YEAR = 24.0 * DAYS_A_YEAR
DAY = np.timedelta64(1, "D")
EPOCH = np.datetime64("1970-01-01", "s")
LAST_DAY = 2.9e6  # days from 1970 to the year 9900
NEVER = "never"
# of a day, by which hours of a date, or a date to the second, may have been rounded
# down
ROUNDING = 5e-5
# times the hours of a year until now, beyond which those from now on are another pace
OTHER_PACE = 1.25
LEAST_DAYS = 30.0  # that are known, between which there is a pace


def straight(x: Any, knots: Array, values: Array, rate: float) -> Array:
    """Return values at x, straight between knots, at a rate beyond both ends.

    The knots do not fall.
    """
    inside = np.interp(x, knots, values)
    beyond = x - np.minimum(np.maximum(x, knots[0]), knots[-1])
    if not np.any(beyond):
        return np.asarray(inside)
    return np.asarray(inside + np.where(beyond != 0.0, rate * beyond, 0.0))


def day_number(dates: Any) -> Array:
    """Return days since 1970 of dates."""
    return np.asarray((np.asarray(dates, "datetime64[s]") - EPOCH) / DAY)


def day_text(day: float) -> str:
    """Return a day since 1970 as ISO 8601 has it, "never" after the year 9900."""
    return (
        str(np.datetime64(int(np.floor(day + ROUNDING)), "D"))
        if abs(day) < LAST_DAY
        else NEVER
    )


class PaceChange(NamedTuple):
    """Another pace of operation from a day on.

    Parameters
    ----------
    day : the last one that is known
    until, after : operating hours in a year before and after it
    """

    day: str
    until: float
    after: float


class Calendar(NamedTuple):
    """Which day it was after how many operating hours, or cycles.

    Parameters
    ----------
    day : (n,) days since 1970 that are known
    time : (n,) operating hours then, not falling; NaN: those of the last inspection
    a_year : hours in a year before and after them
    recorded : whether a record of what ran tells them
    counted_until : day from which hours go on with ``a_year`` [the last of all]
    """

    day: Array
    time: Array
    a_year: float
    recorded: bool = False
    counted_until: float | None = None

    @classmethod
    def of(cls, days: Days) -> "Calendar":
        """Return the calendar of one day as a file gives it."""
        return cls(
            np.atleast_1d(day_number(days.date)),
            np.array([days.hours], float),
            days.hours_per_year,
        )

    def joined(self, calendars: "Sequence[Calendar]") -> "Calendar":
        """Return the calendar of all days that some know; it goes on as this one."""
        day = np.concatenate([calendar.day for calendar in (self, *calendars)])
        time = np.concatenate([calendar.time for calendar in (self, *calendars)])
        order = np.lexsort((day, time))
        # two sources may date the same hours a day apart
        rising = np.maximum.accumulate(day[order])
        return Calendar(rising, time[order], self.a_year)

    def days(self, time: Any) -> Array:
        """Return days since 1970 after hours."""
        return straight(time, self.time, self.day, DAYS_A_YEAR / self.a_year)

    def hours(self, dates: Any) -> Array:
        """Return the operating hours at dates."""
        return straight(
            day_number(dates), self.day, self.time, self.a_year / DAYS_A_YEAR
        )

    @property
    def pace_change(self) -> PaceChange | None:
        """The paces until the last day that is known and after it, None where alike."""
        last = float(self.day[-1])
        if self.counted_until is not None:
            last = self.counted_until
        days = last - float(self.day[0])
        hours = float(np.interp(last, self.day, self.time) - self.time[0])
        if days < LEAST_DAYS or not hours > 0.0:
            return None
        until = hours / days * DAYS_A_YEAR
        if until / OTHER_PACE <= self.a_year <= until * OTHER_PACE:
            return None
        return PaceChange(day_text(last), until, self.a_year)

    def in_cycles(
        self, start: float, last_cycle: float, seconds_per_cycle: float
    ) -> "Calendar":
        """Return the calendar over cycles of a run from its start.

        The last inspection was at one of them.
        """
        cycles_per_hour = HOUR / seconds_per_cycle
        cycles = np.where(
            np.isnan(self.time), last_cycle, start + self.time * cycles_per_hour
        )
        return Calendar(self.day, cycles, self.a_year * cycles_per_hour)

    def texts(self, time: Array) -> np.ndarray:
        """Return the days after hours as texts."""
        return np.array([day_text(day) for day in self.days(time)], dtype=object)

"""The day on which a life ends, from the operating hours until then."""

import numpy as np

from wearlab.arrays import Array
from wearlab.campaign.measured import Days
from wearlab.units import HOUR

DAYS_A_YEAR = 365.2425
LAST = np.datetime64("9999-12-31")
NEVER = "never"


def days_of(days: Days, remaining: Array, now: float, seconds_per_cycle: float) -> list[str]:
    """Return the days on which so many cycles have passed (ISO 8601), "never" after the year 9999.

    day + (h_now + h_remaining − h_day)/(hours a year) · 365.2425

    Parameters
    ----------
    days : a day, its operating hours, hours a year
    remaining : cycles from now on
    now : cycles from the start of the run to the last inspection
    seconds_per_cycle : operating time of a cycle [s]
    """
    hour = seconds_per_cycle / HOUR
    since = now * hour if days.hours is None else days.hours
    ahead = ((now + remaining) * hour - since) / days.hours_per_year * DAYS_A_YEAR
    most = float((LAST - np.datetime64(days.day)).astype(int))
    return [
        str(np.datetime64(days.day) + np.timedelta64(int(np.floor(task)), "D")) if task < most else NEVER
        for task in ahead
    ]

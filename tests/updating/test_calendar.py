"""The day on which a life ends."""

from datetime import date

import numpy as np
import pytest

from wearlab.campaign.inheritance import CampaignError
from wearlab.campaign.update import read_update
from wearlab.campaign.update_options import Days
from wearlab.updating.lives import days_of

UNKNOWN = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
CYCLES = np.array([0.0, 36_525.0, np.inf, 1e12])


def test_a_tenth_of_a_year_of_hours_is_a_tenth_of_a_year():
    days = Days(
        date=date(2026, 1, 1), hours=None, hours_per_year=3652.5
    )  # a cycle is 36 s: 36,525 of them are 365.25 hours
    assert days_of(days, CYCLES, 5.0, 36.0) == ["2026-01-01", "2026-02-06", "never", "never"]


def test_hours_that_have_passed_since_that_day_count():
    days = Days(
        date=date(2024, 2, 28), hours=0.0, hours_per_year=8765.82
    )  # 24 hours a day; now: 48 hours after it
    assert days_of(days, CYCLES[:1], 4800.0, 36.0) == ["2024-03-01"]


@pytest.mark.parametrize(
    ("calendar", "said"),
    [
        ({"date": "soon", "hours_per_year": 6000}, "update.calendar.date: 'soon'"),
        ({"date": "2026-01-01"}, "update.calendar.hours_per_year: required"),
        ({"date": "2026-01-01", "hours_per_year": 0}, "hours_per_year: 0 must be greater than 0"),
        ({"date": "2026-01-01", "hours_per_year": 1, "hours": -1}, "hours: -1 must be at least 0"),
        ({"date": "2026-01-01", "hour": 3}, "update.calendar.hour: unknown key, did you mean 'hours'?"),
    ],
)
def test_a_wrong_calendar_gets_one_line(calendar, said):
    with pytest.raises(CampaignError) as caught:
        read_update({"unknown": UNKNOWN, "calendar": calendar})
    assert any(said in line for line in caught.value.problems)


def test_no_cycles_from_the_last_inspection_are_its_own_day():
    days = Days(date=date(2023, 4, 3), hours=0.0, hours_per_year=6200.0)
    for day, told in (
        (945, "2025-11-03"),
        (347, "2024-03-15"),
    ):  # 347: a day earlier, where the rounding goes down
        hours = day * 6200.0 / 365.2425  # as read from a table of dates
        for cycle in (36.0, 1.0, 0.0612):
            now = hours * 3600.0 / cycle
            assert days_of(days, CYCLES[:1], now, cycle) == [told]

"""The day on which a life ends."""

from datetime import date

import numpy as np
import pytest
import xarray as xr

from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.update import read_update
from wearlab.campaign.update_options import Days
from wearlab.updating.calendar import Calendar, day_number
from wearlab.updating.layout import places_of
from wearlab.updating.measurements import UpdateError, read_observations
from wearlab.updating.report_text import _at, answers
from wearlab.updating.report_text import calendar_of as told_of
from wearlab.updating.unit_clock import calendar_of

UNKNOWN = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
CYCLES = np.array([0.0, 36_525.0, np.inf, 1e12])


def days_of(days, rest, now, seconds=36.0):
    return Calendar.of(days).in_cycles(0.0, now, seconds).texts(now + rest).tolist()


def test_a_tenth_of_a_year_of_hours_is_a_tenth_of_a_year():
    days = Days(
        date=date(2026, 1, 1), hours=None, hours_per_year=3652.5
    )  # a cycle is 36 s: 36,525 of them are 365.25 hours
    assert days_of(days, CYCLES, 5.0) == ["2026-01-01", "2026-02-06", "never", "never"]


def test_hours_that_have_passed_since_that_day_count():
    days = Days(
        date=date(2024, 2, 28), hours=0.0, hours_per_year=8765.82
    )  # 24 hours a day; now: 48 hours after it
    assert days_of(days, CYCLES[:1], 4800.0) == ["2024-03-01"]


@pytest.mark.parametrize(
    ("calendar", "said"),
    [
        ({"date": "soon", "hours_per_year": 6000}, "update.calendar.date: 'soon'"),
        ({"date": "2026-01-01"}, "update.calendar.hours_per_year: required"),
        (
            {"date": "2026-01-01", "hours_per_year": 0},
            "hours_per_year: 0 must be greater than 0",
        ),
        (
            {"date": "2026-01-01", "hours_per_year": 1, "hours": -1},
            "hours: -1 must be at least 0",
        ),
        (
            {"date": "2026-01-01", "hour": 3},
            "update.calendar.hour: unknown key, did you mean 'hours'?",
        ),
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


WEIGHED = (
    "Datum;Stunden;Verlust "
    "[mg]\n01.03.2026;4000;6,1\n01.09.2026;7000;10,8\n15.01.2027;9300;13,9\n"
)


def weighed(tmp_path, text=WEIGHED):
    """Return a block of a table with dates and hours, and the
    calendar that follows from it.
    """
    (tmp_path / "weighed.csv").write_text(text)
    block = {
        "file": str(tmp_path / "weighed.csv"),
        "quantity": "worn_mass",
        "member": "pinion",
    }
    block |= {
        "columns": {"date": "Datum", "hours": "Stunden", "value": "Verlust"},
        "error": {"sd": "1 mg"},
    }
    data = read_update({"unknown": UNKNOWN, "data": [block]}).data[0]
    return data, calendar_of(data, None, None)


def test_inspections_keep_the_dates_of_their_table(tmp_path):
    """Was a straight line from the first to the last: the second was
    told as 2026-08-29.
    """
    data, days = weighed(tmp_path)
    cycle = read_observations(data, days).time / 36.0
    found = places_of(days.in_cycles(0.0, cycle[-1], 36.0), 0.0)
    places = xr.Dataset({name: ("calendar_place", one) for name, one in found.items()})
    told = [_at(one, 0.01, told_of(places)).split()[0] for one in cycle]
    assert told == ["2026-03-01", "2026-09-01", "2027-01-15"]
    begun = (
        day_number("2026-03-01") - 4000.0 * 320.0 / 5300.0
    )  # as from the first inspection to the last
    assert day_number(found["calendar_date"][0]) == pytest.approx(begun, abs=1e-4)
    assert found["calendar_date"][-1][:10] == "2028-01-15"  # a year on


def test_a_table_in_which_dates_fall_as_hours_rise_is_refused_by_its_lines(tmp_path):
    with pytest.raises(
        UpdateError, match="line 3 has more hours than line 2, and an earlier date"
    ):
        weighed(tmp_path, WEIGHED.replace("01.09.2026", "01.09.2025"))


@pytest.mark.parametrize(
    ("rest", "said"),
    [
        (
            (5.0, 5.0, 5.0),
            "is reached on 2027-01-15, with 90 % between 2027-01-15 and 2027-01-15: 5 "
            "h after",
        ),
        (
            (0.0, 5.0, 5.0),
            "is reached on 2027-01-15, with 90 % between before 2027-01-15 and "
            "2027-01-15: 5 h after",
        ),
        ((0.0, 0.0, 0.0), "was reached before the last inspection, 2027-01-15."),
        (
            (0.0, 0.0, 5.0),
            "before the last inspection, 2027-01-15; with 5 % it is reached more than "
            "5 h after",
        ),
    ],
)
def test_a_limit_that_has_passed_is_not_told_as_reached_on_the_day_of_the_inspection(
    rest, said
):
    """Was 'limit reached on 2027-01-15' of a limit that had passed
    eight thousand hours before.
    """
    five = np.interp(range(5), (0, 2, 4), rest)
    predictions = xr.Dataset(
        {
            "remaining_useful_life_quantile": ("quantile", five),
            "end_of_life_quantile": ("quantile", np.full(5, "2027-01-15", object)),
            "seconds_per_cycle": 3600.0,
            "limit": ((), 2e-5, {"quantity": "max_wear_depth", "where": "pinion"}),
        }
    )
    assert said in answers(xr.DataTree.from_dict({"predictions": predictions}))[0]


def test_days_that_two_tables_know_are_known_together():
    one = Calendar(
        day_number(["2026-01-01", "2026-03-01"]), np.array([0.0, 590.0]), 3652.425
    )
    both = one.joined(
        [Calendar(np.atleast_1d(day_number("2026-02-01")), np.array([100.0]), 1.0)]
    )
    told = [
        "2026-01-16",
        "2026-02-01",
        "2026-03-01",
        "2026-03-02",
    ]  # ten hours a day after the last
    assert both.texts(np.array([50.0, 100.0, 590.0, 600.0])).tolist() == told

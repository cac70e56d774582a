"""One clock for a unit: tables, record and calendar tell the same hours, or are
refused with the two days that contradict each other.
"""

import numpy as np
import pytest
from conftest import STATIC

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.updating import UpdateError
from wearlab.updating.calendar import Calendar, day_number
from wearlab.updating.cases import studies

TABLE = STATIC.replace('cycle = "cycles"', 'hours = "hours", date = "date"')
BY_DATES = """[update.record]
file    = "record.csv"
columns = { date = "date" }
units   = { torque = "N*m", speed = "rpm" }
"""
ROWS = (
    ("2022-01-01", 0.0),
    ("2023-01-01", 2000.0),
    ("2024-05-12", 5000.0),
    ("2026-06-25", 9000.0),
)
RECORD = "date,torque,speed\n2022-01-01,500,1200\n2024-08-01,0,0\n2024-09-01,250,600\n"
RECORD += "2026-06-25,,\n"


def study(folder, more=BY_DATES, rows=ROWS, record=RECORD):
    (folder / "record.csv").write_text(record)
    table = "".join(f"{day},{hours!r},{0.05 * hours!r}\n" for day, hours in rows)
    (folder / "weighings.csv").write_text("date,hours,loss\n" + table)
    (folder / "clock.toml").write_text(
        TABLE.replace("[[update.data]]", f"{more}\n[[update.data]]")
    )
    return studies(wl.load(folder / "clock.toml"))[0]


def days_of(calendar, hours):
    return calendar.texts(np.array(hours)).tolist()


def test_inspections_beside_a_record_keep_the_dates_of_their_table(tmp_path):
    """Were dated by 8,766 h a year: 2024-05-12 became 2022-07-28."""
    made = study(tmp_path)
    assert days_of(made.calendar, [hours for _, hours in ROWS]) == [d for d, _ in ROWS]


def test_the_record_counts_the_hours_of_the_table(tmp_path):
    record = study(tmp_path).record
    days = day_number(record.dates)
    hours = np.interp(day_number([day for day, _ in ROWS]), days, record.time / 3600.0)
    assert hours == pytest.approx([hours for _, hours in ROWS])
    stop = day_number(["2024-08-01", "2024-09-01"])
    stood = np.interp(stop, days, record.time)
    assert stood[0] == stood[1]
    at_work = record.torque[np.searchsorted(days, stop[0]) - 1]
    assert at_work == 500.0 and len(record.conditions()[0]) == 2
    assert record.excess(6000.0) is None


def test_hours_go_on_as_the_calendar_says_after_the_last_known_day(tmp_path):
    more = f"{BY_DATES}[update.calendar]\ndate = 2026-06-25\nhours_per_year = 4000\n"
    made = study(tmp_path, more)
    assert days_of(made.calendar, [9000.0, 13000.0]) == ["2026-06-25", "2027-06-25"]


def test_a_day_of_the_calendar_is_known_beside_a_table(tmp_path):
    """Was left aside where the table has hours and dates."""
    stated = (
        "[update.calendar]\ndate = 2026-12-25\nhours = 9000\nhours_per_year = 4000\n"
    )
    made = study(tmp_path, stated)
    assert days_of(made.calendar, [9000.0 + 4000.0]) == ["2027-12-25"]


@pytest.mark.parametrize("more", ["", BY_DATES])
def test_a_table_that_goes_on_after_the_record_dates_itself(tmp_path, more):
    record = RECORD.replace("2026-06-25", "2025-06-25")
    made = study(tmp_path, more, record=record)
    assert days_of(made.calendar, [5000.0, 9000.0]) == ["2024-05-12", "2026-06-25"]


WRONG = {
    "a record that begins late": (
        {"record": RECORD.replace("2022-01-01", "2022-11-01")},
        "record.csv has 0 h on 2022-11-01, .*line 3 has 2,000 h on 2023-01-01: more "
        "hours than the days between have",
        {"record": RECORD},
    ),
    "a record that begins after the first row": (
        {"record": RECORD.replace("2022-01-01", "2023-01-01")},
        "record.csv has 0 h on 2023-01-01, where a record begins, but .*line 3 has "
        "2,000 h on 2023-01-01: let the record begin on the day of 0 h",
        {"record": RECORD},
    ),
    "hours in a standstill": (
        {
            "record": RECORD.replace("2024-08-01,0", "2024-05-20,0").replace(
                "2024-09-01", "2026-06-20"
            )
        },
        "line 4 has 5,000 h on 2024-05-12, .*line 5 has 9,000 h on 2026-06-25: "
        "update.record ran for 13 days between, with fewer hours",
        {"record": RECORD},
    ),
    "another pace": (
        {"more": f"{BY_DATES}hours_per_year = 8766\n"},
        "hours_per_year: 8766 puts these hours on 2022-03-25, but .*line 3 has 2,000 h "
        "on 2023-01-01: leave hours_per_year out",
        {"more": BY_DATES},
    ),
    "a calendar before the table": (
        {
            "more": "[update.calendar]\ndate = 2025-01-01\nhours = 9500\n"
            "hours_per_year = 4000\n"
        },
        "line 5 has 9,000 h on 2026-06-25, update.calendar has 9,500 h on 2025-01-01: "
        "more hours on an earlier day; the two contradict each other",
        {
            "more": "[update.calendar]\ndate = 2026-08-25\nhours = 9500\n"
            "hours_per_year = 4000\n"
        },
    ),
    "another last inspection": (
        {"more": "[update.calendar]\ndate = 2026-06-30\nhours_per_year = 4000\n"},
        "update.calendar.date: 2026-06-30 is said to be the day of the last "
        "inspection, but .*line 5 has 9,000 h on 2026-06-25: give that day",
        {"more": "[update.calendar]\ndate = 2026-06-25\nhours_per_year = 4000\n"},
    ),
    "more hours than days": (
        {"rows": (*ROWS, ("2026-06-28", 9200.0))},
        "line 5 has 9,000 h on 2026-06-25, .*line 6 has 9,200 h on 2026-06-28: more "
        "hours than the days between have",
        {"rows": (*ROWS, ("2026-07-28", 9200.0))},
    ),
    "hours that stand while the record runs": (
        {"rows": (*ROWS[:2], ("2024-05-12", 2000.0))},
        "line 3 has 2,000 h on 2023-01-01, .*line 4 has 2,000 h on 2024-05-12: "
        "update.record ran for 497 days between, which count no hour",
        {},
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_two_days_that_contradict_are_refused_and_the_remedy_helps(tmp_path, name):
    wrong, said, right = WRONG[name]
    with pytest.raises(UpdateError, match=said):
        study(tmp_path, **wrong)
    assert study(tmp_path, **right).calendar is not None


def test_the_command_refuses_with_status_2_and_writes_nothing(tmp_path, monkeypatch):
    wrong, *_ = WRONG["a record that begins late"]
    with pytest.raises(UpdateError):
        study(tmp_path, **wrong)
    monkeypatch.chdir(tmp_path)
    status = status_of(["update", "clock.toml"])
    assert status == 2 and not list(tmp_path.rglob("*.nc"))


def change_after(folder, more, hours_per_year):
    stated = "[update.calendar]\ndate = 2026-06-25\nhours_per_year = "
    return study(folder, f"{more}{stated}{hours_per_year}\n").calendar.pace_change


@pytest.mark.parametrize("more", ["", BY_DATES])
def test_another_pace_from_now_on_is_said_and_the_remedy_silences_it(tmp_path, more):
    """9,000 h between 2022-01-01 and 2026-06-25 are 2,009 h a year."""
    change = change_after(tmp_path, more, 8000)
    assert change.until == pytest.approx(9000.0 / 1636.0 * 365.2425)
    assert (change.day, change.after) == ("2026-06-25", 8000.0)
    assert change_after(tmp_path, more, 2009) is None
    assert study(tmp_path, more).calendar.pace_change is None


def test_the_pace_is_that_until_the_last_known_day_where_a_record_goes_on(tmp_path):
    stated = "[update.calendar]\ndate = 2024-05-12\nhours_per_year = 8000\n"
    made = study(tmp_path, f"{BY_DATES}{stated}", rows=ROWS[:3])
    change = made.calendar.pace_change
    assert change.day == "2024-05-12"
    assert change.until == pytest.approx(5000.0 / 862.0 * 365.2425)


def test_one_known_day_has_no_pace():
    calendar = Calendar(day_number(["2026-06-25"]), np.array([np.nan]), 8000.0)
    assert calendar.pace_change is None

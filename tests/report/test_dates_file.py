"""The days of an update as a table or a calendar, read as their users read them."""

import csv
import io
import re
import sys
from datetime import date, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from wearlab.cli.app import status_of
from wearlab.report.dates_file import HEADS, content_of, refuse_format
from wearlab.store.files import StoreError

TODAY = "2026-06-30"
NAMES = np.array(["G1", "=G2, müde", "G3"], object)
DAYS = np.array(
    [
        ["2027-01-01", "2027-02-01", "2027-03-01", "2027-04-01", "2027-05-01"],
        ["2026-01-01", "2026-02-01", "2026-03-01", "2026-04-01", "2027-05-01"],
        ["2026-01-01", "2026-02-01", "2028-03-01", "never", "never"],
    ],
    object,
)


@pytest.fixture
def tree():
    """Return a fleet of three: one in time, one overdue, one never measured."""
    each = {
        "now": [1000.0, 2000.0, 0.0],
        "today_cycle": [1500.0, 2500.0, 19670.0],
        "seconds_per_cycle": [3600.0] * 3,
        "pace": [1.0, 1.5, 0.9],
        "worn": [0.5, 0.9, 0.0],
        "passed_today": [0.0, 0.7, 0.2],
        "end_passed": [0.0, 0.2, 0.0],
        "p_like_the_others": [0.5, 0.5, np.nan],
    }
    rest = np.array([[5.0, 6, 7, 8, 9], [1, 2, 3, 4, 5], [1, 2, 3, np.inf, np.inf]])
    values = {name: ("unit", np.array(numbers)) for name, numbers in each.items()}
    values["remaining_useful_life_quantile"] = (("unit", "quantile"), rest)
    values["end_of_life_quantile"] = (("unit", "quantile"), DAYS)
    values["today"] = ((), TODAY)
    limit = {"quantity": "max_wear_depth", "where": "pinion"}
    values["limit"] = ((), 6e-5, limit)
    quantiles = [0.05, 0.25, 0.5, 0.75, 0.95]
    predictions = xr.Dataset(values, {"unit": NAMES, "quantile": quantiles})
    notes = "unit G1: weighings.csv: line 3 repeats another line"
    stats = xr.Dataset({"notes": ((), notes)})
    groups = {"predictions": predictions, "sample_stats": stats}
    tree = xr.DataTree.from_dict(
        {**groups, "observed_data": xr.Dataset(), "posterior": xr.Dataset()}
    )
    tree.attrs |= {"title": "fleet", "subject": "a", "id": "b"}
    tree.attrs["created_at"] = "2026-06-30T10:11:12+00:00"
    return tree


def test_a_table_has_a_row_a_unit_what_is_overdue_first(tree):
    text = content_of(tree, Path("fleet.csv")).decode()
    heads, *rows = csv.reader(io.StringIO(text))
    assert tuple(heads) == HEADS
    by_name = {row[0]: dict(zip(heads, row, strict=True)) for row in rows}
    assert [*by_name] == [f"'{NAMES[1]}", "G3", "G1"]  # no formula
    assert by_name["G1"]["limit reached"] == "2027-03-01"
    assert by_name["G1"]["reasons"].endswith("line 3 repeats another line")
    assert by_name["G3"]["hours"] == "19670" and by_name["G3"]["90 % to"] == "never"
    assert by_name["G3"]["reasons"] == "it was never measured"
    assert rows[0][HEADS.index("overdue")] == "yes"


def test_a_workbook_begins_with_the_units_and_its_days_are_days(tree, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    (tmp_path / "fleet.xlsx").write_bytes(content_of(tree, Path("fleet.xlsx")))
    book = openpyxl.load_workbook(tmp_path / "fleet.xlsx")
    first = book.worksheets[0]
    assert book.active is first and first.max_row == 4
    assert [cell.value for cell in first[1]] == [*HEADS]
    assert first["A2"].value == NAMES[1] and first["A2"].data_type == "s"
    assert first["C4"].value == datetime(2027, 3, 1) and first["C4"].is_date
    about = dict(book.worksheets[1].iter_rows(values_only=True))
    assert about["today"] == TODAY and about["title"] == "fleet"


def test_a_calendar_has_an_entry_a_unit_by_rfc_5545(tree):
    content = content_of(tree, Path("fleet.ICS"))
    assert content.count(b"\n") == content.count(b"\r\n")
    assert all(len(line) <= 75 for line in content.split(b"\r\n"))
    text = content.decode().replace("\r\n ", "")
    assert text.startswith("BEGIN:VCALENDAR\r\nVERSION:2.0\r\nPRODID:")
    entries = re.findall("BEGIN:VEVENT\r\n(.*?)END:VEVENT\r\n", text, re.DOTALL)
    assert len(entries) == 3
    names = set()
    for entry, unit in zip(entries, (NAMES[1], "G3", "G1"), strict=True):
        alarm = entry.partition("BEGIN:VALARM")[2]
        assert re.search(
            r"ACTION:DISPLAY\r\nTRIGGER;VALUE=DATE-TIME:\d{8}T\d{6}Z", alarm
        )
        assert f"SUMMARY:{unit.replace(',', chr(92) + ',')}: " in entry
        assert "DTSTAMP:20260630T101112Z\r\n" in entry
        begin, end = re.findall(r"DT(?:START|END);VALUE=DATE:(\d{8})", entry)
        days = date.fromisoformat(end) - date.fromisoformat(begin)
        assert days == timedelta(days=1)
        names |= set(re.findall("UID:(.*)\r", entry))
    assert len(names) == 3
    overdue, _, in_time = entries
    assert "DTSTART;VALUE=DATE:20260630" in overdue  # not in the past
    assert "TRIGGER;VALUE=DATE-TIME:20260630T" in overdue
    assert "DTSTART;VALUE=DATE:20270301" in in_time
    assert "TRIGGER;VALUE=DATE-TIME:20270101T" in in_time


def test_units_without_a_median_day_have_an_entry_too(tree):
    """Surely passed: today. Probably never: the lower end, as a reminder."""
    values = tree["predictions"].to_dataset().copy(deep=True)
    ends = values["end_of_life_quantile"].values
    ends[2, 2:] = "never"
    values["passed_today"].values[1] = 1.0
    values["end_passed"].values[1] = 1.0
    tree["predictions"] = values
    text = content_of(tree, Path("fleet.ics")).decode().replace("\r\n ", "")
    entries = re.findall("BEGIN:VEVENT\r\n(.*?)END:VEVENT\r\n", text, re.DOTALL)
    assert len(entries) == 3
    passed, never, _ = entries
    assert "müde: overdue" in passed and "DTSTART;VALUE=DATE:20260630" in passed
    assert "TRIGGER;VALUE=DATE-TIME:20260630T" in passed
    assert "SUMMARY:G3: limit reached" in never
    assert "DTSTART;VALUE=DATE:20260630" in never  # its lower end is in the past


@pytest.mark.parametrize("passed", [1.0, 0.0], ids=["overdue", "never"])
def test_a_fleet_without_one_median_day_has_a_calendar(tree, passed):
    """Refused with "no days are known", though each unit has an entry."""
    values = tree["predictions"].to_dataset().copy(deep=True)
    values["end_of_life_quantile"].values[:, 1:] = "never"
    values["passed_today"].values[:] = values["end_passed"].values[:] = passed
    tree["predictions"] = values
    text = content_of(tree, Path("fleet.ics")).decode()
    assert text.count("BEGIN:VEVENT") == 3


def test_what_cannot_be_written_is_refused_with_a_remedy(tree, monkeypatch):
    with pytest.raises(StoreError, match=r"not '.txt': name it fleet.xlsx"):
        content_of(tree, Path("fleet.txt"))
    refuse_format(Path("fleet.xlsx"))
    tree["predictions"] = (
        tree["predictions"].to_dataset().drop_vars(["end_of_life_quantile", "today"])
    )
    with pytest.raises(StoreError, match="no days are known: give"):
        content_of(tree, Path("fleet.ics"))
    assert content_of(tree, Path("fleet.csv")).count(b"h more") > 3
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(StoreError, match="or name the file"):
        content_of(tree, Path("fleet.xlsx"))


def test_the_command_refuses_before_anything_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert status_of(["update", "absent.toml", "--out", "days.pdf"]) == 2
    assert "ends in .xlsx, .csv or .ics" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())

"""Today is a date of the answer: it is stored, and what is overdue comes first."""

from datetime import date

import numpy as np
import pytest
from test_fleet import FLEET, ROWS, fleet

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.updating import UpdateError, update
from wearlab.updating.cases import studies
from wearlab.updating.identity import subject_of
from wearlab.updating.report_text import (
    fleet_about,
    fleet_tables,
    text_of,
    units_to_open,
)

LATER = date(2026, 2, 1)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return fleet(tmp_path_factory.mktemp("fleet"))


@pytest.fixture(scope="module")
def tree(campaign, store):
    return update(campaign, store, today=LATER, progress=False)


def test_a_unit_never_weighed_has_the_hours_of_its_calendar(tree):
    """Was 0 h, two units were named, and those due before today were not."""
    rows = {row[0]: row for row in fleet_tables(tree)[0][2]}
    since = (LATER - date(2026, 1, 1)).days / 365.2425
    assert rows["new"][1] == f"{6000 * since:,.0f}" and rows["new"][2] == "not measured"
    assert fleet_about(tree).count("hours: on 2026-02-01") == 1


def test_what_is_overdue_comes_first_then_by_the_lower_end(tree):
    predictions = tree["predictions"].to_dataset()
    passed = predictions["passed_today"].values
    lower = predictions["end_of_life_quantile"].values[:, 0]
    order = np.lexsort((lower, passed <= 0.5))
    names = predictions["unit"].values[order].tolist()
    rows = fleet_tables(tree)[0][2]
    assert [row[0] for row in rows] == names
    assert 0 < np.sum(passed > 0.5) < len(passed)
    for row in rows:
        is_overdue = passed[predictions["unit"].values.tolist().index(row[0])] > 0.5
        assert is_overdue == ("overdue" in row[3] or row[3] == "passed")
    opened = [line.split()[1] for line in units_to_open(tree)]
    assert opened == names[: len(opened)]
    assert len(opened) == max(int(np.sum(passed > 0.05)), 2)
    assert any("passed by 2026-02-01" in line for line in text_of(tree))


def test_the_day_is_stored_and_another_day_is_another_answer(campaign, store, tree):
    again = update(campaign, store, today=LATER, progress=False)
    other = update(campaign, store, today=date(2026, 3, 1), progress=False)
    assert again.attrs["id"] == tree.attrs["id"] != other.attrs["id"]
    assert again["predictions"]["today"].item() == "2026-02-01"
    assert other.attrs["subject"] == tree.attrs["subject"] == subject_of(campaign)


def test_without_a_word_it_is_the_day_of_this_machine(campaign, tmp_path):
    assert studies(campaign)[0].spec.today == date.today()
    text = FLEET.replace("[update]", "[update]\ntoday = 2026-03-01")
    stated = fleet(tmp_path, text=text)
    assert studies(stated)[0].spec.today == date(2026, 3, 1)
    assert studies(stated, LATER)[0].spec.today == LATER


def test_a_day_before_an_inspection_is_refused_and_a_later_one_is_not(campaign):
    said = "update.today: 2025-12-01 is before the last inspection of 'A', 2026-01-01"
    with pytest.raises(UpdateError, match=said):
        studies(campaign, date(2025, 12, 1))
    assert studies(campaign, date(2026, 1, 1))


def test_a_day_needs_a_calendar(tmp_path):
    head = FLEET.partition("[[update.unit]]")[0].replace('date = "date", ', "")
    made = fleet(tmp_path, ROWS, head)
    with pytest.raises(UpdateError, match="no operating hours are known on a day"):
        studies(made, LATER)
    assert studies(made)[0].spec.today is None


def test_the_command_takes_a_day_and_refuses_what_is_none(
    campaign, tmp_path, monkeypatch, capsys
):
    fleet(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert status_of(["update", "fleet.toml", "--today", "soon"]) == 2
    assert (
        "--today: 'soon' is no day: write it as 2026-06-30" in capsys.readouterr().err
    )
    assert not list(tmp_path.rglob("*.nc"))

"""Runs that an older version of the model made are not called missing."""

from dataclasses import replace
from pathlib import Path

import pytest
from made_up import SPEEDS, Axis, Campaign, Case, put, run

from wearlab.figures import FigureError
from wearlab.figures.kind import FigureRequest
from wearlab.figures.plotting import plotted
from wearlab.report import page
from wearlab.scene import MODEL_VERSION
from wearlab.store import Store

AXIS = Axis("speed", SPEEDS, "rpm", "operation.speed")
REASON = "of model version 5: run again"


def campaign_of(letters):
    cases = [
        Case("base", letter * 32, {"speed": i}) for i, letter in enumerate(letters)
    ]
    return Campaign(tuple(cases), (AXIS,), path=Path("speeds.toml"))


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """The first two speeds by version 5, the third by this one."""
    store = Store(tmp_path_factory.mktemp("older") / "store")
    store.archive.create()
    versions = (5, 5, MODEL_VERSION)
    for letter, speed, version in zip("abc", SPEEDS, versions, strict=True):
        put(store, letter * 32, run(speed).assign_attrs(model_version=str(version)))
    places = [
        (letter * 32, "base", {"speed": f"{speed:g} rpm"})
        for letter, speed in zip("abc", SPEEDS, strict=True)
    ]
    title = campaign_of("abc").title
    store.archive.catalogue.record_campaign(title, None, "speeds.toml", places)
    return store


def missing_of(store, campaign):
    request = FigureRequest("wear", "max-wear")
    return plotted(store.open(campaign), request)[2]


def test_figures_say_which_version_made_them(store):
    assert missing_of(store, campaign_of("dec")) == (
        f"800 rpm: {REASON}",
        f"1100 rpm: {REASON}",
    )


def test_grids_say_it_of_points_without_data(store):
    grid = store.open(campaign_of("dec"))
    assert list(grid.status.values) == ["missing", "missing", "done"]
    assert list(grid.reason.values) == [REASON, REASON, ""]
    assert grid.attrs["missing"] == [f"speed=800: {REASON}", f"speed=1100: {REASON}"]


def test_a_case_that_this_version_ran_otherwise_is_missing(store):
    grid = store.open(campaign_of("abd"))
    assert grid.attrs["missing"] == ["speed=3720: missing"]


def test_a_figure_without_any_run_says_it(store):
    grid = store.open(campaign_of("def"))
    with pytest.raises(FigureError, match=f"none of its runs .* 800 rpm: {REASON}"):
        missing_of(store, campaign_of("def"))
    assert list(grid.reason.values)[2] == ""


def test_another_file_of_the_same_title_has_no_runs(store):
    other = replace(campaign_of("dec"), path=Path("other.toml"))
    assert store.open(other).attrs["missing"][0] == "speed=800: missing"


def test_reports_say_it_in_the_table(store):
    campaign = campaign_of("dec")
    entries = store.archive.entries(case.id for case in campaign.cases)
    rows = page._rows(campaign, entries, store)
    assert [(row["state"], row["note"]) for row in rows[:2]] == [
        ("missing", REASON)
    ] * 2
    assert rows[2]["state"] == "done"

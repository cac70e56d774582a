"""A case that is not swept stands beside a sweep: a horizontal line,
marked at its own value.
"""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up import Axis, Campaign, Case, Coordinate, put, run

from wearlab.figures.kind import read
from wearlab.figures.plotting import plotted
from wearlab.figures.render import drawn
from wearlab.store import Store

RELIEF = (0.1, 10.0, 18.0, 25.0, 35.0)
PINION, GEAR = "gears.pinion.tip_relief.amount", "gears.gear.tip_relief.amount"


def scene(relief, load="instant"):
    relieved = {"tip_relief": {"amount": relief * 1e-6, "length": 3e-3}}
    return json.dumps(
        {"gears": {"pinion": relieved, "gear": relieved}, "wear": {"load": load}}
    )


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """Lives of 1 to 5 and 7; the fourth run is also that of the case "as built"."""
    store = Store(tmp_path_factory.mktemp("sweep") / "store")
    store.archive.create()
    for index, relief in enumerate(RELIEF):
        data = run(1000.0)
        data["life"] = ((), float(index + 1), data["life"].attrs)
        put(store, f"{index}" * 32, data, scene(relief))
    data = run(1000.0)
    put(
        store,
        "7" * 32,
        data.assign(life=((), 7.0, data["life"].attrs)),
        scene(20.0, "static"),
    )
    return store


@pytest.fixture(scope="module")
def campaign():
    beside = {"amount": Coordinate(RELIEF, "um", GEAR)}
    axis = Axis("relief", RELIEF, "um", PINION, beside)
    cases = [Case("base", f"{i}" * 32, {"relief": i}) for i in range(len(RELIEF))]
    return Campaign(
        (*cases, Case("as built", "3" * 32), Case("light load", "7" * 32)), (axis,)
    )


def test_the_grid_says_where_a_run_stands_at_its_own_place(store, campaign):
    grid = store.open(campaign)
    computed = grid["computed"]
    assert computed.sel(case="base").all()
    assert computed.sel(case="as built").values.tolist() == [
        False,
        False,
        False,
        True,
        False,
    ]
    assert not computed.sel(case="light load").any()  # 20 µm is between two places
    own = json.loads(computed.attrs["own_values"])
    assert own["light load"] == pytest.approx({"relief": 20.0, "amount": 20.0})
    in_si = json.loads(store.open(campaign, si=True)["computed"].attrs["own_values"])
    assert in_si["light load"]["relief"] == pytest.approx(20e-6)


@pytest.mark.parametrize("x", ["amount", "relief"])
@pytest.mark.parametrize("kind", ["line", "scatter"])
def test_no_point_is_left_out_and_cases_are_lines_with_a_mark(store, campaign, x, kind):
    """Was: the base without its 25 µm, both cases as points at 0.1 µm."""
    asked = read(SimpleNamespace(kind=kind, y="life", x=x, hue="case"), 1, None)
    plot, _, missing = plotted(store.open(campaign), asked)
    (panel,) = plot.panels
    base, built, light = panel.curves
    np.testing.assert_allclose(np.sort(base.x), RELIEF)
    np.testing.assert_allclose(np.sort(base.y), [1.0, 2.0, 3.0, 4.0, 5.0])
    assert {built.style, light.style} == {"horizontal"} and not missing
    np.testing.assert_allclose(built.x, [0.1, 25.0, 35.0])
    np.testing.assert_allclose(light.x, [0.1, 20.0, 35.0])
    np.testing.assert_allclose(built.y, 4.0)
    np.testing.assert_allclose(light.y, 7.0)
    assert [entry.text for entry in plot.legend][1:] == ["as built", "light load"]
    lines = [
        line for line in drawn(plot).axes[0].lines if line.get_markevery() is not None
    ]
    marked = [line.get_xdata()[line.get_markevery()].tolist() for line in lines]
    np.testing.assert_allclose(marked, [[25.0], [20.0]])


def test_lines_that_coincide_are_both_seen(store, campaign):
    cases = (*campaign.cases[:-1], Case("the other oil", "3" * 32))
    asked = read(
        SimpleNamespace(kind="line", y="life", x="relief", hue="case"), 1, None
    )
    plot, *_ = plotted(store.open(replace(campaign, cases=cases)), asked)
    levels = [
        line for line in drawn(plot).axes[0].lines if line.get_markevery() is not None
    ]
    (first, _), (second, _) = (line._unscaled_dash_pattern for line in levels)
    assert first != second and levels[0].get_markersize() > levels[1].get_markersize()


def test_the_base_is_called_what_it_is(store, campaign):
    alone = replace(campaign, cases=(*campaign.cases[:5], campaign.cases[-1]))
    grid = store.open(alone)
    assert grid["case"].attrs["base"] == "instant load"
    asked = read(
        SimpleNamespace(kind="line", y="life", x="relief", hue="case"), 1, None
    )
    assert [entry.text for entry in plotted(grid, asked)[0].legend] == [
        "instant load",
        "light load",
    ]
    built = replace(
        campaign, cases=campaign.cases[:6]
    )  # a case that changes nothing but the sweep
    assert store.open(built)["case"].attrs["base"] == "relief swept"


def test_the_base_is_told_from_the_cases_that_change_little(tmp_path, campaign):
    """A static case changes three choices, too many to be told."""
    store = Store(tmp_path / "store")
    store.archive.create()
    given = (
        {"load": "equivalent", "error": "loaded", "model": "modulated"},
        {"load": "equivalent", "error": "unloaded", "model": "modulated"},
        {"load": "static", "error": "none", "model": "pairs"},
    )
    for index, one in enumerate(given):
        put(store, f"{index}" * 32, run(1000.0), json.dumps({"wear": one}))
    cases = (
        Case("base", "0" * 32, {"relief": 0}),
        Case("unloaded", "1" * 32, {"relief": 0}),
        Case("static", "2" * 32),
    )
    assert (
        store.open(replace(campaign, cases=cases))["case"].attrs["base"]
        == "loaded error"
    )
    put(
        store,
        "3" * 32,
        run(1000.0),
        json.dumps({"wear": given[0] | {"contact_patch": "none"}}),
    )
    put(
        store,
        "4" * 32,
        run(1000.0),
        json.dumps({"wear": given[0] | {"contact_patch": "elastic"}}),
    )
    cases = (
        Case("base", "3" * 32, {"relief": 0}),
        Case("spread", "4" * 32, {"relief": 0}),
    )
    assert (
        store.open(replace(campaign, cases=cases))["case"].attrs["base"]
        == "no contact patch"
    )

"""What puzzled a newcomer: a case without its name, a limit that was
set, markers under markers.
"""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from made_up import SPEEDS, Axis, Campaign, Case, put, run

from wearlab.figures import FigureError
from wearlab.figures.kind import no_axis, read
from wearlab.figures.plot import Mark, Panel, Pen
from wearlab.figures.plotting import plotted
from wearlab.figures.render import _sides, strokes
from wearlab.nearest import choices
from wearlab.scene.problems import unknown_key
from wearlab.store import Store


def asked(**wishes):
    return read(SimpleNamespace(**wishes), 1, None)


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Three speeds whose lives ended at the limit of their work, and a static case with
    a life, made up.
    """
    store = Store(tmp_path_factory.mktemp("ended") / "store")
    store.archive.create()
    for index, speed in enumerate(SPEEDS):
        data = (
            run(speed)
            .drop_vars(["life", "service_life"])
            .assign(end_reason=((), "work limit"))
        )
        put(store, f"{index}" * 32, data)
        put(store, f"{index + 5}" * 32, run(speed).assign(end_reason=((), "depth")))
    axis = (Axis("speed", SPEEDS, "rpm", "operation.speed"),)
    base = [Case("base", f"{i}" * 32, {"speed": i}) for i in range(3)]
    static = [Case("static", f"{i + 5}" * 32, {"speed": i}) for i in range(3)]
    return store, Campaign((*base, *static), axis), base


def test_a_life_that_ended_otherwise_says_by_what(ended):
    store, campaign, _ = ended
    grid = store.open(campaign)
    with pytest.raises(
        FigureError, match=r"no selected run has life: .*\(3 by work limit\)"
    ):
        plotted(grid, asked(kind="line", y="life", x="speed", select={"case": "base"}))


def test_the_only_case_drawn_keeps_its_name(ended, tmp_path):
    store, campaign, base = ended
    (tmp_path / "points.csv").write_text("x [rpm],y\n800,1\n", encoding="utf-8")
    wishes = {
        "kind": "line",
        "y": "life",
        "x": "speed",
        "hue": "case",
        "published": tmp_path / "points.csv",
    }
    lost = [replace(case, id="e" * 32) for case in base]
    holed = replace(campaign, cases=(*lost, *campaign.cases[3:]))
    plot, _, missing = plotted(store.open(holed), asked(**wishes))
    assert plot.legend[0].text == "static" and "computed" not in str(plot.legend)
    assert ", base: missing" in missing[0]


def test_a_hue_of_cases_that_were_dropped_is_left_out_and_said(ended):
    store, campaign, _ = ended
    alone = store.open(replace(campaign, cases=campaign.cases[:3]))
    plot, _, _ = plotted(
        alone, asked(kind="line", y="worn_mass", x="speed", hue="case")
    )
    assert any("hue = 'case' tells nothing apart here" in note for note in plot.notes)


def test_published_points_are_hollow_and_larger_than_ours():
    published = strokes(Pen("#000000", "", "o"), "published")
    ours = strokes(Pen("#000000"), "points")
    assert published["mfc"] == "none" and published["ms"] > ours["ms"]


def test_the_outer_words_of_parallel_axes_stay_within_the_figure():
    marks = tuple(
        Mark(float(at), f"cycles to the depth limit\n{at} … 9") for at in range(3)
    )
    assert _sides(Panel(0, 0, "", "", "", (), marks), 1) == ["left", "center", "right"]


def test_what_a_killed_process_left_is_interrupted(ended, tmp_path):
    _, campaign, _ = ended
    store = Store(tmp_path / "store")
    store.archive.create()
    with store.archive.presence() as here:
        store.archive.claim(["0" * 32], here.token, lambda entry: False)
        assert "running" in store.open(campaign).status.values
    assert "interrupted" in store.open(campaign).status.values


def test_a_key_that_is_no_axis_is_answered_by_the_axis_of_its_sweep(plot, ended):
    with pytest.raises(
        FigureError,
        match=r"the sweep of operation.speed is called 'speed'; valid: .*speed",
    ):
        plot(kind="max-wear", hue="operation")


def test_a_legend_of_numbers_says_what_they_are_and_one_of_names_does_not(plot):
    wear = plot(kind="max-wear")
    assert wear.legend[0].text == "800 rpm" and wear.headed[0].text == "speed: 800 rpm"
    assert wear.headed[1:] == wear.legend[1:]
    assert (
        plot(
            kind="wear-profile", hue="update", select={"speed": 800, "flank": "pinion"}
        ).head
        == ""
    )


def test_no_row_of_panels_stands_empty(plot):
    """A static case among speeds has none of them: rows of cases by speed had panels
    without a curve.
    """
    wishes = {"kind": "wear-profile", "rows": "case", "hue": "update"}
    one = plot(**wishes, select={"case": ["base", "static"], "flank": "pinion"})
    assert {panel.row for panel in one.panels} == {*range(one.rows)}
    assert {panel.column for panel in one.panels} == {*range(one.columns)}
    assert all(panel.curves for panel in one.panels) and any(
        "static" in p.title for p in one.panels
    )


def test_one_dimension_cannot_have_two_roles(plot):
    with pytest.raises(
        FigureError, match=r"rows and cols both are 'speed': leave one of them out"
    ):
        plot(kind="wear-profile", rows="speed", cols="speed")


def test_what_is_meant_is_told_by_whole_words_and_long_lists_are_not_told():
    """Was 'did you mean sun-planet-3' of sun-planet, and 180 names
    behind 'did you mean diameter'.
    """
    meshes = ["sun-planet-1", "sun-planet-2", "planet-ring-1"]
    assert choices("sun-planet", meshes).startswith(
        "did you mean 'sun-planet-1' or 'sun-planet-2'? valid: "
    )
    assert (
        choices("diameter [mm]", ["diameter", *map(str, range(50))])
        == "did you mean 'diameter'?"
    )
    assert (
        no_axis("wear state", {}, ["update", "flank"])
        == "wear state is called 'update'"
    )
    assert unknown_key(
        "crowning", ["lead_crowning", "mass", "profile_crowning"]
    ).endswith("did you mean 'lead_crowning' or 'profile_crowning'?")

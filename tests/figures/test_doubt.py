"""Estimated errors are bars, runs in doubt have hollow marks, and one
note says both.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up import Axis, Campaign, Case, put, run

from wearlab.figures import KINDS, doubt
from wearlab.figures.doubt import ESTIMATES, doubts, error_of
from wearlab.figures.kind import read
from wearlab.figures.plot import Curve, Pen
from wearlab.figures.plotting import plotted
from wearlab.figures.render import drawn
from wearlab.schema import VARIABLES, attributes
from wearlab.store import Store

TORQUES = (30.0, 60.0, 90.0)
RELATIVE = {30.0: 0.2, 60.0: 0.05, 90.0: 1e-6}
ORDINARY = [name for name, kind in KINDS.items() if set(kind.needs) <= set(VARIABLES)]


def made(torque):
    """Return a run of a torque [N*m] with errors.

    At 30 N·m no motion repeats, at 60 flanks lose contact.
    """
    data = run(1000.0)
    data["life"] = ((), 1e9 / torque, data["life"].attrs)
    data["service_life"] = ((), 6e7 / torque, data["service_life"].attrs)
    given = {
        "error_estimate_life": RELATIVE[torque] * 1e9 / torque,
        "error_estimate_wear_depth": (
            "update",
            RELATIVE[torque] * np.array([0.0, 1e-6, 5e-6]),
        ),
        "error_estimate_mesh_force": ("update", np.full(3, 30.0)),
        "error_estimate_mesh_force_max": ("update", np.full(3, 48.0)),
        "verdict": "aperiodic" if torque == 30.0 else "completed",
        "estimate_quality": "as usual",
        "validity": "contact lost for 12 % of the period: outside what is known"
        if torque == 60.0
        else "",
    }
    for name, value in given.items():
        data[name] = value if isinstance(value, tuple) else ((), value)
        data[name].attrs = attributes(name)
    return data


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("doubt") / "store")
    store.archive.create()
    for index, torque in enumerate(TORQUES):
        put(store, f"{index}" * 32, made(torque))
    cases = tuple(Case("base", f"{i}" * 32, {"torque": i}) for i in range(3))
    return store.open(
        Campaign(cases, (Axis("torque", TORQUES, "N*m", "operation.torque"),))
    )


def test_a_motion_whose_error_nobody_could_tell_is_drawn(tmp_path):
    """Was: a division by zero where the estimate of a mesh force is
    missing at one wear state.
    """
    data = made(60.0)
    data["error_estimate_mesh_force"][-1] = np.nan
    store = Store(tmp_path / "store")
    store.archive.create()
    put(store, "0" * 32, data)
    grid = store.open(Campaign((Case("base", "0" * 32),)))
    plot = plot_of(grid, kind="mesh-force")
    assert sum(len(panel.curves) for panel in plot.panels) >= 3


def plot_of(grid, **wishes):
    return plotted(grid, read(SimpleNamespace(**wishes), 1, None))[0]


def test_lives_over_a_sweep_have_bars_and_hollow_marks(grid):
    """Was: lives of ±17 and ±23 % drawn as firm points."""
    plot = plot_of(grid, kind="line", y="life", x="torque")
    ((curve,),) = (panel.curves for panel in plot.panels)
    np.testing.assert_allclose(curve.y_error / curve.y, list(RELATIVE.values()))
    assert curve.doubtful.tolist() == [True, True, False]
    assert plot.notes == (
        "Bars and bands: estimated numerical error, up to 20 %. Hollow coloured marks "
        "are in doubt: "
        "30 N·m (aperiodic); 60 N·m (contact lost for 12 % of the period).",
    )
    axes = drawn(plot).axes[0]
    bars = axes.collections[0].get_segments()
    assert len(bars) == 3 and np.ptp(bars[0][:, 1]) == pytest.approx(
        2 * 0.2 * curve.y[0], rel=0.01
    )
    hollow = [line for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata().tolist() for line in hollow] == [[30.0, 60.0]]


def test_a_flank_has_the_error_of_its_own_depth():
    """Was: the largest error of all beside a flank that is worn far less."""
    data = made(60.0)
    flanks = data.sizes["flank"]
    own = np.arange(3.0)[:, None] * np.geomspace(1e-6, 1e-9, flanks)
    data["error_estimate_flank_wear_depth"] = (("update", "flank"), own)
    for name in ("max_wear_depth", "wear_depth"):
        error = error_of(data, name)
        told = error.values if error.ndim == 2 else error.values[..., 0]
        np.testing.assert_allclose(told, own)
    assert "error_estimate_flank_wear_depth" in doubt.variables_for(["max_wear_depth"])


def test_bars_beyond_the_value_say_that_they_leave_it_undecided():
    values = np.array([1.0, 2.0, 4.0])
    error = np.array([0.1, 5.0, 9.0])
    curve = Curve(np.arange(3.0), values, Pen("k"), "points", y_error=error)
    told = doubt.note([], [], [SimpleNamespace(curves=[curve])])
    assert told == (
        "Bars and bands: estimated numerical error, up to 250 %, 2 of 3 beyond the "
        "value itself, which they leave undecided."
    )


def test_cases_show_both_along_x(grid):
    """Was: a run in doubt (±105 %) stood there as a plain number."""
    (panel,) = plot_of(grid, kind="cases", y="service_life").panels
    points = panel.curves[0]
    np.testing.assert_allclose(points.x_error / points.x, list(RELATIVE.values()))
    assert points.y_error is None and points.doubtful.tolist() == [True, True, False]


def test_errors_are_those_of_the_wear_state_and_the_factor(grid):
    wear = plot_of(grid, kind="max-wear").panels[0].curves[0]
    assert (wear.y_error[1:] / wear.y[1:]).tolist() == pytest.approx(
        [0.2 / 1.0, 0.2 * 5.0 / 4.0]
    )
    factor = error_of(made(90.0), "dynamic_factor")
    np.testing.assert_allclose(factor, 0.01)
    np.testing.assert_allclose(error_of(made(90.0), "mesh_force_max"), 48.0)
    np.testing.assert_allclose(error_of(made(90.0), "mesh_force_min"), 30.0)
    forces = plot_of(grid, kind="mesh-force").panels[0].curves
    assert any(
        c.y_error is not None and np.allclose(c.y_error, 30.0)
        for c in forces
        if c.style == "line"
    )


def test_a_bar_ends_at_zero_and_small_errors_are_said_alone(grid):
    plot = plot_of(grid, kind="scatter", y="life", x="torque", select={"torque": 90})
    assert plot.notes == (
        "Estimated numerical error, up to 0.0001 %: too small to be seen.",
    )
    assert not drawn(plot).axes[0].collections


def test_the_note_is_of_the_bars_that_are_drawn(tmp_path):
    """Was: a share of the deepest flank, beside bars of a shallow one."""
    data = made(30.0)
    depth = data["max_wear_depth"].values.copy()
    depth[-1] = [50e-6, 1e-6]
    data["max_wear_depth"] = (("update", "flank"), depth, data["max_wear_depth"].attrs)
    data["error_estimate_wear_depth"][-1] = 1.5e-6
    store = Store(tmp_path / "store")
    store.archive.create()
    put(store, "0" * 32, data)
    grid = store.open(Campaign((Case("base", "0" * 32),)))
    asked = {"kind": "line", "y": "max_wear_depth", "hue": "flank"}
    assert (
        "up to 150 %, 1 of 4 beyond the value itself" in plot_of(grid, **asked).notes[0]
    )
    deep = {**asked, "hue": None, "select": {"flank": "pinion"}}
    assert "up to 3 %." in plot_of(grid, **deep).notes[0]


def test_windows_draw_what_the_note_promises(grid):
    """Was: hollow marks and bars that pages named and did not draw."""
    interactive = pytest.importorskip("wearlab.browsing.interactive")
    lines = plot_of(grid, kind="mesh-force", select={"torque": 30})
    assert "Hollow coloured marks" in lines.notes[-1]
    figure = interactive.drawn(lines)
    handles = [handle for panel in figure.curves for handle in panel]
    assert any("hollow" in handle.source.data for handle in handles)
    marks = [mark for handle in handles for mark in handle.renderers]
    fills = [getattr(mark.glyph, "fill_color", None) for mark in marks]
    assert "white" in fills

    ((points,),) = interactive.drawn(plot_of(grid, kind="cases")).curves[:1]
    assert {"left", "right"} <= points.source.data.keys()


@pytest.mark.parametrize("kind", ORDINARY)
def test_every_kind_names_the_runs_in_doubt(grid, kind):
    wishes = {"y": "dynamic_factor"} if kind == "line" else {}
    plot = plot_of(grid, kind=kind, **wishes)
    assert any("30 N·m (aperiodic)" in note for note in plot.notes)
    drawn(plot)


def test_spectra_in_doubt_are_not_covered_by_their_marks(grid):
    """Was a mark at every order of every spectrum, which hid the peaks."""
    plot = plot_of(grid, kind="waterfall", select={"torque": 30})
    (curve, *_) = plot.panels[0].curves
    long = replace(
        curve,
        x=np.arange(1000.0),
        y=np.ones(1000),
        doubtful=np.ones(1000, bool),
        runs=None,
    )
    panel = plot.panels[0]._replace(curves=(long,))
    _, marks = (
        drawn(plot._replace(panels=(panel,), rows=1, columns=1)).axes[0].lines[:2]
    )
    assert len(marks.get_xdata()) < 12


def test_a_firm_run_without_estimates_says_nothing(plot):
    assert not plot(kind="max-wear").notes


def test_every_estimate_is_declared():
    assert {*ESTIMATES.values()} <= set(VARIABLES)
    named = {
        name.removeprefix("error_estimate_")
        for name in VARIABLES
        if name.startswith("error_estimate_")
    }
    assert named & set(VARIABLES) <= set(ESTIMATES)
    assert doubts(made(90.0)) == ()


def test_large_shares_are_written_out():
    assert [doubt._percent(x) for x in (2.6, 0.9987, 0.093, 1e-6)] == [
        "260",
        "100",
        "9.3",
        "0.0001",
    ]

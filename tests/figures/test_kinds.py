"""What each kind shows, as data."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_up import Campaign, Case, put, run

from wearlab.figures.kind import read
from wearlab.figures.plotting import plotted
from wearlab.store import Store


def named(plot):
    return [entry.text for entry in plot.legend]


def titles(plot):
    return [panel.title for panel in plot.panels]


def test_stiffness_through_an_engagement(plot):
    one = plot(kind="tvms", select={"case": "static"})
    assert len(one.panels) == 1
    assert named(one) == [
        "unworn",
        "3 million cycles (50 h)",
        "100 million cycles (1,670 h)",
    ]
    (panel,) = one.panels
    assert panel.y_label == "Mesh stiffness (N/µm)"
    curve = panel.curves[2]
    assert curve.x[-1] == 1.75
    np.testing.assert_allclose(curve.y[0], 320.0)
    np.testing.assert_allclose(
        curve.y[17], 320.0 + 1 / 16
    )  # the second mesh cycle repeats the first
    assert curve.y[-1] == curve.y[-2]
    marks = {mark.text: mark.x for mark in panel.marks}
    assert marks == pytest.approx(
        {"A": 0.0, "B": 0.75, "C": 0.875, "D": 1.0, "E": 1.75}
    )


def test_one_period_when_x_is_phase(plot):
    (panel,) = plot(kind="tvms", x="phase", select={"case": "static"}).panels
    assert panel.curves[0].x.tolist() == (np.arange(16) / 16).tolist()


def test_a_panel_for_each_speed(plot):
    force = plot(kind="mesh-force")
    assert titles(force) == ["(a) 800 rpm", "(b) 1100 rpm", "(c) 3720 rpm"]
    assert named(force)[-1] == "static force"
    assert force.panels[0].y_label == "Dynamic mesh force (N)"
    reference = next(c for c in force.panels[0].curves if c.style == "reference")
    assert reference.y.tolist() == [4800.0, 4800.0]


def test_a_response_of_fewer_periods_is_repeated(plot):
    """The first state has period one, the last has two: no gap, and
    nothing invented.
    """
    first, _, last, *_ = (
        c for c in plot(kind="mesh-force").panels[0].curves if c.style == "line"
    )
    np.testing.assert_array_equal(first.y[:16], first.y[16:])
    assert not np.array_equal(last.y[:16], last.y[16:])
    assert np.isfinite(first.y).all()


def test_wear_over_cycles_draws_the_broadcast_case_once(plot):
    wear = plot(kind="max-wear")
    assert named(wear) == ["800 rpm", "1100 rpm", "3720 rpm", "static"]
    assert len(wear.panels) == 1
    assert len(wear.panels[0].curves) == 4
    static = wear.panels[0].curves[named(wear).index("static")]
    assert wear.panels[0].x_label == "Wear cycles (millions)"
    assert wear.panels[0].y_label == "Largest wear depth (µm)"
    by_pen = {entry.text: entry.pen for entry in wear.legend}
    static = next(c for c in wear.panels[0].curves if c.pen == by_pen["static"])
    np.testing.assert_allclose(static.x, [0.0, 3.0, 100.0])
    np.testing.assert_allclose(static.y, [0.0, 1.0, 4.0])  # the pinion's


def test_base_alone_when_nothing_is_selected(plot):
    assert len(plot(kind="tvms").panels) == 3
    both = plot(kind="tvms", select={"case": ["base", "static"]})
    assert titles(both) == ["(a) 800 rpm", "(b) 1100 rpm", "(c) 3720 rpm", "(d) static"]
    assert (both.rows, both.columns) == (2, 2)


def test_units_asked_for(plot):
    (panel,) = plot(kind="max-wear", units={"max_wear_depth": "mm"}).panels
    assert panel.y_label == "Largest wear depth (mm)"
    assert max(curve.y.max() for curve in panel.curves) == pytest.approx(0.01488)
    (panel,) = plot(kind="max-wear", units="m").panels
    assert panel.y_label == "Largest wear depth ($10^{-5}$\N{NO-BREAK SPACE}m)"
    assert max(curve.y.max() for curve in panel.curves) == pytest.approx(1.488)
    (panel,) = plot(kind="equivalent-load", units="kN*m").panels
    assert "kN·m" in panel.y_label


def test_harmonics_stop_at_the_third(plot):
    one = plot(kind="dte-harmonics")
    assert named(one) == [
        "RMS of the fluctuation",
        "1st harmonic",
        "2nd harmonic",
        "3rd harmonic",
    ]
    assert len(one.panels) == 3
    stiffness = plot(kind="stiffness-harmonics", select={"speed": 1100})
    assert [panel.y_label for panel in stiffness.panels] == [
        "Mean stiffness (N/µm)",
        "Stiffness fluctuation (N/µm)",
    ]
    np.testing.assert_allclose(
        stiffness.panels[0].curves[0].x, [0.0, 2.2, 5.5]
    )  # the flank worn most


def test_orbits_close_and_bear_their_points(plot):
    (panel,) = plot(kind="phase-plane", select={"speed": 800, "update": -1}).panels
    orbit, strobe = panel.curves
    assert len(orbit.x) == 2 * 16 + 1
    assert (orbit.x[0], orbit.y[0]) == (orbit.x[-1], orbit.y[-1])
    assert strobe.style == "points"
    assert len(strobe.x) == 2
    (panel,) = plot(kind="phase-plane", select={"speed": 800, "update": 0}).panels
    assert [len(curve.x) for curve in panel.curves] == [17, 1]


def test_wear_profiles_keep_their_steps(plot):
    one = plot(kind="wear-profile", select={"case": "static"})
    assert titles(one) == ["(a) pinion", "(b) gear"]
    curve = one.panels[0].curves[0]
    assert curve.x.tolist() == [-7, -3, -1, -1, 0, 1, 1, 4, 7]
    assert [mark.text for mark in one.panels[0].marks] == list("ABCDE")
    assert (
        plot(kind="wear-profile", x="roll_angle").panels[0].x_label == "Roll angle (°)"
    )


def test_a_row_for_each_quantity_along_the_path(plot):
    one = plot(kind="along-path")
    assert (one.rows, one.columns) == (4, 2)
    assert one.share_y == "row"
    assert titles(one)[:2] == ["(a) unworn", "(b) 100 million cycles"]
    assert named(one) == ["800 rpm", "1100 rpm", "3720 rpm"]
    fewer = plot(kind="along-path", y=["sliding_velocity"], select={"case": "static"})
    assert [panel.y_label for panel in fewer.panels] == ["Sliding velocity (m/s)"] * 2


def test_one_pair_through_its_engagement(plot, store, campaign):
    """Slot 1 holds the pair that entered this period, slot 0 the one before."""
    share = store.open(campaign).load_share.sel(case="static", speed=800)[0, 0].values
    (panel,) = plot(kind="load-share", select={"case": "static", "update": 0}).panels
    y = panel.curves[0].y
    np.testing.assert_allclose(y[:16], share[1])
    np.testing.assert_allclose(y[16:], share[0, :13])


def test_campbell(plot):
    (panel,) = plot(kind="natural-modes").panels
    for order, curve in enumerate(panel.curves[:4], 1):
        assert curve.y[1] / curve.x[1] == pytest.approx(
            order * 50 / 60
        )  # teeth per revolution, rpm to Hz
    levels = {float(c.y[0]) for c in panel.curves if c.style == "reference"}
    assert levels == {2000.0, 3000.0, 4000.0}
    at = {float(c.x[0]) for c in panel.curves if c.style == "points" and len(c.x)}
    assert {round(x, 6) for x in at} == {800.0, 1100.0, 3720.0}


def test_line_over_a_sweep(plot):
    one = plot(
        kind="line",
        y="max_wear_depth",
        x="speed",
        select={"cycle": 9e7, "flank": "pinion"},
    )
    (panel,) = one.panels
    assert panel.x_label == "Speed (rpm)"
    swept, level = panel.curves
    assert swept.x.tolist() == [800.0, 1100.0, 3720.0]
    np.testing.assert_allclose(swept.y, [3.2, 4.4, 14.88])
    np.testing.assert_allclose(level.y, [4.0, 4.0])
    assert one.title == "Largest wear depth, 100 million cycles, pinion"


def test_roles_asked_for(plot):
    one = plot(kind="mesh-force", cols="update", hue="speed")
    assert titles(one) == [
        "(a) unworn",
        "(b) 3 million cycles",
        "(c) 100 million cycles",
    ]
    assert named(one)[:3] == ["800 rpm", "1100 rpm", "3720 rpm"]


def test_an_abscissa_with_a_dimension_of_its_own_gives_a_panel_for_each_place(
    plot, store
):
    """Was drawn over the phase, silently: both members have a contact angle, the pair
    has one stiffness.
    """
    select = {"case": "base", "speed": 800, "update": 0, "pair": 1}
    shown = plot(kind="line", y="pair_stiffness", x="contact_angle", select=select)
    assert titles(shown) == ["(a) pinion", "(b) gear"]
    angle = store.run("0" * 32)["contact_angle"].isel(update=0, mesh=0, pair=0)
    for panel, member in zip(shown.panels, ("pinion", "gear"), strict=True):
        (curve,) = panel.curves
        assert panel.x_label.startswith("Contact angle") or "(rad)" in panel.x_label
        np.testing.assert_allclose(curve.x, angle.sel(member=member))


def test_of_a_motion_that_never_repeats_the_first_periods_are_shown(tmp_path):
    store = Store(tmp_path / "store")
    store.archive.create()
    put(store, "0" * 32, run(800.0, mesh_period=200))
    grid = store.open(Campaign((Case("base", "0" * 32, {}),)))
    plot = plotted(grid, read(SimpleNamespace(kind="mesh-force"), 1, None))[0]
    curve = next(c for c in plot.panels[0].curves if c.style == "line")
    assert curve.x[-1] < 20.0 and len(curve.x) == 20 * 16
    assert any("first 20 of 200 mesh periods" in note for note in plot.notes)

"""What a paper's figure needs: axes and sizes of its own, the
author's fonts, panels not squeezed.
"""

from dataclasses import replace

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

import wearlab as wl
from wearlab.figures import FigureError
from wearlab.figures.plot import Curve, Panel, Pen, Plot
from wearlab.figures.render import drawn, rendered
from wearlab.figures.wording import latex


@pytest.fixture
def grid(store, campaign):
    return store.open(campaign)


@pytest.fixture
def axes():
    figure, axes = plt.subplots(1, 3)
    yield axes
    plt.close(figure)


def text_sizes(figure):
    return {
        text.get_text(): text.get_size()
        for text in figure.findobj(matplotlib.text.Text)
        if text.get_text()
    }


def test_a_figure_goes_into_axes_that_are_given(grid, axes):
    figure = wl.figure(grid, "max-wear", ax=axes[0])
    assert figure is axes[0].figure and len(axes[0].lines) == 4 and not axes[1].lines
    assert (
        axes[0].get_xlabel().startswith("Wear cycles")
        and len(axes[0].get_legend().get_texts()) == 4
    )
    wl.figure(grid, "mesh-force", ax=axes)
    assert [ax.get_title(loc="left") or ax.get_title() for ax in axes][1].startswith(
        "(b) 1100"
    )


def test_axes_must_be_as_many_as_panels(grid, axes):
    with pytest.raises(FigureError, match="it has 3 panels and ax holds 1 axes"):
        wl.figure(grid, "mesh-force", ax=axes[0])


def test_text_is_as_large_as_it_is_said_whatever_the_width(grid):
    """Was: text of 6 points in a column of 3.5 inches."""
    column, page = (wl.figure(grid, "max-wear", size=size) for size in ("84 mm", 7.2))
    assert column.get_figwidth() == pytest.approx(84 / 25.4)
    assert page.get_figwidth() == 7.2
    label = "Largest wear depth (µm)"
    assert text_sizes(column)[label] == text_sizes(page)[label] == 9.0
    with pytest.raises(FigureError, match=r"width '84': .* such as 84mm"):
        wl.figure(grid, "max-wear", size="84")
    with pytest.raises(FigureError, match="a figure is 38 to 1016 mm wide"):
        wl.figure(grid, "max-wear", size="5 mm")


def test_ticks_legend_and_notes_go_with_the_text(grid):
    """Was: with font.size = 18 ticks and legend of half that size."""
    plain = wl.figure(grid, "max-wear", size=8.0, note="a note")
    with plt.rc_context({"font.size": 18.0}):
        large = wl.figure(grid, "max-wear", size=8.0, note="a note")
    for size in (
        lambda figure: figure.axes[0].get_xticklabels()[0].get_size(),
        lambda figure: figure.legends[0].get_texts()[0].get_size(),
        lambda figure: figure.get_supxlabel() and figure._supxlabel.get_size(),
    ):
        assert size(large) == pytest.approx(2.0 * size(plain))


def test_a_height_is_kept(grid):
    exact = wl.figure(grid, "max-wear", size=(5.0, 4.5))
    assert exact.get_size_inches().tolist() == [5.0, 4.5]


def test_what_the_reader_has_set_holds_and_files_stay_as_they_are(grid, plot):
    before = rendered(plot(kind="max-wear"), {})
    with plt.rc_context(
        {"font.size": 13.0, "font.serif": ["DejaVu Serif"], "lines.linewidth": 3.0}
    ):
        figure = wl.figure(grid, "max-wear", size=4.0)
        assert (
            text_sizes(figure)["Largest wear depth (µm)"] == 13.0
        )  # set by hand: not scaled
        assert figure.axes[0].yaxis.label.get_family() == ["sans-serif"]
        assert figure.axes[0].lines[0].get_linewidth() == 3.0
        assert rendered(plot(kind="max-wear"), {}) == before


def test_an_empty_title_is_no_title(grid, drawn):
    with_title = wl.figure(grid, "max-wear", title=None)
    without = wl.figure(grid, "max-wear", title="")
    assert without.get_figheight() < with_title.get_figheight()
    assert "Largest wear depth" not in text_sizes(without)
    one, other = drawn({"kind": "max-wear"}, {"kind": "max-wear", "title": ""})
    assert len(one.read_bytes()) > len(other.read_bytes())


def test_texts_become_latex():
    assert latex("50 % of 20 µm, a_b") == r"50 \% of 20 $\mu$m, a\_b"
    assert latex("Depth ($10^{-3}$ m²/N)") == r"Depth ($10^{-3}$ m²/N)".replace(
        "²", "$^{2}$"
    )


def panel(column, end):
    x = np.linspace(0.0, end, 20)
    return Panel(
        0,
        column,
        "",
        "Mesh periods",
        "Force (N)",
        (Curve(x, x, Pen("#000000"), "line"),),
    )


def test_a_panel_of_many_periods_squeezes_no_other():
    """Was: two periods in a twelfth of their panel."""
    shared = drawn(Plot("", (panel(0, 2.0), panel(1, 4.0)), 1, 2)).axes
    own = drawn(Plot("", (panel(0, 2.0), panel(1, 24.0)), 1, 2)).axes
    assert shared[0].get_xlim() == shared[1].get_xlim()
    assert [round(ax.get_xlim()[1], 6) for ax in own] == [2.0, 24.0]


def test_panels_far_apart_have_abscissae_of_their_own():
    """Was: two gears over their diameters squeezed into one axis."""
    first, second = panel(0, 2.0), panel(1, 2.0)
    far = second.curves[0]
    second = second._replace(curves=(replace(far, x=far.x + 90.0),))
    axes = drawn(Plot("", (first, second), 1, 2)).axes
    assert [np.ptp(ax.get_xlim()) for ax in axes] == pytest.approx([2.0, 2.0])


def test_jumps_stand_beside_the_curve_that_they_are_of(plot):
    """Was: jumps upwards in the panel of the run downwards."""
    asked = {"kind": "response-curve", "select": {"speed": 800}, "cols": "direction"}
    panels = plot(**asked).panels
    counts = [
        sum(curve.style == "reference" for curve in panel.curves) for panel in panels
    ]
    assert [panel.title for panel in panels] == ["(a) up", "(b) down"]
    assert counts == [1, 1]


def test_a_waterfall_over_wear(plot):
    (shown, *_) = plot(
        kind="waterfall", y="mesh_deflection_orders", select={"speed": 800}
    ).panels
    assert (
        shown.y_label.startswith("Wear cycles; highest peak") and len(shown.curves) == 3
    )
    peaks = [float(curve.y.max()) for curve in shown.curves]
    assert max(peaks) == peaks[-1]
    (whole, *_) = plot(
        kind="waterfall", y="dte_harmonics", select={"speed": 800}
    ).panels
    assert whole.curves[0].x.size == 3 * 5  # five orders, each a peak of its own


def test_a_bifurcation_over_a_sweep_and_over_wear(plot):
    over = plot(
        kind="bifurcation", y="poincare_deflection", x="speed", select={"update": -1}
    )
    (curve,) = over.panels[0].curves
    assert over.panels[0].x_label == "Speed (rpm)" and curve.style in ("points", "dots")
    assert curve.x.tolist() == [
        800.0,
        800.0,
        1100.0,
        1100.0,
        3720.0,
        3720.0,
    ]  # of period two
    worn = plot(
        kind="bifurcation", y="poincare_deflection", x="cycle", select={"speed": 800}
    )
    assert (
        worn.panels[0].x_label.startswith("Wear cycles")
        and len(worn.panels[0].curves[0].x) == 1 + 1 + 2
    )
    deeper = {"kind": "bifurcation", "y": "poincare_deflection", "x": "max_wear_depth"}
    with pytest.raises(
        FigureError,
        match="x = 'max_wear_depth' has several values there: select a flank",
    ):
        plot(**deeper, select={"speed": 800})  # was an IndexError of numpy
    worn = plot(**deeper, select={"speed": 800, "flank": "pinion"})
    assert worn.panels[0].x_label.startswith("Largest wear depth")


def test_orders_are_stems(plot):
    orders = plot(kind="orders", select={"speed": 800})
    (shown,) = orders.panels
    assert {curve.style for curve in shown.curves} == {"stem"} and len(
        shown.curves
    ) == 3
    assert drawn(orders).axes[0].collections[0].get_segments()[0][0].tolist() == [
        1.0,
        0.0,
    ]

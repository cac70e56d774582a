"""y_as: curves less the first one, values on a logarithmic axis.

Axes without zero are marked.
"""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from wearlab.figures import FigureError
from wearlab.figures.curves import differences_from_first, require_positive
from wearlab.figures.kind import FigureRequest
from wearlab.figures.plot import Curve, Panel, Pen, Plot, Scale, Series
from wearlab.figures.render import _mark_truncated
from wearlab.figures.render import drawn as figure_of
from wearlab.figures.wording import Label


def series(hue: str, y: list[float]) -> Series:
    x_scale = Scale("Phase", "")
    y_scale = Scale("Mesh stiffness", "N/µm")
    return Series(
        {"speed": Label(hue, hue)},
        np.linspace(0.0, 1.0, len(y)),
        np.array(y),
        x_scale,
        y_scale,
    )


def test_the_first_curve_is_taken_from_all_even_on_other_abscissae() -> None:
    found, notes = differences_from_first(
        [series("1 rpm", [1.0, 2.0, 3.0]), series("2 rpm", [1.5, 2.0, 2.5, 3.0, 3.5])],
        {"hue": "speed"},
        FigureRequest("tvms", "01"),
    )
    np.testing.assert_allclose(found[0].y, 0.0)
    np.testing.assert_allclose(found[1].y, 0.5)
    assert (
        found[1].y_scale.label == "change of mesh stiffness"
        and found[1].y_scale.units == "N/µm"
    )
    assert "1 rpm" in notes[0] and "from 1 to 3" in notes[0]


def test_what_cannot_be_drawn_so_is_refused_with_the_reason() -> None:
    with pytest.raises(FigureError, match="needs a second curve"):
        differences_from_first(
            [series("1 rpm", [1.0, 2.0])], {}, FigureRequest("tvms", "01")
        )
    with pytest.raises(
        FigureError, match="needs a second curve"
    ):  # a mean beside harmonics
        mean = replace(series("1 rpm", [1.0, 2.0]), key={})
        differences_from_first(
            [mean, series("1 rpm", [1.0, 2.0])],
            {"hue": "speed"},
            FigureRequest("01", "ste-harmonics"),
        )
    orbit = replace(series("1 rpm", [1.0, 2.0, 1.0]), x=np.array([0.0, 1.0, 0.5]))
    with pytest.raises(FigureError, match=r"01: .*turns back"):
        differences_from_first(
            [orbit, series("2 rpm", [1.0, 2.0])],
            {"hue": "speed"},
            FigureRequest("01", "phase-plane"),
        )
    with pytest.raises(FigureError, match="must be above 0"):
        require_positive([series("1 rpm", [1.0, 0.0])], FigureRequest("tvms", "01"))


def test_either_way_of_drawing_is_another_picture(drawn) -> None:
    plain, less, logarithm = drawn(
        *(
            {"kind": "tvms", "select": {"update": 0}} | extra
            for extra in ({}, {"y_as": "difference"}, {"y_as": "logarithm"})
        )
    )
    assert len({path.read_bytes() for path in (plain, less, logarithm)}) == 3


@pytest.mark.parametrize(
    ("limits", "strokes"),
    [((0.0, 2.0), 0), ((-1.0, 1.0), 0), ((1.0, 2.0), 2), ((-2.0, -1.0), 2)],
)
def test_an_axis_without_zero_is_marked(
    limits: tuple[float, float], strokes: int
) -> None:
    ax = Figure().subplots()
    ax.set_ylim(*limits)
    _mark_truncated(ax)
    assert len(ax.artists) + len(ax.lines) == strokes


def test_panels_that_share_an_axis_show_what_is_negative_in_any_of_them() -> None:
    """The bearings of two gears push opposite ways.

    An axis that begins at zero would hide one.
    """
    x = np.linspace(0.0, 1.0, 5)
    curves = [
        Curve(x, sign * (1.0 + x), Pen("#000000"), "line") for sign in (1.0, -1.0)
    ]
    panels = tuple(
        Panel(row, 0, "", "x", "y", (curve,)) for row, curve in enumerate(curves)
    )
    figure = figure_of(Plot("", panels, 2, 1))
    for axes in figure.axes[:2]:
        low, high = axes.get_ylim()
        assert low <= -2.0 and high >= 2.0

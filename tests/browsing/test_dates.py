"""A figure over dates: Bokeh has milliseconds, tables and sentences have days."""

import numpy as np
import pytest

from wearlab.figures.plot import Curve, Panel, Pen, Plot

interactive = pytest.importorskip(
    "wearlab.browsing.interactive", reason="wearlab[browse] is not installed"
)
summary = interactive.summary
table = interactive.table

DAY = 20_130.5  # noon of 2025-02-11
CURVE = Curve(np.array([DAY, DAY + 10.0]), np.array([1.0, 2.0]), Pen("#000000"), "line")
PLOT = Plot(
    "Wear", (Panel(0, 0, "", "Date", "Depth (µm)", (CURVE,), dates=True),), 1, 1
)


def test_tables_and_sentences_tell_days():
    assert "2025-02-11,1.0" in table(PLOT) and "2025-02-21,2.0" in table(PLOT)
    assert any("largest 2 at 2025-02-21" in line for line in summary(PLOT))


def test_bokeh_gets_milliseconds_and_an_axis_of_dates():
    pytest.importorskip("bokeh")
    from bokeh.models import DatetimeAxis

    from wearlab.browsing.interactive import drawn

    made = drawn(PLOT)
    (handle,) = made.curves[0]
    first = np.datetime64(int(handle.source.data["x"][0]), "ms")
    assert first == np.datetime64("2025-02-11T12:00:00.000")
    assert any(
        isinstance(axis, DatetimeAxis) for axis in made.parts[-1].children[0].xaxis
    )

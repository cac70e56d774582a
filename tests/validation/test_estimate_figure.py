"""The figure of the scores: every scene that has both numbers is a point, in the unit
of its axis.
"""

import math

import numpy as np
import pytest
from estimate_figure import scores_png
from estimate_score import Score
from matplotlib.figure import Figure


@pytest.fixture
def figures(monkeypatch):
    """Return the figures that are written."""
    written = []
    save = Figure.savefig
    monkeypatch.setattr(
        Figure,
        "savefig",
        lambda self, *a, **b: (written.append(self), save(self, *a, **b)),
    )
    return written


def test_every_scene_is_a_point_on_its_side_of_the_line(figures):
    scores = [
        Score((1e-8, 3e-8), (10.0, 40.0), None, 0.1),
        Score((2e-8, 1e-8), (20.0, math.nan), (1.0, 5.0), 0.1),
        Score((3e-8, 9e-8), None, (2.0, 9.0), 0.1),
        Score((7e-8, 1e-8), None, None, 0.1, trusted=False),
    ]
    assert scores_png(scores)[:4] == b"\x89PNG"
    depth, life, force = figures[0].axes[:3]
    doubted, below, above, equal, tenfold = depth.lines
    np.testing.assert_allclose(doubted.get_xydata(), [[7e-2, 1e-2]])
    np.testing.assert_allclose(below.get_xydata(), [[1e-2, 3e-2], [3e-2, 9e-2]])
    np.testing.assert_allclose(above.get_xydata(), [[2e-2, 1e-2]])
    np.testing.assert_allclose(equal.get_ydata(), equal.get_xdata())
    np.testing.assert_allclose(tenfold.get_ydata(), 10.0 * tenfold.get_xdata())
    assert [len(life.lines[1].get_xdata()), len(force.lines[1].get_xdata())] == [1, 2]
    assert "3 scenes, 66.7% below" in depth.get_title()

"""The widest influence comes first; the case without a colon is the base."""

import numpy as np
from matplotlib.figure import Figure

from wearlab.figures.kinds.results import RANK, SENSITIVITY, ranked
from wearlab.figures.plot import Plot, Scale, Series
from wearlab.figures.render import _limits
from wearlab.figures.wording import Label


def point(what, value):
    key = {"influence": Label(what, what)}
    return Series(
        key, np.array([value]), np.zeros(1), Scale("life", "1"), RANK, "line-points"
    )


def test_influences_are_ranked_by_their_range_about_the_base():
    found = ranked(
        [
            point("", 10.0),
            point("speed", 10.5),
            point("speed", 9.8),
            point("torque", 4.0),
            point("wear", 12.0),
        ]
    )
    assert list(found[0].names) == ["torque", "wear", "speed"]
    np.testing.assert_array_equal(found[0].x, [4.0, 10.0])
    np.testing.assert_array_equal(found[2].x, [9.8, 10.0, 10.5])
    np.testing.assert_array_equal(found[2].y, 3.0)
    assert found[-1].style == "reference" and found[-1].x[0] == 10.0


def test_the_first_rank_is_on_top_and_ranks_are_whole():
    axes = Figure().subplots()
    axes.plot([4.0, 10.0], [1.0, 1.0])
    axes.plot([9.0, 11.0], [2.0, 2.0])
    _limits(axes, Plot("", (), 1, 1, ranks=SENSITIVITY.ranks))
    bottom, top = axes.get_ylim()
    assert bottom > 2.0 > 1.0 > top
    assert all(tick == int(tick) for tick in axes.get_yticks())

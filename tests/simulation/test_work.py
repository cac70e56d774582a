"""Bounds on work go by what a right-hand side costs."""

import pytest

from wearlab.assembly import build
from wearlab.simulation.life_run import KEPT_SHARE
from wearlab.simulation.work import (
    MAX_WORK,
    SEARCH_SHARE,
    max_searched,
    max_work,
    units,
)


def test_a_search_for_other_attractors_is_bounded_by_what_its_steps_cost(scene):
    """Thirty million steps of any system took 10 s of some and 200 s
    of those with friction.
    """
    plain = scene("base case")
    rubbed = plain.replace("dynamics.friction", {"coefficient": 0.05})
    one = build(plain).vibration.system
    two = build(rubbed).vibration.system
    assert max_searched(two) < max_searched(one)
    for each in (one, two):
        assert max_searched(each, 10.0 * MAX_WORK / units(each)) == pytest.approx(
            10 * max_searched(each), rel=1e-4
        )
        assert max_searched(each, 1.0) == max_searched(each)
        assert 4 * max_searched(each) * units(each) == pytest.approx(
            SEARCH_SHARE * MAX_WORK, rel=1e-4
        )


def test_a_whole_run_is_bounded_by_twice_its_march(scene):
    parts = build(scene("base case"))
    march = max_work(scene("base case"), parts) * units(parts.vibration.system)
    assert march * (1.0 + KEPT_SHARE) + SEARCH_SHARE * MAX_WORK < 2.0 * march

"""Bounds on work go by what a right-hand side costs."""

import pytest

from wearlab.assembly import build
from wearlab.simulation.life_run import (
    KEPT_SHARE,
    MOST_WORK,
    SEARCH_SHARE,
    most_searched,
    most_work,
    units,
)


def test_a_search_for_other_attractors_is_bounded_by_what_its_steps_cost(scene):
    """Thirty million steps of any system took 10 s of some and 200 s of those with friction."""
    plain = scene("base case")
    rubbed = plain.replace("dynamics.friction", {"coefficient": 0.05})
    one = build(plain).vibration.system
    two = build(rubbed).vibration.system
    assert most_searched(two) < most_searched(one)
    for each in (one, two):
        assert most_searched(each, 10.0 * MOST_WORK / units(each)) == pytest.approx(
            10 * most_searched(each), rel=1e-4
        )
        assert most_searched(each, 1.0) == most_searched(each)
        assert 4 * most_searched(each) * units(each) == pytest.approx(
            SEARCH_SHARE * MOST_WORK, rel=1e-4
        )


def test_a_whole_run_is_bounded_by_twice_its_march(scene):
    parts = build(scene("base case"))
    march = most_work(scene("base case"), parts) * units(parts.vibration.system)
    assert march * (1.0 + KEPT_SHARE) + SEARCH_SHARE * MOST_WORK < 2.0 * march

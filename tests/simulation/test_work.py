"""Bounds on work go by what a right-hand side costs."""

import pytest

from wearlab.assembly import build
from wearlab.scene import SceneError
from wearlab.simulation.life_run import KEPT_SHARE
from wearlab.simulation.work import (
    MAX_WORK,
    SEARCH_SHARE,
    max_searched,
    max_work,
    more_work,
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


def test_a_bound_on_work_holds_however_small_the_tolerance(scene):
    """At 1e-16 it was a million times as much as at 1e-4: no bound."""
    fine = scene("base case").replace("numerics.tolerance", 1e-10)
    usual = scene("base case").replace("numerics.tolerance", 1e-4)
    parts = build(usual)
    assert max_work(fine, parts) == pytest.approx(10.0 * max_work(usual, parts))
    assert more_work(1e-3, 1e-10) == more_work(1e-3, 1e-6) == pytest.approx(1e3**0.5)
    assert more_work(1e-3, 1e-2) == 1.0


@pytest.mark.parametrize("key", ["tolerance", "cycle_tolerance"])
def test_a_tolerance_below_round_off_is_refused(scene, key):
    with pytest.raises(SceneError, match=f"{key}: 1e-16 must be at least 1e-10"):
        scene("base case").replace(f"numerics.{key}", 1e-16)

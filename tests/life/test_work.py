"""Lives whose rates get too dear for the work they may do: they end where they were
asked to, and say so.
"""

import numpy as np
import pytest

from wearlab.life.euler import Fixed
from wearlab.life.integrate import integrate
from wearlab.life.limits import CountedRate, Limits
from wearlab.life.step import Node
from wearlab.life.stiffness import HEAD_START, Work, share_of_depth

DEPTH = 4e-4


class DearOnceDeep:
    """Waves that relax, and rates that waver with the depth, dear
    beyond a quarter of the way.
    """

    def __init__(self, dear):
        self.dear, self.work = dear, 0.0
        self.phase = np.linspace(0.0, 6.0, 30)

    def still(self, h):
        return 1e-11 * np.maximum(0.0, 1.0 - (h - h.mean()) / 5e-6)

    def __call__(self, h):
        deep = h.max() > 0.25 * DEPTH
        self.work += self.dear if deep else 1.0
        wavering = 0.5 * np.sin(h / 5e-6 + self.phase) if deep else 0.0
        return 1e-11 * np.maximum(0.0, 1.0 + wavering - (h - h.mean()) / 5e-6)


def lived(dear, max_work):
    rate = DearOnceDeep(dear)
    return integrate(
        rate, np.zeros(30), limits=Limits(depth=DEPTH), max_work=max_work
    ), rate


def test_a_life_ends_where_it_was_asked_to_and_not_by_its_work():
    bound = 50_000.0
    life, rate = lived(100.0, bound)
    assert life.end_reason == "depth" and life.hurried
    assert rate.work < bound
    exact = lived(0.01, np.inf)[0].cycle[-1]
    assert abs(life.cycle[-1] - exact) < min(
        0.15 * exact, 2.0 * life.error_estimate_life
    )


def test_work_that_suffices_changes_nothing():
    free = lived(0.01, np.inf)[0]
    bounded = lived(0.01, 1e9)[0]
    assert not bounded.hurried
    np.testing.assert_array_equal(bounded.depth, free.depth)


def test_work_that_cannot_suffice_ends_the_life():
    life, _ = lived(100.0, 1_000.0)
    assert life.end_reason == "work limit"


class Even:
    """The same wear everywhere, each rate a piece of work."""

    work = 0.0

    def __call__(self, h):
        self.work += 1.0
        return np.full(h.shape, 1e-11)


@pytest.mark.parametrize(
    ("max_work", "reason"), [(100.0, "depth"), (95.0, "work limit")]
)
def test_a_life_within_two_hundredths_of_its_depth_gets_some_more_work(
    max_work, reason
):
    """A hundred steps of a hundredth each, and a first rate: a hundred rates lead to
    the last but one.
    """
    hundredth = Fixed(size=0.01 * DEPTH / 1e-11)
    life = integrate(
        Even(),
        np.zeros(30),
        limits=Limits(depth=DEPTH),
        method=hundredth,
        max_work=max_work,
    )
    assert life.end_reason == reason


class DearNowAndThen(DearOnceDeep):
    """Orbits that come and go: one rate in eleven is a thousand times
    as dear as the others.
    """

    count = 0

    def __call__(self, h):
        rate = super().__call__(h)
        self.count += 1
        self.work += 1_000.0 if self.count % 11 == 0 and h.max() > 0.25 * DEPTH else 0.0
        return rate


@pytest.mark.parametrize("max_work", [60_000.0, 80_000.0])
def test_steps_are_planned_by_what_rates_cost_on_the_whole(max_work):
    rate = DearNowAndThen(1.0)
    life = integrate(rate, np.zeros(30), limits=Limits(depth=DEPTH), max_work=max_work)
    assert life.end_reason == "depth"


def test_a_life_hurries_before_its_rates_are_used_up():
    life = integrate(
        DearOnceDeep(1.0),
        np.zeros(30),
        limits=Limits(depth=DEPTH),
        max_evaluations=500,
    )
    assert life.end_reason == "depth" and life.hurried


@pytest.mark.parametrize(
    ("work", "way", "late"), [(-0.01, 0.0, False), (0.01, 0.0, True), (0.4, 0.5, False)]
)
def test_a_life_may_be_ahead_of_its_way_by_its_head_start(work, way, late):
    rate = CountedRate(DearOnceDeep(1.0), 1_000, 1_000.0)
    begun = Work(rate, Node(0.0, np.zeros(30), np.ones(30)), 1e-6)
    rate.rate.work = 1_000.0 * (HEAD_START + work)
    left = np.inf if way == 1.0 else 1.0 - way
    assert begun.is_late(rate, Node(way, np.zeros(30), np.ones(30)), left) is late


def test_equal_shares_of_the_depth_reach_the_limit_in_as_many_steps():
    wear, depth, steps = 360e-6, 40e-6, 12
    share = share_of_depth(wear, depth, steps)
    assert depth * (1.0 + share) ** steps == pytest.approx(depth + wear, rel=1e-12)
    assert share_of_depth(wear, 0.0, steps) == np.inf

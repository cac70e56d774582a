import numpy as np
import pytest

from wearlab.life.adaptive import NEAR_JUMP, AdaptiveStepper
from wearlab.life.counted import CountedRate
from wearlab.life.limits import Limits
from wearlab.life.march import evolve
from wearlab.life.spectrum import RADIUS_SAFETY, Spectrum
from wearlab.life.step import Node

SLOW, FAST, FOLD = 1e-12, 3e-12, 1e-5


def jumping(h):
    """The rate triples where the first depth passes the fold; beside it, a mild dependence on depth."""
    return (FAST if h[0] > FOLD else SLOW) / (1.0 + h / 1e-4)


def life_through_the_jump(depth):
    def integral(h):
        return h + h**2 / 2e-4

    return integral(FOLD) / SLOW + (integral(depth) - integral(FOLD)) / FAST


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_jump_is_located_recorded_and_left_behind(tolerance):
    life = evolve(jumping, np.zeros(2), limits=Limits(depth=3e-5), tolerance=tolerance)
    (jump,) = life.jumps
    where = (FOLD + FOLD**2 / 2e-4) / SLOW
    assert jump.cycle == pytest.approx(where, rel=2 * tolerance, abs=0.0)
    assert jump.after[0] / jump.before[0] == pytest.approx(FAST / SLOW, rel=1e-2, abs=0.0)
    assert life.cycle[-1] == pytest.approx(life_through_the_jump(3e-5), rel=2 * tolerance, abs=0.0)
    assert life.count_rate_evaluations < 400


def test_without_a_jump_none_is_found(toys):
    """A steep but continuous change of rate is walked through."""

    def steep(h):
        return SLOW * (2.0 + np.tanh((h - FOLD) / 2e-7))

    life = evolve(steep, np.zeros(1), limits=Limits(depth=2e-5))
    assert life.jumps == ()
    # ∫ dh/(2 + tanh x): 1 before and 3 after, and −ln 3/6·(…) of the width in between is negligible here
    assert life.cycle[-1] == pytest.approx((FOLD + FOLD / 3.0) / SLOW, rel=1e-2, abs=0.0)


class Hysteresis:
    """Two branches that overlap: up at 10 µm, down below 5 µm; each call starts on the last one's branch."""

    def __init__(self):
        self.high = False

    def __call__(self, h):
        self.high = h[0] > FOLD or (self.high and h[0] > 0.5 * FOLD)
        return np.full(1, FAST if self.high else SLOW)

    def remember(self):
        return self.high

    def recall(self, memory):
        self.high = memory


def test_a_rejected_step_leaves_no_memory_of_the_other_branch():
    life = evolve(Hysteresis(), np.zeros(1), limits=Limits(depth=3e-5))
    assert len(life.jumps) == 1
    assert life.cycle[-1] == pytest.approx(FOLD / SLOW + 2 * FOLD / FAST, rel=2e-3, abs=0.0)
    assert np.all(life.rate[life.depth[:, 0] < 0.99 * FOLD] == SLOW)


def test_branches_back_and_forth_stay_bounded():
    """A rate that jumps at 2, 5, 9 and 14 µm."""
    edges = np.array([2e-6, 5e-6, 9e-6, 14e-6])

    def stairs(h):
        return np.full(1, FAST if np.sum(h[0] > edges) % 2 else SLOW)

    life = evolve(stairs, np.zeros(1), limits=Limits(depth=2e-5))
    assert life.cycle[-1] == pytest.approx(
        (2 + 4 + 6) * 1e-6 / SLOW + (3 + 5) * 1e-6 / FAST, rel=2e-3, abs=0.0
    )
    assert len(life.jumps) == 4
    assert life.count_rate_evaluations < 300


LATE = 2e-7
"""By how much the first depth has to be ahead of the second one for the rate to triple [m]."""


def grazing(h):
    """A jump that a life meets at a small angle: an error of one depth by 1 shifts it by some 100."""
    slow = SLOW / (1.0 + h / np.array([1e-5, 0.99e-5]))
    return (3.0 if h[0] - h[1] > LATE else 1.0) * slow


@pytest.mark.parametrize("tolerance", [1e-2, 3e-3, 3e-4])
def test_the_estimate_carries_where_a_grazed_jump_lies(tolerance):
    """Without, the steps alone account for a tenth to two thirds of the error."""

    def until(t):
        return evolve(grazing, np.zeros(2), limits=Limits(cycles=2e8), tolerance=t)

    true, life = until(1e-7), until(tolerance)
    assert len(true.jumps) == len(life.jumps) == 1
    error = float(np.abs(life.depth[-1] - true.depth[-1]).max())
    assert error <= life.error_estimate_depth <= 50.0 * error


class Fragile(Hysteresis):
    """Branches that overlap from 6 to 10 µm; an orbit a tenth of a µm off finds the upper one there."""

    def __init__(self):
        self.high, self.last = False, 0.0

    def __call__(self, h):
        lost = h[0] > 0.6 * FOLD and abs(h[0] - self.last) > 1e-7
        self.high = self.high or h[0] > FOLD or lost
        self.last = h[0]
        return np.full(1, FAST if self.high else SLOW)

    def remember(self):
        return self.high, self.last

    def recall(self, memory):
        self.high, self.last = memory


def test_a_jump_lies_where_small_steps_still_follow_the_branch():
    """What a long step meets beyond 6 µm is the other branch; the one that is followed ends at 10 µm."""
    life = evolve(Fragile(), np.zeros(1), limits=Limits(depth=3e-5))
    (jump,) = life.jumps
    assert jump.cycle == pytest.approx(FOLD / SLOW, rel=2e-3, abs=0.0)
    assert life.cycle[-1] == pytest.approx(FOLD / SLOW + 2 * FOLD / FAST, rel=2e-3, abs=0.0)


def test_a_step_as_long_as_a_jump_is_looked_for_in_is_not_tried_again():
    """(s/ρ) ρ is a hair more than s for some ρ; the step s/ρ was tried again until the work was used up."""

    def jumps(h):
        return np.full(1, FAST if h[0] > 1.05 * FOLD else SLOW)

    tolerance = 3e-3
    short = NEAR_JUMP * tolerance**0.5
    radii = np.linspace(0.6, 1.4, 200) * short / (0.2 * FOLD / SLOW)
    upwards = [one for one in radii if short / (RADIUS_SAFETY * one) * (RADIUS_SAFETY * one) > short]
    assert len(upwards) > 3
    for radius in upwards:
        rate = CountedRate(jumps, 200)
        start = Node(FOLD / SLOW, np.full(1, FOLD), np.full(1, SLOW))
        stepper = AdaptiveStepper(start, rate, tolerance, 1e-7)
        stepper.known.spectrum, stepper.known.looked = Spectrum(radius, 1.0, np.ones(1)), True
        stepper.next_size = FOLD / SLOW
        steps, _ = stepper.advance(start, np.inf)
        assert steps[-1].end.cycle > start.cycle
        assert rate.count < 60

import numpy as np
import pytest

from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits

SLOW, FAST, FOLD = 1e-12, 3e-12, 1e-5


def jumping(h):
    """The rate triples where the first depth passes the fold.

    Beside it, a mild dependence on depth.
    """
    return (FAST if h[0] > FOLD else SLOW) / (1.0 + h / 1e-4)


def life_through_the_jump(depth):
    def integral(h):
        return h + h**2 / 2e-4

    return integral(FOLD) / SLOW + (integral(depth) - integral(FOLD)) / FAST


@pytest.mark.parametrize("tolerance", [3e-3, 1e-3, 1e-4])
def test_jump_is_located_recorded_and_left_behind(tolerance):
    life = integrate(
        jumping, np.zeros(2), limits=Limits(depth=3e-5), tolerance=tolerance
    )
    (jump,) = life.jumps
    where = (FOLD + FOLD**2 / 2e-4) / SLOW
    assert jump.cycle == pytest.approx(where, rel=2 * tolerance, abs=0.0)
    assert jump.rate_after[0] / jump.rate_before[0] == pytest.approx(
        FAST / SLOW, rel=1e-2, abs=0.0
    )
    assert life.cycle[-1] == pytest.approx(
        life_through_the_jump(3e-5), rel=2 * tolerance, abs=0.0
    )
    assert life.count_rate_evaluations < 400


def test_without_a_jump_none_is_found(toys):
    """A steep but continuous change of rate is walked through."""

    def steep(h):
        return SLOW * (2.0 + np.tanh((h - FOLD) / 2e-7))

    life = integrate(steep, np.zeros(1), limits=Limits(depth=2e-5))
    assert life.jumps == ()
    # ∫ dh/(2 + tanh x): 1 before and 3 after, and −ln 3/6·(…) of the width in between
    # is negligible here
    assert life.cycle[-1] == pytest.approx(
        (FOLD + FOLD / 3.0) / SLOW, rel=1e-2, abs=0.0
    )


class Hysteresis:
    """Two branches that overlap: up at 10 µm, down below 5 µm.

    Each call starts on the last one's branch.
    """

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
    life = integrate(Hysteresis(), np.zeros(1), limits=Limits(depth=3e-5))
    assert len(life.jumps) == 1
    assert life.cycle[-1] == pytest.approx(
        FOLD / SLOW + 2 * FOLD / FAST, rel=2e-3, abs=0.0
    )
    assert np.all(life.rate[life.depth[:, 0] < 0.99 * FOLD] == SLOW)


def test_branches_back_and_forth_stay_bounded():
    """A rate that jumps at 2, 5, 9 and 14 µm."""
    edges = np.array([2e-6, 5e-6, 9e-6, 14e-6])

    def stairs(h):
        return np.full(1, FAST if np.sum(h[0] > edges) % 2 else SLOW)

    life = integrate(stairs, np.zeros(1), limits=Limits(depth=2e-5))
    assert life.cycle[-1] == pytest.approx(
        (2 + 4 + 6) * 1e-6 / SLOW + (3 + 5) * 1e-6 / FAST, rel=2e-3, abs=0.0
    )
    assert len(life.jumps) == 4
    assert life.count_rate_evaluations < 400


class Fragile(Hysteresis):
    """Branches that overlap from 6 to 10 µm.

    An orbit a tenth of a µm off finds the upper one there.
    """

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
    """What a long step meets beyond 6 µm is the other branch.

    The one that is followed ends at 10 µm.
    """
    life = integrate(Fragile(), np.zeros(1), limits=Limits(depth=3e-5))
    (jump,) = life.jumps
    assert jump.cycle == pytest.approx(FOLD / SLOW, rel=2e-3, abs=0.0)
    assert life.cycle[-1] == pytest.approx(
        FOLD / SLOW + 2 * FOLD / FAST, rel=2e-3, abs=0.0
    )

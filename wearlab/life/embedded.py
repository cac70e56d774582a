"""A fourth-order method with an embedded estimate, for stretches that are not stiff.

Four rates a step, the last of which is the first of the next: Kutta's 3/8 rule, and beside it the third order
with weights 1/12, 1/2, 1/4, 0 and, for the rate at the end, 1/6. The two differ by ``z⁴(1 − z/2)/72`` for
``z = λ ΔN``, and a step is wrong by ``z⁵/120``: at most ``0.6 ρ ΔN`` of the difference. Twice that is
reported, because where the rate is not linear the fifth order is not that of one wave. Wherever in the step
the rate jumps, the difference sees it: no two of its rates cancel. Stages are kept at or above the depth at
the start, where the solution lies: wear never refills a flank.

Source: Kutta, Z. Math. Phys. 46 (1901) 435–453; the orders of both are in the tests.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array

Rate = Callable[[Array], Array]

REACH = 2.5
"""ΔN ρ up to which it is used; it is stable to 2.8 on the real axis and on the imaginary one."""
LEAST = 0.15
"""Least ρ ΔN that counts: where the rate has a kink, fourth order is not reached."""
REPORTED = 1.2
"""Reported error over ρ ΔN times the difference of the two orders."""
NOISE = 1e-6
"""Change of the rate, over the rate, from which it tells of ∂r/∂h."""


class Begun(NamedTuple):
    """The first two thirds of a step: the rates there, and what they tell.

    Parameters
    ----------
    second, third : (n,) rates at one and at two thirds [m per cycle]
    bend : (n,) second difference of the rates so far, (ΔN ∂r/∂h)²/3 of the rate where it is linear
    seen : what ∂r/∂h makes of the first difference over its length, at most |∂r/∂h| [1/cycle]
    """

    second: Array
    third: Array
    bend: Array
    seen: float

    def foreseen(self, size: float, radius: float) -> Array:
        """Return the error that the whole step will be found to have, from below, (n,) [m]."""
        return reported(size * size * self.seen * self.bend / 24.0, size * max(radius, self.seen))


def begin(rate: Rate, h: Array, r: Array, size: float) -> Begun:
    """Return the first two thirds of a step of ``size`` cycles from depth h with rate r."""
    second = rate(h + size * r / 3.0)
    third = rate(np.maximum(h, h + size * (second - r / 3.0)))
    bend = r - 2.0 * second + third
    return Begun(second, third, bend, _seen(bend, size * (second - r), r))


def complete(rate: Rate, h: Array, r: Array, size: float, begun: Begun) -> tuple[Array, Array, Array, float]:
    """Return wear depth and rate one step later, how far the companion is from it, and the decay seen.

    Parameters
    ----------
    rate : r(h) [m per cycle]
    h, r : (n,) depth [m] and rate there
    size : ΔN [1]
    begun : the first two thirds

    Returns
    -------
    depth, rate, difference : (n,) [m], [m per cycle], [m]
    seen : what ∂r/∂h makes of differences of the stages over their length, at most |∂r/∂h| [1/cycle]
    """
    second, third = begun.second, begun.third
    fourth = rate(np.maximum(h, h + size * (r - second + third)))
    end = h + size * (r + 3.0 * second + 3.0 * third + fourth) / 8.0
    fifth = rate(end)
    bend = 4.0 * fifth - r + 3.0 * (second - third - fourth)
    way = 0.5 * size * (fourth - r + 3.0 * (second - third))
    return end, fifth, size * bend / 24.0, max(begun.seen, _seen(bend, way, r))


def reported(difference: Array, fastest: float) -> Array:
    """Return the estimated error of a step, ``1.2 ρ ΔN`` of its difference from the companion, (n,) [m]."""
    return np.asarray(REPORTED * max(LEAST, fastest) * difference)


def _seen(change: Array, way: Array, r: Array) -> float:
    """Return a change of rate over the change of depth that caused it, 0 where it is noise [1/cycle].

    Differences of rates of rising order are what ∂r/∂h makes of the rate once, twice, three times: a power
    iteration that costs nothing.
    """
    length, moved = float(np.linalg.norm(way)), float(np.linalg.norm(change))
    return moved / length if moved > NOISE * float(np.linalg.norm(r)) and length > 0.0 else 0.0

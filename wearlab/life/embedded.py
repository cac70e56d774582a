"""A third-order method with an embedded estimate, for stretches that are not stiff.

Three rates a step, the last of which is the first of the next: the steps of Bogacki and Shampine. For
``z = λ ΔN`` a step is wrong by ``z⁴/24``. Two companions of second order say how large that is: theirs, which
differs by ``z³(1 − z)/48`` and sees all four rates, but no wave with z = 1; and the midpoint rule, which
differs by ``z³/6`` and shares the first three. So the error is at most 2 ρ ΔN of the one difference and
ρ ΔN/4 of the other, and the larger of the two is reported.

Source: Bogacki, Shampine, Appl. Math. Lett. 2 (1989) 321–325, doi:10.1016/0893-9659(89)90079-7.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACH = 2.0
"""ΔN ρ up to which it is used; it is stable to 2.5 on the real axis, 1.7 on the imaginary one."""
LEAST = 0.1
"""Least ρ ΔN that counts: where the rate has a kink, third order is not reached."""


def step(
    rate: Callable[[Array], Array], h: Array, r: Array, size: float, radius: float
) -> tuple[Array, Array, Array]:
    """Return wear depth and rate one step later, and the estimated local error, (n,) each.

    Parameters
    ----------
    rate : r(h) [m per cycle]
    h, r : (n,) depth [m] and rate there
    size : ΔN [1]
    radius : ρ, the fastest decay at h [1/cycle]
    """
    second = rate(h + 0.5 * size * r)
    third = rate(h + 0.75 * size * second)
    end = h + size * (2.0 * r + 3.0 * second + 4.0 * third) / 9.0
    fourth, share = rate(end), size * max(LEAST, size * radius)
    theirs = 2.0 * share * (-5.0 * r + 6.0 * second + 8.0 * third - 9.0 * fourth) / 72.0
    midpoint = 0.25 * share * (2.0 * r - 6.0 * second + 4.0 * third) / 9.0
    return end, fourth, np.where(np.abs(theirs) > np.abs(midpoint), theirs, midpoint)

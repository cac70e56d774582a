"""The two methods of a step: Kutta's fourth order where it is not stiff, RKC2 beyond.

**Fourth order.** Four rates a step, the last of which is the first of the next: Kutta's
3/8 rule, and beside it the third order with weights 1/12, 1/2, 1/4, 0 and, for the rate
at the end, 1/6. The two differ by ``z⁴(1 − z/2)/72`` for ``z = λ ΔN``, and a step is
wrong by ``z⁵/120``: at most ``0.6 ρ ΔN`` of the difference. Twice that is reported,
because where the rate is not linear the fifth order is not that of one wave. Wherever
in the step the rate jumps, the difference sees it: no two of its rates cancel. Stages
are kept at or above the depth at the start, where the solution lies: wear never refills
a flank.

**RKC2**, the stabilised second-order Runge–Kutta–Chebyshev method, for a decaying stiff
part. With s stages it is stable for real λ down to ``ΔN λ = −β(s) ≈ −(2/3) s²``, where
s Euler steps reach 2 s.

Sources: Kutta, Z. Math. Phys. 46 (1901) 435–453, the orders of both are in the tests;
Sommeijer, Shampine, Verwer, J. Comput. Appl. Math. 88 (1997) 315–326,
doi:10.1016/S0377-0427(97)00219-7; wider damping for spectra off the axis: Verwer,
Sommeijer, Hundsdorfer, J. Comput. Phys. 201 (2004) 61–79.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from wearlab.arrays import Array
from wearlab.life.limits import Rate

REACH = 2.5
"""ΔN ρ up to which it is used; it is stable to 2.8 on the real axis and on the
imaginary one."""
MIN_REACH = 0.15
"""Least ρ ΔN that counts: where the rate has a kink, fourth order is not reached."""
REPORTED = 1.2
"""Reported error over ρ ΔN times the difference of the two orders."""
NOISE = 1e-6
"""Change of the rate, over the rate, from which it tells of ∂r/∂h."""


class FourthOrder(NamedTuple):
    """A step of the fourth-order method.

    Parameters
    ----------
    depth, rate : (n,) one step later [m], [m per cycle]
    difference : (n,) how far the companion of third order is from it [m]
    radius_seen : what ∂r/∂h makes of differences of the stages over their length, at
        most
        |∂r/∂h| [1/cycle]
    """

    depth: Array
    rate: Array
    difference: Array
    radius_seen: float


def fourth_order_step(rate: Rate, h: Array, r: Array, size: float) -> FourthOrder:
    """Return a step of ``size`` cycles from depth h (n,) [m] with rate r (n,).

    Parameters
    ----------
    rate : the wear rate
    h : (n,) depth at the start [m]
    r : (n,) rate there [m per cycle]
    size : ΔN [1]
    """
    second = rate(h + size * r / 3.0)
    third = rate(np.maximum(h, h + size * (second - r / 3.0)))
    fourth = rate(np.maximum(h, h + size * (r - second + third)))
    end = h + size * (r + 3.0 * second + 3.0 * third + fourth) / 8.0
    fifth = rate(end)
    early = _radius_of(r - 2.0 * second + third, size * (second - r), r)
    bend = 4.0 * fifth - r + 3.0 * (second - third - fourth)
    way = 0.5 * size * (fourth - r + 3.0 * (second - third))
    return FourthOrder(
        end, fifth, size * bend / 24.0, max(early, _radius_of(bend, way, r))
    )


def fourth_order_error(difference: Array, fastest: float) -> Array:
    """Return the error of a step, estimated from its companion, (n,) [m]."""
    return np.asarray(REPORTED * max(MIN_REACH, fastest) * difference)


def _radius_of(change: Array, way: Array, r: Array) -> float:
    """Return a change of rate over that of depth, 0 where it is noise [1/cycle].

    Differences of rates of rising order are what ∂r/∂h makes of the rate once, twice,
    three times: a power iteration that costs nothing.
    """
    length = float(np.linalg.norm(way))
    moved = float(np.linalg.norm(change))
    return (
        moved / length
        if moved > NOISE * float(np.linalg.norm(r)) and length > 0.0
        else 0.0
    )


SHARP = 2.0 / 13.0
"""Damping for a real spectrum."""
WIDE = 10.0
"""Damping for a spectrum with an imaginary part: half the reach, a much wider strip."""
MAX_STAGES = 60


class Scheme(NamedTuple):
    """Coefficients of RKC2 with s stages; index j = 0…s, paper's μ, ν, μ̃, γ̃.

    Parameters
    ----------
    mu, nu, mu_rate, gamma_rate : (s + 1,) recursion coefficients [1]
    reach : β, the length of the real interval of stability [1]
    """

    mu: tuple[float, ...]
    nu: tuple[float, ...]
    mu_rate: tuple[float, ...]
    gamma_rate: tuple[float, ...]
    reach: float

    @property
    def stages(self) -> int:
        """The number of stages s."""
        return len(self.mu) - 1


@cache
def scheme(stages: int, damping: float = SHARP) -> Scheme:
    """Return the coefficients of RKC2 with ``stages`` ≥ 2 stages.

    ``b_j = T_j''(w0)/T_j'(w0)²``, ``w0 = 1 + ε/s²``, ``w1 = T_s'(w0)/T_s''(w0)``.
    """
    w0 = 1.0 + damping / stages**2
    polynomials = np.eye(stages + 1)
    T, dT, ddT = (
        np.asarray(chebval(w0, chebder(polynomials, order))) for order in range(3)
    )
    w1 = dT[stages] / ddT[stages]
    b = np.empty(stages + 1)
    b[2:] = ddT[2:] / dT[2:] ** 2
    b[:2] = b[2]
    a = 1.0 - b * T
    mu, nu, mu_rate, gamma_rate = np.zeros((4, stages + 1))
    mu_rate[1] = b[1] * w1
    mu[2:] = 2.0 * b[2:] * w0 / b[1:-1]
    nu[2:] = -b[2:] / b[:-2]
    mu_rate[2:] = 2.0 * b[2:] * w1 / b[1:-1]
    gamma_rate[2:] = -a[1:-1] * mu_rate[2:]
    return Scheme(
        mu=tuple(mu.tolist()),
        nu=tuple(nu.tolist()),
        mu_rate=tuple(mu_rate.tolist()),
        gamma_rate=tuple(gamma_rate.tolist()),
        reach=float((w0 + 1.0) / w1),
    )


def stages_for(stiffness: float, damping: float = SHARP) -> Scheme:
    """Return the scheme of fewest stages that is stable at ΔN ρ, or the longest.

    Parameters
    ----------
    stiffness : ΔN ρ [1]
    damping : of the scheme [1]
    """
    fewest = (n for n in range(2, MAX_STAGES) if scheme(n, damping).reach >= stiffness)
    return scheme(next(fewest, MAX_STAGES), damping)


def chebyshev_step(
    rate: Rate, h: Array, r: Array, size: float, coefficients: Scheme
) -> Array:
    """Return the wear depth one step later, second order.

    ``Y_j = (1 − μ_j − ν_j) h + μ_j Y_{j−1} + ν_j Y_{j−2} + μ̃_j ΔN r(Y_{j−1}) + γ̃_j ΔN
    r(h)``. Stages are kept at or above h, where the solution lies: wear never refills a
    flank.

    Parameters
    ----------
    rate : r(h) [m per cycle]
    h, r : (n,) depth at the start and its rate
    size : ΔN [cycles]
    coefficients : Scheme
    """
    mu, nu, mu_rate, gamma_rate, _ = coefficients
    previous = h
    current = h + mu_rate[1] * size * r
    for j in range(2, coefficients.stages + 1):
        worn = size * (mu_rate[j] * rate(current) + gamma_rate[j] * r)
        following = (
            (1.0 - mu[j] - nu[j]) * h + mu[j] * current + nu[j] * previous + worn
        )
        previous = current
        current = np.maximum(following, h)
    return current


def chebyshev_error(h0: Array, h1: Array, r0: Array, r1: Array, size: float) -> Array:
    """Return RKC2's local error, ``0.8 (h0 − h1) + 0.4 ΔN (r0 + r1)``, (n,) [m].

    Parameters
    ----------
    h0, h1 : (n,) depths at start and end [m]
    r0, r1 : (n,) rates there [m per cycle]
    size : ΔN [1]
    """
    return np.asarray(0.8 * (h0 - h1) + 0.4 * size * (r0 + r1))

"""Where two worn flanks touch first: the smallest rotation gap over the driving flank.

For each position of the driving gear the driven flank is turned back until it meets the
first point of the driving one. Nothing is assumed of tangents: concave wear, steps,
kinks and tip corners are all met, and where the flanks are smooth and convex to each
other the answer is that of `wearlab.mesh.exact.kinematics.tangency`.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at
from wearlab.mesh.exact.kinematics import FlankContact, corner_gap, rotation_gap

GOLDEN = 0.3819660112501051
"""Share of a bracket that a step of the golden section takes [1]."""
MINIMISER_TOLERANCE = 3e-9
"""How closely the point of the smallest gap is found, where the gap is flat [m]."""
MAX_MINIMISER_STEPS = 80


class FlankPair(NamedTuple):
    """Two worn flanks, and what bounds the search for their smallest gap.

    Parameters
    ----------
    driving, driven : the flanks
    curvature : smallest c of ``½ c Δs²``, see `gap_curvature` [1/m]
    lowest : (m, 2) least sum of both shifts on the intervals of the driving flank up to
        each one, and from each one on [m]
    """

    driving: Flank
    driven: Flank
    curvature: float
    lowest: Array


def minimum_gap(driving: Flank, driven: Flank, position: ArrayLike) -> FlankContact:
    """Return where flanks touch first when the driving gear has turned to positions.

    ``g(x) = min_s [x − x_driven(s; x)]`` over the driving flank from its form circle to
    its tip corner, and the driven flank likewise.

    Parameters
    ----------
    driving, driven : worn flanks
    position : (n,) x, positions of the driving gear [m along the line of action]

    Returns
    -------
    FlankContact; its ``gap`` is inf, and the points NaN, where the flanks cannot meet
    at all
    """
    x = np.array(position, float).ravel()

    removed = (-driving.shift).min(axis=1)
    up_to = np.minimum.accumulate(removed)
    onwards = np.minimum.accumulate(removed[::-1])[::-1]
    lowest = np.stack([up_to, onwards], axis=1) + driven.shift.min()

    flanks = FlankPair(driving, driven, gap_curvature(driving, driven), lowest)
    s1, s2, gap = _search(flanks, x)
    return FlankContact(s1, s2, x, x - gap)


def gap_curvature(driving: Flank, driven: Flank) -> float:
    """Return the smallest c of ``½ c Δs²``, the gap Δs beside contact [1/m].

    ``c = (ρ1/r_b1)² (1/ρ1 + 1/ρ2)`` external, ``1/ρ1 − 1/ρ2`` for internal pairs.

    Parameters
    ----------
    driving, driven : the flanks
    """
    s = np.append(driving.start, driving.start[-1] + driving.width[-1])
    r_b = driving.base_radius
    rho1 = np.maximum(driving.curvature + driving.side * s, 1e-3 * r_b)
    rho2 = driven.curvature + driven.side * s
    inverse = np.divide(1.0, rho2, out=np.zeros_like(rho2), where=rho2 > 0.0)
    relative_curvature = driving.side / rho1 - driven.side * inverse
    return float(np.min((rho1 / r_b) ** 2 * relative_curvature))


@jit
def _search(flanks: Any, x: Array) -> tuple[Array, Array, Array]:
    """Return the points that touch first, and their gaps, at positions x.

    Parameters
    ----------
    flanks : the two flanks
    x : (n,) positions of the driving gear [m along the line of action]

    Returns
    -------
    path positions of the driving and the driven point, and gaps, each (n,) [m]
    """
    driving = flanks.driving
    s1 = np.empty(len(x))
    s2 = np.empty(len(x))
    gaps = np.empty(len(x))
    end_gaps = np.empty((len(driving.start), 2))
    for i in range(len(x)):
        low, high, best = _fill_end_gaps(flanks, x[i], end_gaps)
        gap, where, partner = _refined(flanks, x[i], low, high, end_gaps, best)

        to_low = x[i] - driving.start[low]
        to_high = driving.start[high] + driving.width[high] - x[i]
        span = max(to_low, to_high)
        s1[i], s2[i], gaps[i] = _at_corners(flanks, x[i], span, where, partner, gap)
    return s1, s2, gaps


@jit_inner
def _fill_end_gaps(flanks, x, end_gaps):  # type: ignore[no-untyped-def]
    """Fill the gaps at both ends of the intervals that may hold the smallest one.

    The search starts at the interval that x lies in, and goes on towards A, then
    towards E. It returns the first and the last interval reached, and the smallest gap
    of their ends.
    """
    middle = interval_of(flanks.driving, x)
    end_gaps[middle, 0] = _gap_at_end(flanks, x, middle, 0)
    end_gaps[middle, 1] = _gap_at_end(flanks, x, middle, 1)
    best = min(end_gaps[middle, 0], end_gaps[middle, 1])
    low, best = _fill_towards(flanks, x, middle, 0, end_gaps, best)
    high, best = _fill_towards(flanks, x, middle, 1, end_gaps, best)
    return low, high, best


@jit_inner
def _fill_towards(  # type: ignore[no-untyped-def]
    flanks, x, middle, far, end_gaps, best
):
    """Fill the gaps at the ends of intervals from the middle one towards A or E.

    ``far`` is the end of an interval that is further from the middle: 0 towards A, 1
    towards E. Returns the last interval that may hold a smaller gap, and the smallest
    gap so far.
    """
    driving = flanks.driving
    near = 1 - far
    onwards = 2 * far - 1
    k = middle
    while 0 <= k + onwards < len(driving.start):
        if _is_lower_bound_reached(flanks, x, k, far, best):
            break
        previous = k
        k = k + onwards
        if driving.shift[k, near] == driving.shift[previous, far]:
            end_gaps[k, near] = end_gaps[previous, far]
        else:
            end_gaps[k, near] = _gap_at_end(flanks, x, k, near)
        end_gaps[k, far] = _gap_at_end(flanks, x, k, far)
        best = min(best, end_gaps[k, 0], end_gaps[k, 1])
    return k, best


@jit_inner
def _is_lower_bound_reached(flanks, x, k, far, best):  # type: ignore[no-untyped-def]
    """Return whether no interval beyond the far end of interval k has a smaller gap.

    The bound is half the quadratic by which unworn flanks part, with the deepest wear
    beyond.
    """
    driving = flanks.driving
    distance = driving.start[k] + far * driving.width[k] - x
    parted = 0.25 * flanks.curvature * distance * distance
    lowest = flanks.lowest[k + 2 * far - 1, far]
    return best < math.inf and parted + lowest >= best


@jit_inner
def _gap_at_end(flanks, x, k, end):  # type: ignore[no-untyped-def]
    """Return the rotation gap at the beginning, 0, or the end, 1, of interval k."""
    driving = flanks.driving
    s = driving.start[k] + end * driving.width[k]
    return rotation_gap(driving, flanks.driven, x, s, driving.shift[k, end])[0]


@jit_inner
def _gap_within(driving, driven, x, k, s):  # type: ignore[no-untyped-def]
    """Return the rotation gap at s in interval k, and the driven point [m]."""
    shift, _ = shift_at(driving, k, s)
    return rotation_gap(driving, driven, x, s, shift)


@jit_inner
def _refined(flanks, x, low, high, end_gaps, best):  # type: ignore[no-untyped-def]
    """Return the smallest gap and its two points.

    Only intervals whose ends are low enough are searched within.
    """
    driving, driven, _, _ = flanks
    gap = math.inf
    where = math.nan
    partner = math.nan
    for k in range(low, high + 1):
        for end in range(2):
            if end_gaps[k, end] < gap:
                gap = end_gaps[k, end]
                where = driving.start[k] + end * driving.width[k]
        lower_end = min(end_gaps[k, 0], end_gaps[k, 1])
        if not lower_end <= best + _sag(end_gaps, low, high, k):
            continue
        inner, s = smallest_within(driving, driven, x, k)
        if inner < gap:
            gap = inner
            where = s
    if gap == math.inf:
        return gap, where, partner

    k = interval_of(driving, where)
    value, partner = _gap_within(driving, driven, x, k, where)
    if value > gap and k > 0:
        # where two intervals meet, the end of the earlier one may be the lower
        shift = driving.shift[k - 1, 1]
        _, partner = rotation_gap(driving, driven, x, where, shift)
    return gap, where, partner


@jit_inner
def _at_corners(flanks, x, span, where, partner, gap):  # type: ignore[no-untyped-def]
    """Return the two points and the gap, of a corner of the driven flank where smaller.

    Corners within ``span`` of x are looked at.
    """
    driving, driven, _, _ = flanks
    for p in range(len(driven.piece) - 1):
        for end in range(2):
            k = driven.piece[p] if end == 0 else driven.piece[p + 1] - 1
            s2 = driven.start[k] + end * driven.width[k]
            if abs(s2 - x) > span:
                continue
            corner, s = corner_gap(driving, driven, x, s2, driven.reached[k, end])
            if corner < gap:
                where = s
                partner = s2
                gap = corner
    return where, partner, gap


@jit_inner
def _sag(end_gaps, low, high, k):  # type: ignore[no-untyped-def]
    """Return how far the gap may sink below the ends of interval k.

    A parabola sinks by an eighth of its second difference at most; all of it is allowed
    for.
    """
    if not (end_gaps[k, 0] < math.inf and end_gaps[k, 1] < math.inf):
        return math.inf
    rise = end_gaps[k, 1] - end_gaps[k, 0]
    if k == low or k == high:
        return abs(rise)
    bend_below = abs(rise - end_gaps[k - 1, 1] + end_gaps[k - 1, 0])
    bend_above = abs(end_gaps[k + 1, 1] - end_gaps[k + 1, 0] - rise)
    bend = max(bend_below, bend_above)
    return bend if bend < math.inf else math.inf


@jit_inner
def smallest_within(
    driving: Flank, driven: Flank, x: float, k: int
) -> tuple[float, float]:
    """Return the smallest rotation gap at x within interval k, and its point [m].

    Brent's method (1973): parabolas through three points, and the golden section where
    they lead nowhere. Of the points looked at, s is the lowest, r the second lowest
    and v the one that r was before.

    Parameters
    ----------
    driving, driven : the flanks
    x : position of the driving gear [m along the line of action]
    k : interval of the driving flank
    """
    a = driving.start[k]
    b = driving.start[k] + driving.width[k]
    s = a + GOLDEN * (b - a)
    g, _ = _gap_within(driving, driven, x, k, s)
    r = s
    g_r = g
    v = s
    g_v = g
    step = 0.0
    previous_step = 0.0

    for _ in range(MAX_MINIMISER_STEPS):
        middle = 0.5 * (a + b)
        if abs(s - middle) <= 2.0 * MINIMISER_TOLERANCE - 0.5 * (b - a):
            break

        step, previous_step = _next_step(
            a, b, s, g, r, g_r, v, g_v, middle, step, previous_step
        )
        length = max(abs(step), MINIMISER_TOLERANCE)
        u = s + math.copysign(length, step)
        g_u, _ = _gap_within(driving, driven, x, k, u)

        if g_u <= g:
            if u >= s:
                a = s
            else:
                b = s
            v = r
            g_v = g_r
            r = s
            g_r = g
            s = u
            g = g_u
            continue

        if u < s:
            a = u
        else:
            b = u
        if g_u <= g_r or r == s:
            v = r
            g_v = g_r
            r = u
            g_r = g_u
        elif g_u <= g_v or v == s or v == r:
            v = u
            g_v = g_u
    return g, s


@jit_inner
def _next_step(  # type: ignore[no-untyped-def]
    a, b, s, g, r, g_r, v, g_v, middle, step, previous_step
):
    """Return the step from s, and the one that counts as the step before it.

    The step leads to the vertex of the parabola through s, r and v when it lies within
    the bracket and the steps shrink, otherwise it is one of the golden section.
    """
    if abs(previous_step) > MINIMISER_TOLERANCE:
        p1 = (s - r) * (g - g_v)
        q1 = (s - v) * (g - g_r)
        p = (s - v) * q1 - (s - r) * p1
        q = 2.0 * (q1 - p1)
        if q > 0.0:
            p = -p
        else:
            q = -q
        is_shrinking = abs(p) < abs(0.5 * q * previous_step)
        if is_shrinking and q * (a - s) < p < q * (b - s):
            trial = p / q
            margin = 2.0 * MINIMISER_TOLERANCE
            if s + trial - a < margin or b - s - trial < margin:
                trial = math.copysign(MINIMISER_TOLERANCE, middle - s)
            return trial, step
    remainder = (a - s) if s >= middle else (b - s)
    return GOLDEN * remainder, remainder

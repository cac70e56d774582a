"""Where two worn flanks touch first: the smallest rotation gap over the driving flank.

For each position of the driving gear the driven flank is turned back until it meets the
first point of the driving one. Nothing is assumed of tangents: concave wear, steps,
kinks and tip corners are all met, and where the flanks are smooth and convex to each
other the answer is that of :mod:`.tangency`.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at
from wearlab.mesh.exact.kinematics import FlankContact, corner_gap, rotation_gap

GOLDEN = 0.3819660112501051
MINIMISER_TOLERANCE = 3e-9  # [m]: the gap is quadratic in it


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
    removed = (-driving.shift).min(
        axis=1
    )  # on the intervals up to, and from, each one at least
    sides = np.minimum.accumulate(removed), np.minimum.accumulate(removed[::-1])[::-1]
    deepest = np.stack(sides, axis=1) + driven.shift.min()
    first, second, gap = _search(
        driving, driven, gap_curvature(driving, driven), deepest, x
    )
    return FlankContact(first, second, x, x - gap)


def gap_curvature(driving: Flank, driven: Flank) -> float:
    """Return the smallest c of ``½ c Δs²``, the gap Δs beside contact [1/m].

    ``c = (ρ1/r_b1)² (1/ρ1 + 1/ρ2)`` external, ``1/ρ1 − 1/ρ2`` for internal pairs.
    """
    s = np.concatenate([driving.start, [driving.start[-1] + driving.width[-1]]])
    rho1 = np.maximum(driving.curvature + driving.side * s, 1e-3 * driving.base_radius)
    rho2 = driven.curvature + driven.side * s
    inverse = np.divide(1.0, rho2, out=np.zeros_like(rho2), where=rho2 > 0.0)
    return float(
        np.min(
            (rho1 / driving.base_radius) ** 2
            * (driving.side / rho1 - driven.side * inverse)
        )
    )


@jit
def _search(driving, driven, parts, deepest, x):  # type: ignore[no-untyped-def]
    m = len(driving.start)
    s1 = np.empty(len(x))
    s2 = np.empty(len(x))
    gaps = np.empty(len(x))
    ends = np.empty((m, 2))
    reached = np.empty(2, np.int64)
    for i in range(len(x)):
        middle = interval_of(driving, x[i])
        ends[middle, 0] = _at_end(driving, driven, x[i], middle, 0)
        ends[middle, 1] = _at_end(driving, driven, x[i], middle, 1)
        best = min(ends[middle, 0], ends[middle, 1])
        for far in range(2):  # towards A, then towards E
            k = middle
            near = 1 - far
            onwards = 2 * far - 1
            while 0 <= k + onwards < m:
                away = driving.start[k] + far * driving.width[k] - x[i]
                # half the quadratic by which unworn flanks part: beyond that no point
                # lies lower
                if (
                    best < math.inf
                    and 0.25 * parts * away * away + deepest[k + onwards, far] >= best
                ):
                    break
                before = k
                k = k + onwards
                same = driving.shift[k, near] == driving.shift[before, far]
                ends[k, near] = (
                    ends[before, far]
                    if same
                    else _at_end(driving, driven, x[i], k, near)
                )
                ends[k, far] = _at_end(driving, driven, x[i], k, far)
                best = min(best, ends[k, 0], ends[k, 1])
            reached[far] = k
        low, high = reached
        gap, where, partner = _refined(driving, driven, x[i], low, high, ends, best)
        span = max(
            x[i] - driving.start[low], driving.start[high] + driving.width[high] - x[i]
        )
        s1[i], s2[i], gaps[i] = _at_corners(
            driving, driven, x[i], span, where, partner, gap
        )
    return s1, s2, gaps


@jit_inner
def _at_end(driving, driven, x, k, end):  # type: ignore[no-untyped-def]
    s = driving.start[k] + end * driving.width[k]
    return rotation_gap(driving, driven, x, s, driving.shift[k, end])[0]


@jit_inner
def _refined(driving, driven, x, low, high, ends, best):  # type: ignore[no-untyped-def]
    """Return the smallest gap and its points; intervals with low ends are searched."""
    gap = math.inf
    where = math.nan
    partner = math.nan
    for k in range(low, high + 1):
        for end in range(2):
            if ends[k, end] < gap:
                gap = ends[k, end]
                where = driving.start[k] + end * driving.width[k]
        if not min(ends[k, 0], ends[k, 1]) <= best + _sag(ends, low, high, k):
            continue
        inner, s = smallest_within(driving, driven, x, k)
        if inner < gap:
            gap, where = inner, s
    if gap < math.inf:
        k = interval_of(driving, where)
        value, partner = rotation_gap(
            driving, driven, x, where, shift_at(driving, k, where)[0]
        )
        if (
            value > gap and k > 0
        ):  # where two intervals meet, the earlier one's end may be the lower
            _, partner = rotation_gap(
                driving, driven, x, where, driving.shift[k - 1, 1]
            )
    return gap, where, partner


@jit_inner
def _at_corners(  # type: ignore[no-untyped-def]
    driving, driven, x, span, where, partner, gap
):
    """Fill where corners of the driven flank within ``span`` of x touch first."""
    for p in range(len(driven.piece) - 1):
        for end in range(2):
            k = driven.piece[p] if end == 0 else driven.piece[p + 1] - 1
            s2 = driven.start[k] + end * driven.width[k]
            if abs(s2 - x) > span:
                continue
            corner, s = corner_gap(driving, driven, x, s2, driven.reached[k, end])
            if corner < gap:
                where, partner, gap = s, s2, corner
    return where, partner, gap


@jit_inner
def _sag(ends, low, high, k):  # type: ignore[no-untyped-def]
    """Return how far the gap may sink below the ends of interval k.

    A parabola sinks by an eighth of its second difference at most; all of it is allowed
    for.
    """
    rise = ends[k, 1] - ends[k, 0]
    if not (ends[k, 0] < math.inf and ends[k, 1] < math.inf):
        return math.inf
    if k == low or k == high:
        return abs(rise)
    bend = max(
        abs(rise - ends[k - 1, 1] + ends[k - 1, 0]),
        abs(ends[k + 1, 1] - ends[k + 1, 0] - rise),
    )
    return bend if bend < math.inf else math.inf


@jit_inner
def smallest_within(
    driving: Flank, driven: Flank, x: float, k: int
) -> tuple[float, float]:
    """Return the smallest rotation gap at x within interval k, and its point [m]."""
    a = driving.start[k]
    b = driving.start[k] + driving.width[k]
    s = a + GOLDEN * (b - a)
    g, _ = rotation_gap(driving, driven, x, s, shift_at(driving, k, s)[0])
    v, g_v, r, g_r = s, g, s, g
    step, before = 0.0, 0.0
    for _ in range(80):
        middle = 0.5 * (a + b)
        if abs(s - middle) <= 2.0 * MINIMISER_TOLERANCE - 0.5 * (b - a):
            break
        step, before = _next_step(a, b, s, g, r, g_r, v, g_v, middle, step, before)
        u = (
            s + step
            if abs(step) >= MINIMISER_TOLERANCE
            else s + math.copysign(MINIMISER_TOLERANCE, step)
        )
        g_u, _ = rotation_gap(driving, driven, x, u, shift_at(driving, k, u)[0])
        if g_u <= g:
            a, b = (s, b) if u >= s else (a, s)
            v, g_v, r, g_r, s, g = r, g_r, s, g, u, g_u
            continue
        a, b = (u, b) if u < s else (a, u)
        if g_u <= g_r or r == s:
            v, g_v, r, g_r = r, g_r, u, g_u
        elif g_u <= g_v or v == s or v == r:
            v, g_v = u, g_u
    return g, s


@jit_inner
def _next_step(  # type: ignore[no-untyped-def]
    a, b, s, g, r, g_r, v, g_v, middle, step, before
):
    """Return the step, parabolic or by the golden section, and the step before."""
    if abs(before) > MINIMISER_TOLERANCE:
        p1 = (s - r) * (g - g_v)
        q1 = (s - v) * (g - g_r)
        p = (s - v) * q1 - (s - r) * p1
        q = 2.0 * (q1 - p1)
        p, q = (-p, q) if q > 0.0 else (p, -q)
        if abs(p) < abs(0.5 * q * before) and q * (a - s) < p < q * (b - s):
            trial = p / q
            near = (
                s + trial - a < 2.0 * MINIMISER_TOLERANCE
                or b - s - trial < 2.0 * MINIMISER_TOLERANCE
            )
            return (
                math.copysign(MINIMISER_TOLERANCE, middle - s) if near else trial
            ), step
    rest = (a - s) if s >= middle else (b - s)
    return GOLDEN * rest, rest

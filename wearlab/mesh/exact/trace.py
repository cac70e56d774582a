"""Where two flanks would touch with a common tangent, traced once over the driving flank.

The rotation gap at x is smallest where its slope vanishes, at tangent points that turn to x, or at an edge.
A trace of the tangent points, three to an interval of the driving flank, tells for every x which interval
that is; two or three evaluations then find the point. Only where the trace does not know (hollows, kinks, the
ends of a flank) is the gap searched for over the flank.
"""

import math
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at
from wearlab.mesh.exact.kinematics import along_normal, corner_gap, excess_distance, root_near, rotation_gap

GOLDEN = 0.3819660112501051
MINIMISER_STEPS = 80
MINIMISER_TOLERANCE = 3e-9  # [m]: the gap is quadratic in it


@jit_inner
def smallest_within(driving: Flank, driven: Flank, x: float, k: int) -> tuple[float, float]:
    """Return the smallest rotation gap at x within interval k of the driving flank, and its point [m]."""
    a, b = driving.start[k], driving.start[k] + driving.width[k]
    s = a + GOLDEN * (b - a)
    g, _ = rotation_gap(driving, driven, x, s, shift_at(driving, k, s)[0])
    v, g_v, r, g_r = s, g, s, g
    step, before = 0.0, 0.0
    for _ in range(MINIMISER_STEPS):
        middle = 0.5 * (a + b)
        if abs(s - middle) <= 2.0 * MINIMISER_TOLERANCE - 0.5 * (b - a):
            break
        step, before = _next_step(a, b, s, g, r, g_r, v, g_v, middle, step, before)
        u = s + step if abs(step) >= MINIMISER_TOLERANCE else s + math.copysign(MINIMISER_TOLERANCE, step)
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
def _next_step(a, b, s, g, r, g_r, v, g_v, middle, step, before):  # type: ignore[no-untyped-def]
    """Return the parabolic step where it can be trusted, else the golden section, and the step before."""
    if abs(before) > MINIMISER_TOLERANCE:
        p1 = (s - r) * (g - g_v)
        q1 = (s - v) * (g - g_r)
        p = (s - v) * q1 - (s - r) * p1
        q = 2.0 * (q1 - p1)
        p, q = (-p, q) if q > 0.0 else (p, -q)
        if abs(p) < abs(0.5 * q * before) and q * (a - s) < p < q * (b - s):
            trial = p / q
            near = s + trial - a < 2.0 * MINIMISER_TOLERANCE or b - s - trial < 2.0 * MINIMISER_TOLERANCE
            return (math.copysign(MINIMISER_TOLERANCE, middle - s) if near else trial), step
    rest = (a - s) if s >= middle else (b - s)
    return GOLDEN * rest, rest


STEP = 1e-13  # [m] by which wear jumps at an edge
KINK = 1e-8  # change of dw/ds at a kink
SLACK = 1e-12  # [m] between the x of neighbouring intervals, of rounding
STEEPNESS = 0.05  # least slope of x over its mean in an interval
CORRECTIONS = 8
CONVERGED = 1e-8  # [m]: the gap is quadratic in it, 1e-15 m
SAFETY = 0.5  # on the quadratic by which unworn flanks part


class Edges(NamedTuple):
    """Points of a flank that may touch without a common tangent: its ends, steps and kinks of its wear.

    Parameters
    ----------
    position : (n,) [m]
    shift : (n,) w there [m]
    """

    position: Array
    shift: Array


class Trace(NamedTuple):
    """Tangent points of a driving flank.

    Parameters
    ----------
    x : (m, 3) positions to which the driving gear has turned when the start, the middle and the end of each
        interval touch [m]
    grows : (m,) whether x grows over the interval, so that each x is the smallest gap of one point
    furthest, nearest : (m,) largest x up to each interval, and smallest x from it on, where it grows [m]
    unknown : intervals of which that is not known; no gap is smallest where x falls, the flank being hollow,
        nor where a point has no partner
    driving, driven : edges of the two flanks
    parts : smallest c of ``½ c Δs²``, by which unworn flanks part Δs from their contact [1/m]
    usable : whether each driving point has one partner on a smooth part of the driven flank, as it is not
        hollowed out more sharply than the driving one is round
    """

    x: Array
    grows: Flags
    furthest: Array
    nearest: Array
    unknown: Index
    driving: Edges
    driven: Edges
    parts: float
    usable: bool


def trace(driving: Flank, driven: Flank) -> Trace:
    """Trace the tangent points of two worn flanks."""
    x = np.empty((len(driving.start), 3))
    part = _smooth_part(driven)
    sense = _fill(driving, driven, part, np.flatnonzero(np.diff(part)) + 1, x)
    grows = sense > 0
    furthest = np.maximum.accumulate(np.where(grows, x[:, 2], -np.inf))
    nearest = np.minimum.accumulate(np.where(grows, x[:, 0], np.inf)[::-1])[::-1]
    return Trace(
        x,
        grows,
        furthest,
        np.ascontiguousarray(nearest),
        np.flatnonzero(sense == 0),
        _edges(driving),
        _edges(driven),
        gap_curvature(driving, driven),
        _single_valued(driving, driven),
    )


def gap_curvature(driving: Flank, driven: Flank) -> float:
    """Return the smallest c of ``½ c Δs²``, by which unworn flanks part Δs from their contact [1/m].

    ``c = (ρ1/r_b1)² (1/ρ1 + 1/ρ2)`` external, ``1/ρ1 − 1/ρ2`` for internal pairs.
    """
    s = np.concatenate([driving.start, [driving.start[-1] + driving.width[-1]]])
    rho1 = np.maximum(driving.curvature + driving.side * s, 1e-3 * driving.base_radius)
    rho2 = driven.curvature + driven.side * s
    inverse = np.divide(1.0, rho2, out=np.zeros_like(rho2), where=rho2 > 0.0)
    relative = driving.side / rho1 - driven.side * inverse
    return float(np.min((rho1 / driving.base_radius) ** 2 * relative))


def _joints(flank: Flank) -> tuple[Index, Array, Array]:
    """Return the intervals that begin a piece but the first, and what shift and slope jump by there."""
    k = flank.piece[1:-1]
    return k, flank.shift[k, 0] - flank.shift[k - 1, 1], flank.slope[k, 0] - flank.slope[k - 1, 1]


def _smooth_part(flank: Flank) -> Index:
    """Return which part between kinks and steps each interval belongs to, (m,)."""
    part = np.zeros(len(flank.start), dtype=np.int64)
    k, step, kink = _joints(flank)
    part[k] = (np.abs(step) > STEP) | (np.abs(kink) > KINK)
    return np.cumsum(part)


def _edges(flank: Flank) -> Edges:
    """Return the edges of a flank: both of a step, for the mate's own step may keep it off the higher one."""
    k, step, kink = _joints(flank)
    steps, kinks = k[np.abs(step) > STEP], k[(np.abs(kink) > KINK) & (np.abs(step) <= STEP)]
    position = [flank.start[steps], flank.start[steps], flank.start[kinks], flank.start[:1]]
    shift = [flank.shift[steps - 1, 1], flank.shift[steps, 0], flank.shift[kinks, 0], flank.shift[:1, 0]]
    return Edges(
        np.concatenate([*position, flank.start[-1:] + flank.width[-1:]]),
        np.concatenate([*shift, flank.shift[-1:, 1]]),
    )


@jit
def _single_valued(driving, driven):  # type: ignore[no-untyped-def]
    """Whether the centre distance at tangency is monotone along every interval of the driven flank."""
    d_n, d_u = _centres(driving, driven)
    f = np.empty(3)
    for k in range(len(driven.start)):
        for i in range(3):
            s2 = driven.start[k] + 0.5 * i * driven.width[k]
            f[i] = excess_distance(driven, k, s2, 0.0, 0.0, d_n, d_u)
        if _sense(f) != (1 if d_u > 0.0 else -1):
            return False
    return True


@jit_inner
def _centres(driving, driven):  # type: ignore[no-untyped-def]
    d_n = driven.side * driven.base_radius - driving.side * driving.base_radius
    return d_n, driven.side * driven.curvature - driving.side * driving.curvature


@jit
def _fill(driving, driven, part, joints, x):  # type: ignore[no-untyped-def]
    """Fill in x at three points of every interval; return 1 where it grows, −1 where none is smallest."""
    m = len(driving.start)
    sense = np.zeros(m, np.int64)
    partner, s_before = np.empty(3), 0.0
    for k in range(m):
        for i in range(3):
            s = driving.start[k] + 0.5 * i * driving.width[k]
            start = s if i == 0 or not partner[i - 1] < math.inf else s + partner[i - 1] - s_before
            x[k, i], partner[i] = _turned_to(driving, driven, joints, k, s, start)
            s_before = s
        if partner.min() == math.inf:
            sense[k] = -1
        elif _in_one_part(driven, part, partner):
            sense[k] = _sense(x[k])
    return sense


@jit_inner
def _sense(x):  # type: ignore[no-untyped-def]
    """Return the sign of the slope of the parabola through three values, 0 where it turns or nearly so."""
    rise = x[2] - x[0]
    begin, end = 4.0 * x[1] - 3.0 * x[0] - x[2], x[0] - 4.0 * x[1] + 3.0 * x[2]
    if min(begin * rise, end * rise) <= STEEPNESS * rise * rise:
        return 0
    return 1 if rise > 0.0 else -1


@jit_inner
def _turned_to(driving, driven, joints, k, s, start):  # type: ignore[no-untyped-def]
    """Return x at which the point s of interval k touches with a common tangent, and its only partner.

    A partner at infinity: there is none, beyond the driven flank's end or round a kink; NaN: there are two.
    """
    d_n, d_u = _centres(driving, driven)
    w, slope = shift_at(driving, k, s)
    eta, a_n, a_u = along_normal(driving, s, w, slope)
    rising = 1.0 if d_u > 0.0 else -1.0
    for j in joints:
        before = excess_distance(driven, j - 1, driven.start[j], a_n, a_u, d_n, d_u)
        after = excess_distance(driven, j, driven.start[j], a_n, a_u, d_n, d_u)
        if rising * before >= 0.0 >= rising * after:
            return math.nan, math.nan
        if rising * before < 0.0 < rising * after:
            return math.nan, math.inf
    last = len(driven.start) - 1
    low = excess_distance(driven, 0, driven.start[0], a_n, a_u, d_n, d_u)
    high = excess_distance(driven, last, driven.start[last] + driven.width[last], a_n, a_u, d_n, d_u)
    if rising * low > 0.0 or rising * high < 0.0:
        return math.nan, math.inf
    s2 = root_near(driven, start, a_n, a_u, d_n, d_u)
    if not s2 == s2:
        return math.nan, math.nan
    w2, slope2 = shift_at(driven, interval_of(driven, s2), s2)
    _, b_n, b_u = along_normal(driven, s2, w2, slope2)
    n, u = b_n - a_n, b_u - a_u
    turn = math.atan2(n * d_u - u * d_n, (d_n + n) * d_n + (d_u + u) * d_u)
    return s + driving.side * driving.base_radius * (turn - eta), s2


@jit_inner
def _in_one_part(driven, part, partner):  # type: ignore[no-untyped-def]
    """Whether partners lie on the same smooth part of the driven flank, its ends included."""
    if not partner[0] + partner[1] + partner[2] < math.inf:
        return False
    middle = part[interval_of(driven, partner[1])]
    for i in range(0, 3, 2):
        inwards = SLACK if partner[i] < partner[1] else -SLACK
        if part[interval_of(driven, partner[i] + inwards)] != middle:
            return False
    return True


@jit
def traced_gap(
    traced: Trace, driving: Flank, driven: Flank, least: tuple[float, float], x: float
) -> tuple[float, float, float]:
    """Return the smallest rotation gap at x by the trace.

    Parameters
    ----------
    traced : trace of the two flanks
    driving, driven : the flanks
    least : least material removed from each of them [m]
    x : position to which the driving gear has turned [m along the line of action]

    Returns
    -------
    gap, points of the driving and the driven flank [m]; inf where the trace finds none
    """
    gap, where, partner = math.inf, math.nan, math.nan
    if not traced.usable:
        return gap, where, partner
    k = np.searchsorted(traced.furthest, x - SLACK)
    while k < len(traced.nearest) and traced.nearest[k] <= x + SLACK:
        if traced.grows[k] and traced.x[k, 0] - SLACK <= x <= traced.x[k, 2] + SLACK:
            value, s, s2 = _stationary(traced.x[k], driving, driven, k, x)
            if not value < math.inf:
                return math.inf, math.nan, math.nan
            if value < gap:
                gap, where, partner = value, s, s2
        k += 1
    for i in range(len(traced.driving.position)):
        s, w = traced.driving.position[i], traced.driving.shift[i]
        if may_lie_lower(s - x, traced.parts, least[1] - w, gap):
            value, s2 = rotation_gap(driving, driven, x, s, w)
            if value < gap:
                gap, where, partner = value, s, s2
    for i in range(len(traced.driven.position)):
        s2, w = traced.driven.position[i], traced.driven.shift[i]
        if may_lie_lower(s2 - x, traced.parts, least[0] + w, gap):
            value, s = corner_gap(driving, driven, x, s2, s2 + w)
            if value < gap:
                gap, where, partner = value, s, s2
    for j in traced.unknown:
        before, after = driving.start[j] - x, x - driving.start[j] - driving.width[j]
        removed = least[1] - max(driving.shift[j, 0], driving.shift[j, 1])
        if may_lie_lower(max(before, after, 0.0), traced.parts, removed, gap):
            for end in range(2):
                s = driving.start[j] + end * driving.width[j]
                value, s2 = rotation_gap(driving, driven, x, s, driving.shift[j, end])
                if value < gap:
                    gap, where, partner = value, s, s2
            value, s = smallest_within(driving, driven, x, j)
            if value < gap:
                gap, where = value, s
                _, partner = rotation_gap(driving, driven, x, s, shift_at(driving, j, s)[0])
    return gap, where, partner


@jit_inner
def may_lie_lower(away, parts, deepest, best):  # type: ignore[no-untyped-def]
    """Whether points further away than this from x may lie lower than the best found so far."""
    return not best < math.inf or SAFETY * 0.5 * parts * away * away + deepest < best


@jit_inner
def _stationary(traced, driving, driven, k, x):  # type: ignore[no-untyped-def]
    """Return the gap where it is stationary in interval k, and its points; inf where none is found."""
    f0, f1, f2 = traced
    bend, rise = 2.0 * (f0 - 2.0 * f1 + f2), 4.0 * f1 - 3.0 * f0 - f2
    behind = min(max(x, f0), f2) - f0
    root = math.sqrt(max(rise * rise + 4.0 * bend * behind, 0.0))
    t = 2.0 * behind / (rise + root)
    s = driving.start[k] + t * driving.width[k]
    slow = driving.width[k] / (rise + 2.0 * bend * t)
    turned = slow / (driving.side / driving.base_radius - driven.side / driven.base_radius)
    for _ in range(CORRECTIONS):
        w, slope = shift_at(driving, k, s)
        gap, s2 = rotation_gap(driving, driven, x, s, w)
        if not gap < math.inf:
            break
        w2, slope2 = shift_at(driven, interval_of(driven, s2), s2)
        first, _, _ = along_normal(driving, s, w, slope)
        second, _, _ = along_normal(driven, s2, w2, slope2)
        first += driving.side * (x - s) / driving.base_radius
        second += driven.side * (x - gap - s2) / driven.base_radius
        correction = turned * (first - second)
        if abs(correction) <= CONVERGED:
            return gap, s + correction, s2 + correction
        s = min(max(s + correction, driving.start[k]), driving.start[k] + driving.width[k])
    return math.inf, math.nan, math.nan

"""Two worn flanks, one point: the rotation gap at a driving point, and the tangency of two points."""

import math

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at

NEWTON_STEPS = 30
SECANT_STEPS = 40
CLOSE = 1e-14  # [m]; the Newton step after it is below rounding


@jit_inner
def rotation_gap(driving: Flank, driven: Flank, x: float, s: float, w: float) -> tuple[float, float]:
    """Return how far the driven gear is ahead of touching one point of the driving flank.

    The driven flank is turned until it passes through the point; of several pieces that can, the one
    that touches first counts.

    Parameters
    ----------
    driving, driven : the flanks
    x : position to which the driving gear has turned [m along the line of action]
    s, w : the point of the driving flank and its shift there [m]

    Returns
    -------
    gap : ``x_driving − x_driven`` when they touch, inf where the driven flank has no such radius [m]
    s2 : path position of the driven flank's point [m]
    """
    reach, q_n, q_u = _seen(driving, driven, x, s, w)
    if not reach == reach:
        return math.inf, math.nan
    turned = _turned(driven, reach, q_n, q_u)
    best, where = math.inf, math.nan
    for p in range(len(driven.piece) - 1):
        s2 = _point_reaching(driven, p, reach)
        if s2 == s2 and x - s2 - turned < best:
            best, where = x - s2 - turned, s2
    return best, where


@jit_inner
def corner_gap(driving: Flank, driven: Flank, x: float, s2: float, reach: float) -> tuple[float, float]:
    """Return how far a corner of the driven flank is ahead of touching the driving flank.

    Of several pieces of the driving flank that it could touch, the one it touches first counts.

    Parameters
    ----------
    driving, driven : the flanks
    x : position to which the driving gear has turned [m along the line of action]
    s2, reach : path position of the corner, and ``s2 + w`` there [m]

    Returns
    -------
    gap : inf where the driving flank has no point at that distance from the driven gear's centre [m]
    s : path position of the driving flank's point [m]
    """
    best, where = math.inf, math.nan
    for p in range(len(driving.piece) - 1):
        first, last = driving.piece[p], driving.piece[p + 1] - 1
        a, b = driving.start[first], driving.start[last] + driving.width[last]
        f_a = _excess_reach(driving, driven, x, a, driving.shift[first, 0], reach)
        f_b = _excess_reach(driving, driven, x, b, driving.shift[last, 1], reach)
        if not f_a * f_b <= 0.0:
            continue
        s = _crossing(driving, driven, x, reach, first, last, a, f_a, b, f_b)
        w = _shift_within(driving, first, last, s)
        _, q_n, q_u = _seen(driving, driven, x, s, w)
        gap = x - s2 - _turned(driven, reach, q_n, q_u)
        if gap < best:
            best, where = gap, s
    return best, where


@jit_inner
def _excess_reach(driving, driven, x, s, w, reach):  # type: ignore[no-untyped-def]
    """Return by how much a driving point reaches further; inside the base circle, to that."""
    excess, _, _ = _seen(driving, driven, x, s, w)
    return (excess if excess == excess else -driven.side * driven.curvature) - reach


@jit_inner
def _shift_within(flank, first, last, s):  # type: ignore[no-untyped-def]
    return shift_at(flank, min(max(interval_of(flank, s), first), last), s)[0]


@jit_inner
def _crossing(driving, driven, x, reach, first, last, a, f_a, b, f_b):  # type: ignore[no-untyped-def]
    """Return the driving point between a and b at the corner's distance from the driven gear's centre.

    By false position, halving the older end's value where it stays (Illinois).
    """
    s = b
    for _ in range(SECANT_STEPS):
        before, s = s, (a * f_b - b * f_a) / (f_b - f_a) if f_b != f_a else b
        if abs(s - before) <= CLOSE:
            break
        f = _excess_reach(driving, driven, x, s, _shift_within(driving, first, last, s), reach)
        if f * f_b <= 0.0:
            a, f_a = b, f_b
        else:
            f_a *= 0.5
        b, f_b = s, f
    return s


def point_seen(driving, driven, x, s, w):  # type: ignore[no-untyped-def]
    """Return driving points seen from the driven gear: the ``s2 + w2`` of their radius, and their place.

    The place is counted from the pitch point's own, so that nothing cancels [m]; NaN: no such radius.
    """
    kappa = driving.side * (x - s) / driving.base_radius
    sin, versine = np.sin(kappa), 2.0 * np.sin(0.5 * kappa) ** 2
    v_n = driving.side * driving.base_radius
    v_u = driving.side * driving.curvature + s + w
    q_n = -versine * v_n - sin * v_u
    q_u = sin * v_n - versine * v_u + s + w
    b_n, b_u = driven.side * driven.base_radius, driven.side * driven.curvature
    excess = 2.0 * (b_n * q_n + b_u * q_u) + q_n * q_n + q_u * q_u
    square = driven.curvature**2 + excess
    return driven.side * excess / (np.sqrt(square) + driven.curvature), q_n, q_u


def turned_to(driven, reach, q_n, q_u):  # type: ignore[no-untyped-def]
    """Return how far the driven gear must turn to bring its point of that reach to (q_n, q_u) [m]."""
    b_n, b_u = driven.side * driven.base_radius, driven.side * driven.curvature
    cross = (b_n * q_u - b_u * q_n) - reach * (b_n + q_n)
    dot = (b_n + q_n) * b_n + (b_u + q_u) * (b_u + reach)
    return driven.side * driven.base_radius * np.arctan2(cross, dot)


_seen, _turned = jit_inner(point_seen), jit_inner(turned_to)


@jit_inner
def _point_reaching(flank: Flank, p: int, reach: float) -> float:
    """Return s with ``s + w(s) = reach`` on one piece, NaN when the piece does not reach."""
    low, high = flank.piece[p], flank.piece[p + 1]
    if reach < flank.reached[low, 0] or reach > flank.reached[high - 1, 1]:
        return math.nan
    while high - low > 1:
        middle = (low + high) // 2
        if flank.reached[middle, 0] <= reach:
            low = middle
        else:
            high = middle
    begin, end = flank.start[low], flank.start[low] + flank.width[low]
    s = begin + flank.width[low] * (reach - flank.reached[low, 0]) / (
        flank.reached[low, 1] - flank.reached[low, 0]
    )
    for _ in range(NEWTON_STEPS):
        w, slope = shift_at(flank, low, s)
        miss = s + w - reach
        if miss > 0.0:
            end = s
        else:
            begin = s
        following = s - miss / (1.0 + slope)
        if not begin <= following <= end:
            following = 0.5 * (begin + end)
        if abs(following - s) <= CLOSE:
            return following
        s = following
    return s


@jit_inner
def along_normal(flank: Flank, s: float, w: float, slope: float) -> tuple[float, float, float]:
    """Return the tilt η of the worn normal, and what wear and tilt move the point by, seen along that normal.

    ``tan η = (dw/ds) r_b / (ρ + t w)``; the vector is ``R(−η) v − v_0`` with ``v_0 = (t r_b, t ρ_0)``.

    Returns
    -------
    η [rad], and the vector's components along n and u [m]
    """
    v_n = flank.side * flank.base_radius
    v_u = flank.side * flank.curvature + s + w
    tilt = math.atan(slope * flank.base_radius / (flank.side * v_u))
    sin, versine = math.sin(tilt), 2.0 * math.sin(0.5 * tilt) ** 2
    return tilt, -versine * v_n + sin * v_u, -sin * v_n - versine * v_u + s + w

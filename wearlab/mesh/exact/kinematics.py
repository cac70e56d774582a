"""Two worn flanks: the rotation gap at a driving point, and the tangency of two points.

One bracketed scalar root finds each contact. A common point with a common normal at the
fixed centre distance means, with both points seen along their own worn normals,
``|R(−η2) v2 − R(−η1) v1| = a``: Y23's ``R1² + R2² − 2 R1 R2 cos(γ2 + λ2 − γ1 − λ1) =
a²``, for external pairs too. Concave wear has several such points and corners have
none: :mod:`.minimum_gap` decides.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at

CLOSE = 1e-14  # [m]; the Newton step after it is below rounding


@jit_inner
def rotation_gap(
    driving: Flank, driven: Flank, x: float, s: float, w: float
) -> tuple[float, float]:
    """Return how far the driven gear is ahead of a point of the driving flank.

    The driven flank is turned until it passes through the point; of several pieces that
    can, the one that touches first counts.

    Parameters
    ----------
    driving, driven : the flanks
    x : position to which the driving gear has turned [m along the line of action]
    s, w : the point of the driving flank and its shift there [m]

    Returns
    -------
    gap : ``x_driving − x_driven`` when they touch, inf where the driven flank has no
        such radius [m]
    s2 : path position of the driven flank's point [m]
    """
    reach, q_n, q_u = _seen(driving, driven, x, s, w)
    if not reach == reach:
        return math.inf, math.nan
    turned = _turned(driven, reach, q_n, q_u)
    best = math.inf
    where = math.nan
    for p in range(len(driven.piece) - 1):
        s2 = _point_reaching(driven, p, reach)
        if s2 == s2 and x - s2 - turned < best:
            best = x - s2 - turned
            where = s2
    return best, where


@jit_inner
def corner_gap(
    driving: Flank, driven: Flank, x: float, s2: float, reach: float
) -> tuple[float, float]:
    """Return how far a corner of the driven flank is ahead of the driving flank.

    Of several pieces of the driving flank that it could touch, the one it touches first
    counts.

    Parameters
    ----------
    driving, driven : the flanks
    x : position to which the driving gear has turned [m along the line of action]
    s2, reach : path position of the corner, and ``s2 + w`` there [m]

    Returns
    -------
    gap : inf where the driving flank has no point at that distance from the driven
        gear's centre [m]
    s : path position of the driving flank's point [m]
    """
    best = math.inf
    where = math.nan
    for p in range(len(driving.piece) - 1):
        first = driving.piece[p]
        last = driving.piece[p + 1] - 1
        a = driving.start[first]
        b = driving.start[last] + driving.width[last]
        f_a = _excess_reach(driving, driven, x, a, driving.shift[first, 0], reach)
        f_b = _excess_reach(driving, driven, x, b, driving.shift[last, 1], reach)
        if not f_a * f_b <= 0.0:
            continue
        s = _crossing(driving, driven, x, reach, first, last, a, f_a, b, f_b)
        _, q_n, q_u = _seen(
            driving, driven, x, s, _shift_within(driving, first, last, s)
        )
        gap = x - s2 - _turned(driven, reach, q_n, q_u)
        if gap < best:
            best, where = gap, s
    return best, where


@jit_inner
def _excess_reach(driving, driven, x, s, w, reach):  # type: ignore[no-untyped-def]
    """Return by how much a driving point reaches further.

    Inside the base circle, to that.
    """
    excess, _, _ = _seen(driving, driven, x, s, w)
    return (excess if excess == excess else -driven.side * driven.curvature) - reach


@jit_inner
def _shift_within(flank, first, last, s):  # type: ignore[no-untyped-def]
    return shift_at(flank, min(max(interval_of(flank, s), first), last), s)[0]


@jit_inner
def _crossing(  # type: ignore[no-untyped-def]
    driving, driven, x, reach, first, last, a, f_a, b, f_b
):
    """Return the driving point as far as the corner from the driven gear's centre.

    By false position, halving the older end's value where it stays (Illinois).
    """
    s = b
    for _ in range(40):
        before = s
        s = (a * f_b - b * f_a) / (f_b - f_a) if f_b != f_a else b
        if abs(s - before) <= CLOSE:
            break
        f = _excess_reach(
            driving, driven, x, s, _shift_within(driving, first, last, s), reach
        )
        if f * f_b <= 0.0:
            a, f_a = b, f_b
        else:
            f_a *= 0.5
        b, f_b = s, f
    return s


def point_seen(driving, driven, x, s, w):  # type: ignore[no-untyped-def]
    """Return driving points seen from the driven gear: ``s2 + w2`` and place.

    The place is counted from the pitch point's own, so that nothing cancels [m]; NaN:
    no such radius.
    """
    kappa = driving.side * (x - s) / driving.base_radius
    sin = np.sin(kappa)
    versine = 2.0 * np.sin(0.5 * kappa) ** 2
    v_n = driving.side * driving.base_radius
    v_u = driving.side * driving.curvature + s + w
    q_n = -versine * v_n - sin * v_u
    q_u = sin * v_n - versine * v_u + s + w
    b_n = driven.side * driven.base_radius
    b_u = driven.side * driven.curvature
    excess = 2.0 * (b_n * q_n + b_u * q_u) + q_n * q_n + q_u * q_u
    return (
        driven.side
        * excess
        / (np.sqrt(driven.curvature**2 + excess) + driven.curvature),
        q_n,
        q_u,
    )


def turned_to(driven, reach, q_n, q_u):  # type: ignore[no-untyped-def]
    """Return how far the driven gear turns to bring its point to (q_n, q_u) [m]."""
    b_n = driven.side * driven.base_radius
    b_u = driven.side * driven.curvature
    cross = (b_n * q_u - b_u * q_n) - reach * (b_n + q_n)
    dot = (b_n + q_n) * b_n + (b_u + q_u) * (b_u + reach)
    return driven.side * driven.base_radius * np.arctan2(cross, dot)


_seen = jit_inner(point_seen)
_turned = jit_inner(turned_to)


@jit_inner
def _point_reaching(flank: Flank, p: int, reach: float) -> float:
    """Return s with ``s + w(s) = reach`` on one piece, NaN without."""
    low = flank.piece[p]
    high = flank.piece[p + 1]
    if reach < flank.reached[low, 0] or reach > flank.reached[high - 1, 1]:
        return math.nan
    while high - low > 1:
        middle = (low + high) // 2
        if flank.reached[middle, 0] <= reach:
            low = middle
        else:
            high = middle
    begin = flank.start[low]
    end = flank.start[low] + flank.width[low]
    s = begin + flank.width[low] * (reach - flank.reached[low, 0]) / (
        flank.reached[low, 1] - flank.reached[low, 0]
    )
    for _ in range(30):
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
def along_normal(
    flank: Flank, s: float, w: float, slope: float
) -> tuple[float, float, float]:
    """Return the tilt η of the worn normal, and the shift of the point along it.

    ``tan η = (dw/ds) r_b / (ρ + t w)``; the vector is ``R(−η) v − v_0`` with ``v_0 = (t
    r_b, t ρ_0)``.

    Returns
    -------
    η [rad], and the vector's components along n and u [m]
    """
    v_n = flank.side * flank.base_radius
    v_u = flank.side * flank.curvature + s + w
    tilt = math.atan(slope * flank.base_radius / (flank.side * v_u))
    sin = math.sin(tilt)
    versine = 2.0 * math.sin(0.5 * tilt) ** 2
    return tilt, -versine * v_n + sin * v_u, -sin * v_n - versine * v_u + s + w


class FlankContact(NamedTuple):
    """Points of two flanks that touch; NaN where none does.

    Parameters
    ----------
    driving, driven : (n,) path positions at which the points would touch unworn [m]
    x_driving, x_driven : (n,) positions to which the gears have turned [m along the
        line of action]
    """

    driving: Array
    driven: Array
    x_driving: Array
    x_driven: Array

    @property
    def gap(self) -> Array:
        """How far the driving gear is ahead, x_driving − x_driven, (n,) [m]."""
        return self.x_driving - self.x_driven


def tangency(driving: Flank, driven: Flank, position: ArrayLike) -> FlankContact:
    """Return where driving points touch the driven flank with a common tangent.

    Parameters
    ----------
    driving, driven : worn flanks
    position : (n,) points of the driving flank, by the path position at which they
        touch unworn [m]

    Returns
    -------
    FlankContact, NaN where a point finds no partner (Algorithm 1: "fail to get
    corresponding meshing point")

    References
    ----------
    Y23 Eqs. 9–23, Algorithm 1 line 11 for φ1.
    """
    s = np.array(position, float).ravel()
    return FlankContact(s, *_solve(driving, driven, s))


@jit
def _solve(driving, driven, s):  # type: ignore[no-untyped-def]
    partner = np.full(len(s), np.nan)
    x_driving = np.full(len(s), np.nan)
    x_driven = np.full(len(s), np.nan)
    d_n = driven.side * driven.base_radius - driving.side * driving.base_radius
    d_u = driven.side * driven.curvature - driving.side * driving.curvature
    for i in range(len(s)):
        w, slope = shift_at(driving, interval_of(driving, s[i]), s[i])
        eta, a_n, a_u = along_normal(driving, s[i], w, slope)
        s2 = root_near(driven, s[i], a_n, a_u, d_n, d_u)
        if not s2 == s2:
            continue
        w2, slope2 = shift_at(driven, interval_of(driven, s2), s2)
        eta2, b_n, b_u = along_normal(driven, s2, w2, slope2)
        n = b_n - a_n
        u = b_u - a_u
        turn = math.atan2(n * d_u - u * d_n, (d_n + n) * d_n + (d_u + u) * d_u)
        partner[i] = s2
        x_driving[i] = s[i] + driving.side * driving.base_radius * (turn - eta)
        x_driven[i] = s2 + driven.side * driven.base_radius * (turn - eta2)
    return partner, x_driving, x_driven


@jit_inner
def excess_distance(flank, s, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return ``(|D|² − a²) / 2a``, the excess of D over the centre distance [m].

    It is so to first order.

    References
    ----------
    Y23: ``R1² + R2² − 2 R1 R2 cos(γ2 + λ2 − γ1 − λ1) = a²``.
    """
    w, slope = shift_at(flank, interval_of(flank, s), s)
    _, b_n, b_u = along_normal(flank, s, w, slope)
    n = b_n - a_n
    u = b_u - a_u
    return (d_n * n + d_u * u + 0.5 * (n * n + u * u)) / math.hypot(d_n, d_u)


@jit_inner
def root_near(flank, start, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return the root nearest to ``start``, bracketed by growing steps.

    Steps go towards falling distance.

    Within the bracket by secants, the end that stays halved (Illinois); NaN where the
    function jumps.
    """
    last = len(flank.start) - 1
    low_end = flank.start[0]
    high_end = flank.start[last] + flank.width[last]
    begin = min(max(start, low_end), high_end)
    f_begin = excess_distance(flank, begin, a_n, a_u, d_n, d_u)
    if f_begin == 0.0:
        return begin
    step = 2e-6 if (d_u > 0.0) != (f_begin > 0.0) else -2e-6
    outer, f_outer = begin, f_begin
    while f_outer * f_begin > 0.0:
        inner, f_inner = outer, f_outer
        if (outer <= low_end and step < 0.0) or (outer >= high_end and step > 0.0):
            return math.nan
        outer = min(max(outer + step, low_end), high_end)
        f_outer = excess_distance(flank, outer, a_n, a_u, d_n, d_u)
        step *= 2.0
    scale = max(abs(f_inner), abs(f_outer))
    s, f = outer, f_outer
    for _ in range(60):
        before = s
        s = (inner * f_outer - outer * f_inner) / (f_outer - f_inner)
        f = excess_distance(flank, s, a_n, a_u, d_n, d_u)
        if f == 0.0 or abs(s - before) <= 1e-16:
            break
        if f * f_outer < 0.0:
            inner, f_inner = outer, f_outer
        else:
            f_inner *= 0.5
        outer, f_outer = s, f
    return s if abs(f) <= 1e-9 * scale + 1e-15 else math.nan

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

CLOSE = 1e-14
"""Step at which a root counts as found; the next step is below rounding [m]."""
FIRST_STEP = 2e-6
"""First step of a search for a bracket [m]."""


@jit_inner(counted=False, inline=True)
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
    reach, q_n, q_u = seen(driving, driven, x, s, w)
    if math.isnan(reach):
        return math.inf, math.nan
    turn = turned(driven, reach, q_n, q_u)
    best = math.inf
    where = math.nan
    for p in range(len(driven.piece) - 1):
        s2 = _point_reaching(driven, p, reach)
        gap = x - s2 - turn
        if gap < best:
            best = gap
            where = s2
    return best, where


@jit_inner(counted=False)
def corner_gap(  # type: ignore[no-untyped-def]
    driving, driven, x, s2, reach, first, last, f_a, f_b
):
    """Return how far a corner of the driven flank is ahead of the driving flank.

    Parameters
    ----------
    driving, driven : the flanks
    x : position to which the driving gear has turned [m along the line of action]
    s2, reach : path position of the corner, and ``s2 + w`` there [m]
    first, last : intervals of the driving flank on which it may touch, all of which
        meet at their ends
    f_a, f_b : by how much both ends of these reach further than the corner [m]

    Returns
    -------
    gap : inf where these intervals have no point at that distance from the driven
        gear's centre [m]
    s : path position of the driving flank's point [m]
    """
    if not f_a * f_b <= 0.0:
        return math.inf, math.nan
    a = driving.start[first]
    b = driving.start[last] + driving.width[last]
    s = _crossing(driving, driven, x, reach, first, last, a, f_a, b, f_b)
    w = _shift_within(driving, first, last, s)
    _, q_n, q_u = seen(driving, driven, x, s, w)
    return x - s2 - turned(driven, reach, q_n, q_u), s


@jit_inner(counted=False)
def excess_reach(driving, driven, x, s, w, reach):  # type: ignore[no-untyped-def]
    """Return by how much a driving point reaches further than ``reach`` [m].

    A point inside the driven base circle counts as one on it.
    """
    reach_of_point, _, _ = seen(driving, driven, x, s, w)
    if math.isnan(reach_of_point):
        reach_of_point = -driven.side * driven.curvature
    return reach_of_point - reach


@jit_inner(counted=False)
def _shift_within(flank, first, last, s):  # type: ignore[no-untyped-def]
    """Return w at s, taken from the intervals ``first`` to ``last`` alone [m]."""
    k = min(max(interval_of(flank, s), first), last)
    return shift_at(flank, k, s)[0]


@jit_inner(counted=False)
def _crossing(  # type: ignore[no-untyped-def]
    driving, driven, x, reach, first, last, a, f_a, b, f_b
):
    """Return the driving point as far as the corner from the driven gear's centre [m].

    The point lies between a and b. False position encloses it; the value at an end that
    stays is halved (Illinois method).
    """
    s = b
    for _ in range(40):
        previous = s
        s = (a * f_b - b * f_a) / (f_b - f_a) if f_b != f_a else b
        if abs(s - previous) <= CLOSE:
            break
        w = _shift_within(driving, first, last, s)
        f = excess_reach(driving, driven, x, s, w, reach)
        if f * f_b <= 0.0:
            a = b
            f_a = f_b
        else:
            f_a *= 0.5
        b = s
        f_b = f
    return s


def point_seen(driving, driven, x, s, w):  # type: ignore[no-untyped-def]
    """Return where driving points lie as the driven gear sees them [m].

    Parameters
    ----------
    driving, driven : the flanks, worn or not
    x : positions to which the driving gear has turned [m along the line of action]
    s, w : the points of the driving flank, and their shifts [m]

    Returns
    -------
    reach : ``s2 + w2`` of a driven point at the same distance from the driven centre;
        NaN where there is no such radius [m]
    q_n, q_u : the place, counted from the pitch point so that nothing cancels [m]
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
    rho = np.sqrt(driven.curvature**2 + excess)
    reach = driven.side * excess / (rho + driven.curvature)
    return reach, q_n, q_u


def turned_to(driven, reach, q_n, q_u):  # type: ignore[no-untyped-def]
    """Return how far the driven gear turns to bring its point to a place [m].

    Parameters
    ----------
    driven : the flank
    reach, q_n, q_u : the point and the place, see `point_seen` [m]
    """
    b_n = driven.side * driven.base_radius
    b_u = driven.side * driven.curvature
    cross = (b_n * q_u - b_u * q_n) - reach * (b_n + q_n)
    dot = (b_n + q_n) * b_n + (b_u + q_u) * (b_u + reach)
    return driven.side * driven.base_radius * np.arctan2(cross, dot)


seen = jit_inner(point_seen, counted=False, inline=True)
turned = jit_inner(turned_to, counted=False, inline=True)


@jit_inner(counted=False)
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
    width = flank.width[low]
    begin = flank.start[low]
    end = begin + width
    reach_begin = flank.reached[low, 0]
    reach_end = flank.reached[low, 1]
    s = begin + width * (reach - reach_begin) / (reach_end - reach_begin)
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


@jit_inner(counted=False)
def along_normal(
    flank: Flank, s: float, w: float, slope: float
) -> tuple[float, float, float]:
    """Return the tilt η of the worn normal, and the shift of the point along it.

    ``tan η = (dw/ds) r_b / (ρ + t w)``; the vector is ``R(−η) v − v_0`` with ``v_0 = (t
    r_b, t ρ_0)``.

    Parameters
    ----------
    flank : the worn flank
    s, w, slope : path position, shift [m] and dw/ds [1] of the point

    Returns
    -------
    η [rad], and the vector's components along n and u [m]
    """
    v_n = flank.side * flank.base_radius
    v_u = flank.side * flank.curvature + s + w
    tilt = math.atan(slope * flank.base_radius / (flank.side * v_u))
    sin = math.sin(tilt)
    versine = 2.0 * math.sin(0.5 * tilt) ** 2
    shift_n = -versine * v_n + sin * v_u
    shift_u = -sin * v_n - versine * v_u + s + w
    return tilt, shift_n, shift_u


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
    """Return the partners of driving points s, and both rotations, (n,) each [m]."""
    partner = np.full(len(s), np.nan)
    x_driving = np.full(len(s), np.nan)
    x_driven = np.full(len(s), np.nan)
    d_n = driven.side * driven.base_radius - driving.side * driving.base_radius
    d_u = driven.side * driven.curvature - driving.side * driving.curvature
    for i in range(len(s)):
        w, slope = shift_at(driving, interval_of(driving, s[i]), s[i])
        eta, a_n, a_u = along_normal(driving, s[i], w, slope)
        s2 = root_near(driven, s[i], a_n, a_u, d_n, d_u)
        if math.isnan(s2):
            continue
        w2, slope2 = shift_at(driven, interval_of(driven, s2), s2)
        eta2, b_n, b_u = along_normal(driven, s2, w2, slope2)
        n = b_n - a_n
        u = b_u - a_u
        cross = n * d_u - u * d_n
        dot = (d_n + n) * d_n + (d_u + u) * d_u
        turn = math.atan2(cross, dot)
        turn_driving = turn - eta
        turn_driven = turn - eta2
        partner[i] = s2
        x_driving[i] = s[i] + driving.side * driving.base_radius * turn_driving
        x_driven[i] = s2 + driven.side * driven.base_radius * turn_driven
    return partner, x_driving, x_driven


@jit_inner(counted=False)
def excess_distance(flank, s, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return by how much the distance D of both centres is too large [m].

    ``(|D|² − a²) / 2a``, which is D − a to first order.

    Parameters
    ----------
    flank : the worn flank on which the point lies
    s : path position of the point [m]
    a_n, a_u : shift of the mate's point along its normal, see `along_normal` [m]
    d_n, d_u : from the mate's centre to this gear's [m]

    References
    ----------
    Y23: ``R1² + R2² − 2 R1 R2 cos(γ2 + λ2 − γ1 − λ1) = a²``.
    """
    w, slope = shift_at(flank, interval_of(flank, s), s)
    _, b_n, b_u = along_normal(flank, s, w, slope)
    n = b_n - a_n
    u = b_u - a_u
    half_excess = d_n * n + d_u * u + 0.5 * (n * n + u * u)
    return half_excess / math.hypot(d_n, d_u)


@jit_inner(counted=False)
def root_near(flank, start, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return the root of `excess_distance` nearest to ``start``; NaN where it jumps.

    Growing steps towards smaller distances bracket the root. Secants enclose it; the
    value at an end that stays is halved (the Illinois method of Dowell & Jarratt,
    1971).

    Parameters
    ----------
    flank : the worn flank on which the root lies
    start : path position from which the search begins [m]
    a_n, a_u : shift of the mate's point along its normal, see `along_normal` [m]
    d_n, d_u : from the mate's centre to this gear's [m]
    """
    last = len(flank.start) - 1
    low_end = flank.start[0]
    high_end = flank.start[last] + flank.width[last]
    begin = min(max(start, low_end), high_end)
    f_begin = excess_distance(flank, begin, a_n, a_u, d_n, d_u)
    if f_begin == 0.0:
        return begin
    step = FIRST_STEP if (d_u > 0.0) != (f_begin > 0.0) else -FIRST_STEP
    outer = begin
    f_outer = f_begin
    while f_outer * f_begin > 0.0:
        inner = outer
        f_inner = f_outer
        is_at_low_end = outer <= low_end and step < 0.0
        is_at_high_end = outer >= high_end and step > 0.0
        if is_at_low_end or is_at_high_end:
            return math.nan
        outer = min(max(outer + step, low_end), high_end)
        f_outer = excess_distance(flank, outer, a_n, a_u, d_n, d_u)
        step *= 2.0
    scale = max(abs(f_inner), abs(f_outer))
    s = outer
    f = f_outer
    for _ in range(60):
        previous = s
        s = (inner * f_outer - outer * f_inner) / (f_outer - f_inner)
        f = excess_distance(flank, s, a_n, a_u, d_n, d_u)
        if f == 0.0 or abs(s - previous) <= 1e-16:
            break
        if f * f_outer < 0.0:
            inner = outer
            f_inner = f_outer
        else:
            f_inner *= 0.5
        outer = s
        f_outer = f
    return s if abs(f) <= 1e-9 * scale + 1e-15 else math.nan

"""Where two worn flanks touch with a common tangent: one bracketed scalar root per contact.

A common point with a common normal at the fixed centre distance means, with both points seen along their own
worn normals, ``|R(−η2) v2 − R(−η1) v1| = a``: Y23's ``R1² + R2² − 2 R1 R2 cos(γ2 + λ2 − γ1 − λ1) = a²``, for
external pairs too. Concave wear has several such points and corners have none: :mod:`.minimum_gap` decides.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at
from wearlab.mesh.exact.kinematics import along_normal

FIRST_STEP = 2e-6
ITERATIONS = 60
RESOLUTION = 1e-16


class FlankContact(NamedTuple):
    """Points of two flanks that touch; NaN where none does.

    Parameters
    ----------
    driving, driven : (n,) path positions at which the points would touch unworn [m]
    x_driving, x_driven : (n,) positions to which the gears have turned [m along the line of action]
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
    """Return where points of the driving flank touch the driven one with a common tangent.

    Parameters
    ----------
    driving, driven : worn flanks
    position : (n,) points of the driving flank, by the path position at which they touch unworn [m]

    Returns
    -------
    FlankContact, NaN where a point finds no partner (Algorithm 1: "fail to get corresponding meshing point")

    References
    ----------
    Y23 Eqs. 9–23, Algorithm 1 line 11 for φ1.
    """
    s = np.ascontiguousarray(np.ravel(np.asarray(position, float)))
    contact = FlankContact(s.copy(), *(np.full(len(s), np.nan) for _ in range(3)))
    _solve(driving, driven, s, contact.driven, contact.x_driving, contact.x_driven)
    return contact


@jit
def _solve(driving, driven, s, partner, x_driving, x_driven):  # type: ignore[no-untyped-def]
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
        n, u = b_n - a_n, b_u - a_u
        turn = math.atan2(n * d_u - u * d_n, (d_n + n) * d_n + (d_u + u) * d_u)
        partner[i] = s2
        x_driving[i] = s[i] + driving.side * driving.base_radius * (turn - eta)
        x_driven[i] = s2 + driven.side * driven.base_radius * (turn - eta2)


@jit_inner
def excess_distance(flank, k, s, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return ``(|D|² − a²) / 2a``, which is D's excess over the centre distance to first order [m].

    References
    ----------
    Y23: ``R1² + R2² − 2 R1 R2 cos(γ2 + λ2 − γ1 − λ1) = a²``.
    """
    w, slope = shift_at(flank, k, s)
    _, b_n, b_u = along_normal(flank, s, w, slope)
    n, u = b_n - a_n, b_u - a_u
    return (d_n * n + d_u * u + 0.5 * (n * n + u * u)) / math.hypot(d_n, d_u)


@jit_inner
def root_near(flank, start, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return the root nearest to ``start``, bracketed by growing steps towards falling distance."""
    last = len(flank.start) - 1
    low_end, high_end = flank.start[0], flank.start[last] + flank.width[last]
    begin = min(max(start, low_end), high_end)
    f_begin = excess_distance(flank, interval_of(flank, begin), begin, a_n, a_u, d_n, d_u)
    if f_begin == 0.0:
        return begin
    rising = 1.0 if d_u > 0.0 else -1.0
    step = -FIRST_STEP * rising * (1.0 if f_begin > 0.0 else -1.0)
    inner, f_inner = begin, f_begin
    outer, f_outer = begin, f_begin
    while f_outer * f_begin > 0.0:
        inner, f_inner = outer, f_outer
        if (outer <= low_end and step < 0.0) or (outer >= high_end and step > 0.0):
            return math.nan
        outer = min(max(outer + step, low_end), high_end)
        f_outer = excess_distance(flank, interval_of(flank, outer), outer, a_n, a_u, d_n, d_u)
        step *= 2.0
    return _ridders(flank, inner, f_inner, outer, f_outer, a_n, a_u, d_n, d_u)


@jit_inner
def _ridders(flank, x0, f0, x1, f1, a_n, a_u, d_n, d_u):  # type: ignore[no-untyped-def]
    """Return the root between x0 and x1 by Ridders' method; NaN where the function jumps over zero."""
    scale = max(abs(f0), abs(f1))
    x, f = x1, f1
    for _ in range(ITERATIONS):
        middle = 0.5 * (x0 + x1)
        f_middle = excess_distance(flank, interval_of(flank, middle), middle, a_n, a_u, d_n, d_u)
        root = math.sqrt(f_middle * f_middle - f0 * f1)
        if root == 0.0:
            break
        before = x
        x = middle + (middle - x0) * (f_middle if f0 > f1 else -f_middle) / root
        f = excess_distance(flank, interval_of(flank, x), x, a_n, a_u, d_n, d_u)
        if f == 0.0 or abs(x - before) <= RESOLUTION:
            break
        if f_middle * f < 0.0:
            x0, f0, x1, f1 = middle, f_middle, x, f
        elif f * f0 < 0.0:
            x1, f1 = x, f
        else:
            x0, f0 = x, f
    return x if abs(f) <= 1e-9 * scale + 1e-15 else math.nan

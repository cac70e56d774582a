"""The smallest rotation gap within one interval of the driving flank, by Brent's method."""

import math

from wearlab.compiled import jit_inner
from wearlab.mesh.exact.flank import Flank, shift_at
from wearlab.mesh.exact.kinematics import rotation_gap

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

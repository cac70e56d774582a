"""A piece of motion as a power series of time: exact for meshes whose tables are polynomials there.

While contact lasts, ``q̈ = b − K q − C q̇ − Σ_m r_m (k_m δ_m + c_m δ̇_m − w_m)`` with k_m and w_m polynomials
of time. The coefficients of the motion then follow one from another (Hairer, Nørsett & Wanner 1993, I.8): no
stage is solved for, and where a flank parts is the root of a polynomial.

Series are (n_terms, n, columns): the motion is affine in the state at the start, 1, and the sizes of loads.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.parting_law import DAMPS, DEGREE, HOLDS, LOAD, VECTORS

MOST_TERMS = 64
LEFT_OUT = 1e-14
"""Size of the terms left out over that of a start of size one."""
LOOKS = 4
"""Equal parts of a piece at whose ends the approach of a flank is looked at, with its slope."""
PLACED = 1e-8
"""Last move of Newton's method, in blocks, after which the next one changes nothing."""
MOST_MOVES, MOST_HALVINGS = 60, 40
NOWHERE = 2.0


@jit_inner
def expand(plan: Any, damping: Any, law: Any, h: float, sensed: Any, series: Any) -> int:
    """Fill the series of all columns over a time ``h``; return the number of terms, 0: it does not converge.

    Parameters
    ----------
    plan : `wearlab.dynamics.parting_law.PartingPlan`
    damping : (n_mesh,) of the meshes that touch [N s/m]
    law : (n_mesh, 2, 9) polynomials k and w of u = t/h
    sensed : (n_mesh, columns, 9 + MOST_TERMS) scratch: eight times nothing, and the series of d·q
    series : (MOST_TERMS, n, columns) filled: coefficients of q by u
    """
    zero, meshes, n = np.uint64(0), np.uint64(len(law)), np.uint64(len(plan.coordinate))
    columns, square, small = np.uint64(series.shape[2]), h * h, 0
    constant, vectors = np.uint64(2) * n, np.uint64(VECTORS)
    for m in range(zero, meshes):
        for col in range(zero, columns):
            for power in range(zero, np.uint64(DEGREE)):
                sensed[m, col, power] = 0.0
    for j in range(zero, np.uint64(MOST_TERMS)):
        if j < np.uint64(2):
            for row in range(zero, n):
                for col in range(zero, columns):
                    series[j, row, col] = 0.0
                if j == zero:
                    series[j, row, row] = 1.0
                else:
                    series[j, row, n + row] = h
        else:
            last, before, ahead = j - np.uint64(1), j - np.uint64(2), float(j) - 1.0
            factor, over = square / (ahead * (ahead + 1.0)), ahead / h
            for row in range(zero, n):
                k, c = factor * plan.coordinate[row, HOLDS], factor * over * plan.coordinate[row, DAMPS]
                for col in range(zero, columns):
                    series[j, row, col] = -k * series[before, row, col] - c * series[last, row, col]
                if before == zero:
                    for col in range(constant, columns):
                        load = plan.coordinate[row, np.uint64(LOAD) + col - constant]
                        series[j, row, col] += factor * load
            for m in range(zero, meshes):
                for col in range(zero, columns):
                    felt = 0.0
                    if col == constant and before <= np.uint64(DEGREE):
                        felt = -law[m, 1, before]
                    for at in range(zero, np.uint64(DEGREE + 1)):  # the latest last: all else need not wait
                        felt += law[m, 0, np.uint64(DEGREE) - at] * sensed[m, col, before + at]
                    felt = factor * (felt + damping[m] * over * sensed[m, col, last + np.uint64(DEGREE)])
                    for row in range(zero, n):
                        series[j, row, col] -= plan.mesh[m, vectors + n + row] * felt
        for m in range(zero, meshes):
            for col in range(zero, columns):
                felt = 0.0
                for row in range(zero, n):
                    felt += plan.mesh[m, vectors + row] * series[j, row, col]
                sensed[m, col, j + np.uint64(DEGREE)] = felt
        if j > np.uint64(DEGREE + 2):
            size = 0.0
            for row in range(zero, n):
                for col in range(zero, n):
                    size = max(size, abs(series[j, row, col]), abs(series[j, row, n + col]) / h)
            if not size < np.inf:
                return 0
            small = small + 1 if size < LEFT_OUT else 0
            if small == 2:
                return int(j) + 1
    return 0


@jit_inner
def follow(series: Any, terms: int, given: Any, motion: Any) -> None:
    """Write the series (n, n_terms) of the one motion with this start, 1 and these loads."""
    for row in range(np.uint64(0), np.uint64(series.shape[1])):
        for j in range(np.uint64(0), np.uint64(terms)):
            total = 0.0
            for col in range(np.uint64(0), np.uint64(series.shape[2])):
                total += series[j, row, col] * given[col]
            motion[row, j] = total


@jit_inner
def map_at(series: Any, terms: int, u: float, h: float, affine: Any) -> None:
    """Write the map (2n, columns) from the start of a piece to ``u``."""
    n, columns, over = np.uint64(series.shape[1]), np.uint64(series.shape[2]), 1.0 / h
    for row in range(np.uint64(0), n):
        for col in range(np.uint64(0), columns):
            value, slope = series[terms - 1, row, col], 0.0
            for j in range(terms - 2, -1, -1):
                slope = slope * u + value
                value = value * u + series[j, row, col]
            affine[row, col], affine[n + row, col] = value, slope * over


@jit_inner
def both_at(p: Any, terms: int, x: float) -> tuple[float, float]:
    """Return a polynomial and its slope: even and odd powers side by side, ``E(x²) + x O(x²)``."""
    y, top = x * x, terms - 1 - terms % 2
    odd, even = p[top], p[terms - 1] if top < terms - 1 else 0.0
    of_odd = of_even = 0.0
    for j in range(top - 1, -1, -2):
        of_even, even = of_even * y + even, even * y + p[j]
        if j > 0:
            of_odd, odd = of_odd * y + odd, odd * y + p[j - 1]
    return even + x * odd, 2.0 * (x * of_even + y * of_odd) + odd


@jit_inner
def state_at(motion: Any, terms: int, u: float, h: float, state: Any) -> None:
    """Write the state (2n,) of one motion at ``u``; its series are (n, MOST_TERMS)."""
    n = len(motion)
    for row in range(n):
        value, slope = both_at(motion[row], terms, u)
        state[row], state[n + row] = value, slope / h


@jit_inner
def look(p: Any, terms: int, start: float, out: Any) -> None:
    """Fill a polynomial and its slope at the ends of four equal parts of what is left from ``start``."""
    part = 0.25 * (1.0 - start)
    x, y, z = start + part, start + 2.0 * part, start + 3.0 * part
    a = b = c = d = p[terms - 1]
    e = f = g = h = 0.0
    for j in range(terms - 2, -1, -1):  # side by side: one after another waits for every product
        e, f, g, h = e * x + a, f * y + b, g * z + c, h + d
        term = p[j]
        a, b, c, d = a * x + term, b * y + term, c * z + term, d + term
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = a, b, c, d
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = e, f, g, h


@jit_inner
def approach_at(p: Any, terms: int, x: float, start: float, changed: bool) -> tuple[float, float]:
    """Return the approach of a flank and its slope, over ``x − start`` where it changed: there is a root."""
    value, slope = both_at(p, terms, x)
    if changed:
        value /= x - start
        slope = (slope - value) / (x - start)
    return value, slope


@jit_inner
def passing(p: Any, terms: int, low: float, high: float, guess: float, start: float, changed: bool) -> float:
    """Return where an approach passes zero on its way down, by Newton's steps kept between both ends."""
    x = guess
    for _ in range(MOST_MOVES):
        value, slope = approach_at(p, terms, x, start, changed)
        if value > 0.0:
            low = x
        else:
            high = x
        after = x - value / slope if slope != 0.0 else 2.0
        if not low <= after <= high:
            after = 0.5 * (low + high)
        elif abs(after - x) <= PLACED:
            return after
        if high - low <= 1e-15:
            return after
        x = after
    return x


@jit_inner
def first_passing(
    p: Any, terms: int, start: float, changed: bool, part: int, dips: bool, looks: Any, earliest: float
) -> float:
    """Return where a flank that has not changed contact does so in a part of a piece, 2: nowhere.

    Parameters
    ----------
    p, terms : its approach, positive before
    start, changed : where the piece begins, and whether the flank has changed contact there
    part, dips : which; whether its end is positive again: then its lowest point is looked for
    looks : (2, LOOKS) approach and slope at the ends of all parts
    earliest : where another flank has: that of the same gap does so, too
    """
    size = (1.0 - start) * (1.0 / LOOKS)
    low, high = start + part * size, start + (part + 1) * size
    if dips:
        left, right = low, high
        for _ in range(MOST_HALVINGS):
            middle = 0.5 * (left + right)
            value, slope = approach_at(p, terms, middle, start, changed)
            if value < 0.0:
                return passing(p, terms, low, middle, 0.5 * (low + middle), start, changed)
            if value > 0.5 * (right - left) * abs(slope):
                return NOWHERE  # even its tangent stays positive
            if slope > 0.0:
                right = middle
            else:
                left = middle
        return NOWHERE
    guess = earliest
    if not low < guess < high:
        after = looks[0, part]
        before = looks[0, part - 1] if part > 0 else after
        if part == 0 and not changed:
            before, _ = both_at(p, terms, start)
        guess = low + size * before / (before - after) if before > 0.0 else 0.5 * (low + high)
    return passing(p, terms, low, high, guess, start, changed)

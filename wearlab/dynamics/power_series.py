"""A smooth piece of motion as a power series of time: exact for meshes whose tables are polynomials there.

While contact lasts, ``q̈ = b − K q − C q̇ − Σ_c r_c (k_c δ_m + c_m δ̇_m − w_c)`` with k_c and w_c polynomials
of time over a group of steps. The coefficients of the motion then follow one from another (Hairer, Nørsett &
Wanner 1993, I.8): no stage is solved for, a piece is as long as it happens to be, and where a flank parts is
the root of a polynomial.

Series are flat, term after term: n rows of the columns that the motion is affine in, which are the state at
the start, 1, and the sizes of loads. ``like`` is a tuple as long as there are coordinates, values unused: the
compiler knows its length.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner

DEGREE = 8
"""Of the polynomials through the nine stages of a group of four steps."""
MOST_TERMS = 64
LEFT_OUT = 1e-11
"""Size of the terms left out over that of a start of size one."""
LARGEST = 1e30


@jit_inner
def recentre(given: Any, start: float, length: float, found: Any) -> None:
    """Write a polynomial (9,) of s into ``found`` as one of u, ``s = start + length u``."""
    for power in range(DEGREE + 1):
        found[power] = given[power]
    if start != 0.0 or length != 1.0:
        for low in range(DEGREE):
            for power in range(DEGREE - 1, low - 1, -1):
                found[power] += start * found[power + 1]
        factor = 1.0
        for power in range(1, DEGREE + 1):
            factor *= length
            found[power] *= factor


@jit_inner
def expand(
    plan: Any, like: Any, columns: int, law: Any, damping: Any, h: float, approach: Any, series: Any
) -> int:  # fmt: skip
    """Fill the series of all columns over a time ``h``; return the number of terms, 0: it does not converge.

    Parameters
    ----------
    plan : `wearlab.dynamics.parting_law.PartingPlan`
    law : (2 n_channel, 9) polynomials k_c, then w_c, of u = t/h
    damping : (n_mesh,) of the meshes that touch
    approach : (MOST_TERMS · n_mesh · columns) scratch: series of d·q
    series : (MOST_TERMS · n · columns) filled: coefficients of q by u
    """
    meshes, channels, n = len(plan.direction), len(plan.response), len(like)
    zero, w = np.uint64(0), np.uint64(columns)
    stride, wide = w * np.uint64(n), w * np.uint64(meshes)
    constant, square = np.uint64(2 * n), h * h
    for x in range(zero, stride + stride):
        series[x] = 0.0
    for row in range(n):
        series[np.uint64(row) * w + np.uint64(row)] = 1.0
        series[stride + np.uint64(row) * w + np.uint64(n + row)] = h
    _project(plan.direction, like, columns, series, 0, approach)
    for j in range(MOST_TERMS - 2):
        _project(plan.direction, like, columns, series, j + 1, approach)
        here = np.uint64(j) * stride
        out, ahead = here + stride + stride, j + 1.0
        for row in range(n):
            at = here + np.uint64(row) * w
            to, k, c = at + stride + stride, -square * plan.stiffness[row], -h * ahead * plan.damping[row]
            for col in range(zero, w):
                series[to + col] = k * series[at + col] + c * series[at + stride + col]
            if j == 0:
                series[to + constant] += square * plan.load[row]
                for b in range(len(plan.unknown)):
                    series[to + constant + np.uint64(1 + b)] += square * plan.unknown[b, row]
        for channel in range(channels):
            m = np.uint64(channel % meshes)
            at = np.uint64(j) * wide + m * w
            c = damping[m] / h * ahead if channel < meshes else 0.0
            for col in range(zero, w):
                force = c * approach[at + wide + col]
                for i in range(np.uint64(0), np.uint64(min(j, DEGREE) + 1)):
                    force += law[channel, i] * approach[at - i * wide + col]
                if col == constant and j <= DEGREE:
                    force -= law[channels + channel, j]
                for row in range(n):
                    to = out + np.uint64(row) * w
                    series[to + col] -= square * plan.response[channel, row] * force
        factor, size = 1.0 / (ahead * (ahead + 1.0)), 0.0
        for row in range(n):
            to = out + np.uint64(row) * w
            for col in range(zero, w):
                series[to + col] *= factor
            for col in range(zero, np.uint64(n)):
                size = max(size, abs(series[to + col]), abs(series[to + np.uint64(n) + col]) / h)
        if not size < LARGEST:
            return 0
        if j > DEGREE and size < LEFT_OUT:
            return j + 3
    return 0


@jit_inner(forceinline=True)
def _project(direction: Any, like: Any, columns: int, series: Any, j: int, approach: Any) -> None:
    """Fill term ``j`` of the series of d·q."""
    zero, w, n = np.uint64(0), np.uint64(columns), len(like)
    for m in range(len(direction)):
        to = np.uint64(j * len(direction) + m) * w
        for col in range(zero, w):
            total = 0.0
            for row in range(n):
                total += direction[m, row] * series[np.uint64(j * n + row) * w + col]
            approach[to + col] = total


@jit_inner
def map_at(series: Any, like: Any, columns: int, terms: int, u: float, h: float, found: Any) -> None:
    """Write the map from the start of a piece to ``u``, flat (2n, columns)."""
    size = np.uint64(len(like) * columns)
    last, over = np.uint64(terms - 1) * size, 1.0 / h
    for x in range(np.uint64(0), size):
        found[x], found[size + x] = series[last + x], 0.0
    for j in range(terms - 2, -1, -1):
        at = np.uint64(j) * size
        for x in range(np.uint64(0), size):
            found[size + x] = found[size + x] * u + found[x]
            found[x] = found[x] * u + series[at + x]
    for x in range(size, size + size):
        found[x] *= over


@jit_inner
def follow(series: Any, like: Any, columns: int, terms: int, given: Any, motion: Any) -> None:
    """Write the series, flat (n_terms, n), of the one motion with this start, 1 and these loads."""
    w = np.uint64(columns)
    for x in range(np.uint64(0), np.uint64(terms * len(like))):
        total = 0.0
        for col in range(np.uint64(0), w):
            total += series[x * w + col] * given[col]
        motion[x] = total


@jit_inner
def state_at(motion: Any, like: Any, terms: int, u: float, h: float, found: Any) -> None:
    """Write the state (2n,) of one motion at ``u``."""
    n = len(like)
    for row in range(n):
        value, slope = motion[(terms - 1) * n + row], 0.0
        for j in range(terms - 2, -1, -1):
            slope = slope * u + value
            value = value * u + motion[j * n + row]
        found[row] = value
        found[n + row] = slope / h

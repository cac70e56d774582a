"""The motion about the middle of a group of steps as a power series, from all starts at once.

While flanks touch, ``ÿ = p − K x − C ẋ`` with K and p polynomials of time, and x those first ones of the
coordinates y that forces feel. The coefficients of the motion follow one from another (Hairer, Nørsett &
Wanner 1993, I.8). Taken about the middle of a group, ``u = −1 … 1``, they are as few as those of half of it:
both ends are read off the same series, and the start is brought to the middle by one linear solve.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.collocation_kernel import place

STAGES, DEGREE = 9, 8
"""Of a group of four steps, and of the polynomials through them."""
MOST_TERMS = 80
FIRST_LOOK = 15
"""Term after which, and after every fourth that follows, a series is seen to end."""
LEFT_OUT = 1e-14
"""Size of the terms left out over that of a motion of size one."""
LOOKS = 4
"""Equal parts of a step at whose ends flanks are looked at."""
SMOOTHED = 1e-9
"""Part of a law, over its size, that is left out of its polynomial: tables are as smooth as that."""
WIDTH = 6
"""Columns of a series found side by side."""


@jit_inner
def in_columns(columns: int) -> int:
    """Return the columns of a series, filled up to a multiple of `WIDTH`."""
    return (columns + WIDTH - 1) // WIDTH * WIDTH


@jit_inner(forceinline=True)
def law_at_stages(plan: Any, tables: Any, first: int, law: Any) -> None:
    """Fill K, row after row, and p at the stages of the group that begins with a step, (9, n f + n)."""
    meshes, felt = plan.direction.shape
    n, rubs = plan.vector.shape[1], len(tables.sliding) > 0
    for stage in range(STAGES):
        step, at = place(first, stage, STAGES - 1)
        for row in range(n):
            for k in range(felt):
                law[stage, row * felt + k] = plan.stiffness[row, k]
            law[stage, n * felt + row] = plan.load[0, row]
        for m in range(meshes):
            of = plan.mesh[m]
            error = tables.error[step, at, of]
            hold, push = 0.0, plan.damping[m] * tables.error_rate[step, at, of]
            slow = slowed = turn = turned = 0.0
            for p in range(tables.stiffness.shape[3]):
                k = tables.stiffness[step, at, of, p]
                carried = k * (tables.gap[step, at, of, p] + error)
                hold, push = hold + k, push + carried
                if rubs:
                    share, lever = tables.sliding[step, at, of, p], tables.moment[step, at, of, p]
                    slow, slowed = slow + share * k, slowed + share * carried
                    turn, turned = turn + lever * k, turned + lever * carried
            for row in range(n):
                by = plan.vector[m, row]
                kept, pushed = by * hold, by * push
                if rubs:
                    constant, slope = plan.vector[meshes + m, row], plan.vector[2 * meshes + m, row]
                    kept += constant * slow + slope * turn
                    pushed += constant * slowed + slope * turned
                for k in range(felt):
                    law[stage, row * felt + k] += kept * plan.direction[m, k]
                law[stage, n * felt + row] += pushed


@jit_inner
def share_of(shares: Any, order: int, begin: int, end: int) -> float:
    """Return the largest share of an orthogonal polynomial in some laws."""
    largest = 0.0
    for x in range(begin, end):
        largest = max(largest, abs(shares[order, x]))
    return largest


@jit_inner(forceinline=True)
def smooth(plan: Any, law: Any, shares: Any) -> tuple[int, float]:
    """Turn values at the stages into powers of u, in place; return their degree, and the part not resolved.

    By polynomials orthogonal on the stages: what tables have of roughness is left out.
    """
    columns, holds = law.shape[1], law.shape[1] - plan.vector.shape[1]
    for order in range(STAGES):
        for x in range(np.uint64(0), np.uint64(columns)):
            shares[order, x] = 0.0
        for stage in range(STAGES):
            weight = plan.orthogonal[order, stage]
            for x in range(np.uint64(0), np.uint64(columns)):
                shares[order, x] += weight * law[stage, x]
    held, pushed = share_of(shares, 0, 0, holds), share_of(shares, 0, holds, columns)
    degree = DEGREE
    while degree > 0 and (
        share_of(shares, degree, 0, holds) <= SMOOTHED * held
        and share_of(shares, degree, holds, columns) <= SMOOTHED * pushed
    ):
        degree -= 1
    for power in range(degree + 1):
        for x in range(np.uint64(0), np.uint64(columns)):
            law[power, x] = 0.0
        for order in range(power, degree + 1):
            weight = plan.powers[power, order]
            for x in range(np.uint64(0), np.uint64(columns)):
                law[power, x] += weight * shares[order, x]
    missed = share_of(shares, DEGREE, 0, holds) / held
    rough = share_of(shares, DEGREE, holds, columns)
    return degree, max(missed, rough / pushed) if rough > 0.0 else missed


@jit_inner(forceinline=True)
def begin(plan: Any, law: Any, degree: int, half: float, pushed: Any, damped: Any, series: Any) -> None:
    """Fill the first two terms, and what terms follow by: K and C by u, and what pushes every column."""
    felt, n = plan.direction.shape[1], plan.vector.shape[1]
    square = half * half
    for power in range(degree + 1):
        for x in range(n * felt):
            law[power, x] *= square
        for row in range(n):
            pushed[power, row, 2 * felt] = square * law[power, n * felt + row]
    for row in range(n):
        for k in range(felt):
            damped[row, k] = half * plan.held_damping[row, k]
        for load in range(1, len(plan.load)):
            pushed[0, row, 2 * felt + load] = square * plan.load[load, row]
        for col in range(series.shape[2]):
            series[0, row, col] = 1.0 if col == row and row < felt else 0.0
            series[1, row, col] = 1.0 if col == felt + row and row < felt else 0.0


@jit_inner
def expand(felt: int, law: Any, degree: int, damped: Any, pushed: Any, series: Any) -> int:
    """Fill the series of all columns from the third term on; return how many terms there are, 0: no end.

    Parameters
    ----------
    felt : f, coordinates that forces feel
    law : (9, n f + n) K by u, and p
    degree : of the law
    damped : (n, f) C by u
    pushed : (9, n, width) what pushes every column by u
    series : (MOST_TERMS, n, width) filled; columns are x and half ẋ in the middle, 1, and sizes of loads
    """
    zero, one, count = np.uint64(0), np.uint64(1), np.uint64(felt)
    n, width = np.uint64(series.shape[1]), np.uint64(series.shape[2])
    for j in range(np.uint64(2), np.uint64(MOST_TERMS)):
        last, before, ahead = j - one, j - np.uint64(2), float(j) - 1.0
        top, over = min(np.uint64(degree), before), -1.0 / (float(j) * ahead)
        for c in range(zero, width, np.uint64(WIDTH)):  # six columns side by side: one waits for every sum
            d, e, f = c + one, c + np.uint64(2), c + np.uint64(3)
            g, h = c + np.uint64(4), c + np.uint64(5)
            for row in range(zero, n):
                p = q = r = s = t = u = 0.0
                if before <= np.uint64(degree):
                    push = pushed[before, row]
                    p, q, r, s, t, u = -push[c], -push[d], -push[e], -push[f], -push[g], -push[h]
                for k in range(zero, count):
                    x, y = ahead * damped[row, k], series[last, k]
                    p, q, r = p + x * y[c], q + x * y[d], r + x * y[e]
                    s, t, u = s + x * y[f], t + x * y[g], u + x * y[h]
                for power in range(zero, top + one):
                    for k in range(zero, count):
                        x, y = law[power, row * count + k], series[before - power, k]
                        p, q, r = p + x * y[c], q + x * y[d], r + x * y[e]
                        s, t, u = s + x * y[f], t + x * y[g], u + x * y[h]
                y = series[j, row]
                y[c], y[d], y[e] = over * p, over * q, over * r
                y[f], y[g], y[h] = over * s, over * t, over * u
        if j >= np.uint64(FIRST_LOOK) and (j & np.uint64(3)) == np.uint64(3):
            size = 0.0
            for row in range(zero, n):
                for col in range(zero, np.uint64(2) * count):
                    size = max(size, abs(series[j, row, col]), abs(series[last, row, col]))
            if size <= LEFT_OUT:
                return int(j) + 1
            if not size < np.inf:
                return 0
    return 0


@jit_inner
def at_ends(series: Any, terms: int, ends: Any) -> None:
    """Fill value and slope by u at the start and at the end, (2, 2, n, width); terms are even in number."""
    count = series.shape[1] * series.shape[2]
    flat, out, size = series.reshape((len(series), count)), ends.reshape((4, count)), np.uint64(count)
    for x in range(np.uint64(0), size):
        out[0, x] = out[1, x] = out[2, x] = out[3, x] = 0.0
    for j in range(0, terms, 2):
        steep, steeper = float(j), float(j + 1)
        for x in range(np.uint64(0), size):
            even, odd = flat[j, x], flat[j + 1, x]
            out[0, x] += even
            out[1, x] += steeper * odd
            out[2, x] += odd
            out[3, x] += steep * even
    for x in range(np.uint64(0), size):
        even, rise, odd, bend = out[0, x], out[1, x], out[2, x], out[3, x]
        out[0, x], out[1, x], out[2, x], out[3, x] = even - odd, rise - bend, even + odd, rise + bend


@jit_inner
def solve_rows(matrix: Any, unknowns: int) -> None:
    """Solve ``A X = B`` in place, matrix (unknowns, unknowns + columns) = (A B), by row pivots.

    References
    ----------
    Golub & Van Loan, Matrix Computations, 4th ed., 2013, §3.4.
    """
    zero, count, every = np.uint64(0), np.uint64(unknowns), np.uint64(matrix.shape[1])
    for k in range(zero, count):
        pivot = k
        for row in range(k + np.uint64(1), count):
            if abs(matrix[row, k]) > abs(matrix[pivot, k]):
                pivot = row
        over = 1.0 / matrix[pivot, k]
        for col in range(k, every):
            value = matrix[pivot, col]
            matrix[pivot, col], matrix[k, col] = matrix[k, col], over * value
        for row in range(zero, count):
            if row != k:
                factor = matrix[row, k]
                for col in range(k, every):
                    matrix[row, col] -= factor * matrix[k, col]


@jit_inner
def map_between(ends: Any, half: float, matrix: Any, to_middle: Any, affine: Any) -> None:
    """Fill the map of x and ẋ from the start of a group to its middle, and that of y and ẏ to its end.

    Parameters
    ----------
    ends : as `at_ends` fills it
    half : half the duration of the group [s]
    matrix : (2 f, 2 f + columns) scratch
    to_middle : (2 f, columns) filled; columns are x and ẋ at the start, 1, and sizes of loads
    affine : (2 n, 2 n + columns − 2 f) filled, 0 where it stays
    """
    n, (rows, columns) = ends.shape[2], to_middle.shape
    felt, loads = rows // 2, 2 * n - rows
    for k in range(felt):
        for which in range(2):
            row = which * felt + k
            for col in range(columns):
                value = ends[0, which, k, col]
                if col < rows:
                    matrix[row, col], matrix[row, rows + col] = value, 0.0
                else:
                    matrix[row, rows + col] = -value
            matrix[row, rows + row] = 1.0 if which == 0 else half
    solve_rows(matrix, rows)
    for row in range(rows):
        for col in range(columns):
            to_middle[row, col] = matrix[row, rows + col]
    for row in range(n):
        for which in range(2):
            over = 1.0 if which == 0 else 1.0 / half
            for col in range(columns):
                total = 0.0 if col < rows else moved(ends, felt, which, row, col)
                for k in range(rows):
                    total += moved(ends, felt, which, row, k) * to_middle[k, col]
                to = col if col < felt else (n + col - felt if col < rows else col + loads)
                affine[which * n + row, to] = over * total
        if row >= felt:
            affine[row, row], affine[row, n + row], affine[n + row, n + row] = 1.0, 2.0 * half, 1.0


@jit_inner
def moved(ends: Any, felt: int, which: int, row: int, col: int) -> float:
    """Return value or slope at the end; of what nothing feels, beyond how it would go on from the start."""
    if row < felt:
        return float(ends[1, which, row, col])
    more = ends[1, which, row, col] - ends[0, which, row, col]
    return float(more - 2.0 * ends[0, 1, row, col] if which == 0 else more)

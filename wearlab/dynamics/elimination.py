"""Small linear systems solved in place, columns one after another in memory."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner

WIDTH = 4
"""Unknowns eliminated at once: an entry is loaded and stored once for that many multiplications."""


@jit_inner
def eliminate(matrix: Any) -> None:
    """Solve ``A X = B`` by elimination with row pivots; X takes B's place.

    Parameters
    ----------
    matrix : (rows + columns of B, rows) the columns of A, then those of B; rows is a multiple of `WIDTH`

    References
    ----------
    Golub & Van Loan, Matrix Computations, 4th ed., 2013, §3.4.
    """
    rows = matrix.shape[1]
    for k in range(0, rows, WIDTH):
        factorise(matrix, k)
        over_columns(matrix, k, k + WIDTH, k + WIDTH, rows, False)
    for k in range(rows - WIDTH, -1, -WIDTH):
        over_columns(matrix, k, rows, 0, k, True)


@jit_inner
def over_columns(matrix: Any, k: int, first: int, low: int, high: int, back: bool) -> None:
    """Take the pivots k … k + WIDTH out of rows low … high of the columns from ``first`` on, two at once.

    ``back``: of the solution, by the upper factor; otherwise by the lower one.
    """
    total = len(matrix)
    a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
    inverse = 1.0 / a[k], 1.0 / b[k + 1], 1.0 / c[k + 2], 1.0 / d[k + 3]
    at = first
    while at < total:
        x, y = matrix[at], matrix[min(at + 1, total - 1)]
        p, q, r, s = divided(x, a, b, c, d, inverse, k) if back else reduced(x, a, b, c, d, k)
        if at + 1 < total:
            e, f, g, h = divided(y, a, b, c, d, inverse, k) if back else reduced(y, a, b, c, d, k)
            take_two(x, y, a, b, c, d, p, q, r, s, e, f, g, h, low, high)
        else:
            take(x, a, b, c, d, p, q, r, s, low, high)
        at += 2


@jit_inner
def reduced(x: Any, a: Any, b: Any, c: Any, d: Any, k: int) -> tuple[float, float, float, float]:
    """Solve for `WIDTH` entries of a column by the lower factor, in place."""
    p = x[k]
    q = x[k + 1] - p * a[k + 1]
    r = x[k + 2] - p * a[k + 2] - q * b[k + 2]
    s = x[k + 3] - p * a[k + 3] - q * b[k + 3] - r * c[k + 3]
    x[k + 1], x[k + 2], x[k + 3] = q, r, s
    return p, q, r, s


@jit_inner
def divided(
    x: Any, a: Any, b: Any, c: Any, d: Any, inverse: Any, k: int
) -> tuple[float, float, float, float]:
    """Solve for `WIDTH` entries of a column by the upper factor, in place; ``inverse``: of its pivots."""
    s = x[k + 3] * inverse[3]
    r = (x[k + 2] - s * d[k + 2]) * inverse[2]
    q = (x[k + 1] - s * d[k + 1] - r * c[k + 1]) * inverse[1]
    p = (x[k] - s * d[k] - r * c[k] - q * b[k]) * inverse[0]
    x[k], x[k + 1], x[k + 2], x[k + 3] = p, q, r, s
    return p, q, r, s


@jit_inner
def factorise(matrix: Any, first: int) -> None:
    """Factorise columns ``first … first + WIDTH`` from their diagonal down; rows swap in all columns.

    References
    ----------
    Golub & Van Loan 2013: elimination with row pivots, a few columns at a time.
    """
    total, rows = matrix.shape
    for j in range(first, first + WIDTH):
        column = matrix[j]
        for before in range(first, j):
            factor, lower = column[before], matrix[before]
            for i in range(np.uint64(before + 1), np.uint64(rows)):
                column[i] -= factor * lower[i]
        pivot = j
        for i in range(j + 1, rows):
            if abs(column[i]) > abs(column[pivot]):
                pivot = i
        if pivot != j:
            for at in range(first, total):
                matrix[at, j], matrix[at, pivot] = matrix[at, pivot], matrix[at, j]
        inverse = 1.0 / column[j]
        for i in range(np.uint64(j + 1), np.uint64(rows)):
            column[i] *= inverse


@jit_inner
def take_two(
    x: Any, y: Any, a: Any, b: Any, c: Any, d: Any, p: float, q: float, r: float, s: float, e: float,
    f: float, g: float, h: float, low: int, high: int,
) -> None:  # fmt: skip
    """Subtract ``p a + q b + r c + s d`` from entries of ``x``, and ``e a + f b + g c + h d`` from ``y``."""
    for i in range(np.uint64(low), np.uint64(high)):
        at_a, at_b, at_c, at_d = a[i], b[i], c[i], d[i]
        x[i] -= p * at_a + q * at_b + r * at_c + s * at_d
        y[i] -= e * at_a + f * at_b + g * at_c + h * at_d


@jit_inner
def take(
    x: Any, a: Any, b: Any, c: Any, d: Any, p: float, q: float, r: float, s: float, low: int, high: int
) -> None:
    """Subtract ``p a + q b + r c + s d`` from entries low … high of ``x``."""
    for i in range(np.uint64(low), np.uint64(high)):
        x[i] -= p * a[i] + q * b[i] + r * c[i] + s * d[i]

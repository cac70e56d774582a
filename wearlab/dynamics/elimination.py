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
    total, rows = matrix.shape
    for k in range(0, rows, WIDTH):
        factorise(matrix, k)
        a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
        for at in range(k + WIDTH, total):
            x = matrix[at]
            p = x[k]
            q = x[k + 1] - p * a[k + 1]
            r = x[k + 2] - p * a[k + 2] - q * b[k + 2]
            s = x[k + 3] - p * a[k + 3] - q * b[k + 3] - r * c[k + 3]
            x[k + 1], x[k + 2], x[k + 3] = q, r, s
            take(x, a, b, c, d, p, q, r, s, k + WIDTH, rows)
    for k in range(rows - WIDTH, -1, -WIDTH):
        a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
        e, f, g, h = 1.0 / a[k], 1.0 / b[k + 1], 1.0 / c[k + 2], 1.0 / d[k + 3]
        for at in range(rows, total):
            x = matrix[at]
            s = x[k + 3] * h
            r = (x[k + 2] - s * d[k + 2]) * g
            q = (x[k + 1] - s * d[k + 1] - r * c[k + 1]) * f
            p = (x[k] - s * d[k] - r * c[k] - q * b[k]) * e
            x[k], x[k + 1], x[k + 2], x[k + 3] = p, q, r, s
            take(x, a, b, c, d, p, q, r, s, 0, k)


@jit_inner
def factorise(matrix: Any, first: int) -> None:
    """Factorise columns ``first … first + WIDTH`` from their diagonal down; rows swap in all columns."""
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
def take(
    x: Any, a: Any, b: Any, c: Any, d: Any, p: float, q: float, r: float, s: float, low: int, high: int
) -> None:
    """Subtract ``p a + q b + r c + s d`` from entries low … high of ``x``."""
    for i in range(np.uint64(low), np.uint64(high)):
        x[i] -= p * a[i] + q * b[i] + r * c[i] + s * d[i]

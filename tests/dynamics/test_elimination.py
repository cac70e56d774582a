"""Elimination in place against NumPy."""

import numpy as np
import pytest

from wearlab.compiled import jit
from wearlab.dynamics.elimination import eliminate


@jit
def solved(matrix: np.ndarray) -> None:
    eliminate(matrix)


@pytest.mark.parametrize("rows", [4, 12, 48])
def test_elimination_solves_with_pivots(rows: int) -> None:
    """Zeros on the diagonal ask for rows to be swapped."""
    random = np.random.default_rng(rows)
    left, right = random.standard_normal((rows, rows)), random.standard_normal((rows, 7))
    left[np.arange(0, rows, 3), np.arange(0, rows, 3)] = 0.0
    matrix = np.ascontiguousarray(np.hstack([left, right]).T)
    solved(matrix)
    np.testing.assert_allclose(matrix[rows:].T, np.linalg.solve(left, right), rtol=1e-9, atol=1e-11)

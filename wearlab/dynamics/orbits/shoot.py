"""Newton shooting: the state that a number of mesh periods maps onto itself."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.orbits.period_map import LOCATED, PERMANENT, over_period
from wearlab.dynamics.steps.damping_law import is_linear
from wearlab.dynamics.steps.kernel import copy
from wearlab.dynamics.steps.mesh_law import (
    START,
    contact_differs,
    contact_holds,
    flank_law,
    hold_all,
    row_product,
    see_start,
)

CONVERGED, STALLED, SINGULAR = 0, 1, 2
SMALL_STEP = 1e-7
"""Size of the last step over that of the state."""
HALVINGS = 6


@jit_inner
def solve_linear(matrix: Any, right: Any) -> float:
    """Solve in place by elimination with row pivots; return the least pivot over the largest entry.

    References
    ----------
    Golub & Van Loan, Matrix Computations, 4th ed., 2013, §3.4.
    """
    n = len(right)
    largest, least = 0.0, np.inf
    for row in range(n):
        for col in range(n):
            largest = max(largest, abs(matrix[row, col]))
    for k in range(n):
        pivot = k
        for row in range(k + 1, n):
            if abs(matrix[row, k]) > abs(matrix[pivot, k]):
                pivot = row
        least = min(least, abs(matrix[pivot, k]))
        if matrix[pivot, k] == 0.0 or not np.isfinite(matrix[pivot, k]):
            return 0.0
        if pivot != k:
            right[k], right[pivot] = right[pivot], right[k]
            for col in range(n):
                matrix[k, col], matrix[pivot, col] = matrix[pivot, col], matrix[k, col]
        for row in range(k + 1, n):
            factor = matrix[row, k] / matrix[k, k]
            right[row] -= factor * right[k]
            for col in range(k, n):
                matrix[row, col] -= factor * matrix[k, col]
    for k in range(n - 1, -1, -1):
        for col in range(k + 1, n):
            right[k] -= matrix[k, col] * right[col]
        right[k] /= matrix[k, k]
    return least / largest


@jit
def exchange(balance: Any, start: Any) -> None:
    """Let the sizes of the unknown loads and the coordinates held change places in ``start``."""
    for row in range(len(balance.held)):
        at = balance.held[row]
        balance.position[row] = start[at]
        start[at] = balance.size[row]


@jit_inner
def restore(balance: Any, start: Any) -> None:
    """Undo `exchange`, keeping the sizes found."""
    for row in range(len(balance.held)):
        at = balance.held[row]
        balance.size[row] = start[at]
        start[at] = balance.position[row]


@jit_inner
def set_balance(balance: Any, states: Any, start: Any, w: int) -> None:
    """Hold the coordinates in place and set the loads; the tangent by a load starts from rest."""
    for row in range(len(balance.held)):
        at = balance.held[row]
        balance.size[row] = start[at]
        states[at * w] = balance.position[row]
        if w > at + 1:
            states[at * w + at + 1] = 0.0


@jit
def set_start(balance: Any, states: Any, start: Any, w: int) -> None:
    """Write ``start`` and unit tangents into the first state; see `exchange` for a set free to turn."""
    rows = len(start)
    states[: rows * w] = 0.0
    for row in range(rows):
        states[row * w] = start[row]
        if w > row + 1:
            states[row * w + row + 1] = 1.0
    set_balance(balance, states, start, w)


@jit_inner
def read_balance(balance: Any, states: Any, at_end: int, w: int, matrix: Any, step: Any) -> None:
    """Mend ``I − P`` and the residual where the size of a load stands for a coordinate."""
    for row in range(len(balance.held)):
        at = balance.held[row]
        matrix[at, at] -= 1.0
        step[at] = states[at_end + at * w] - balance.position[row]


@jit_inner
def read_map(
    balance: Any, states: Any, end: int, w: int, start: Any, monodromy: Any, matrix: Any, step: Any
) -> None:
    """Read the derivative P of the map into ``monodromy``, ``I − P`` into ``matrix``, the residual."""
    rows = len(start)
    at = end * rows * w
    for row in range(rows):
        for col in range(rows):
            monodromy[row, col] = states[at + row * w + 1 + col]
            matrix[row, col] = (1.0 if row == col else 0.0) - monodromy[row, col]
        step[row] = states[at + row * w] - start[row]
    read_balance(balance, states, at, w, matrix, step)


@jit_inner
def rescale(matrix: Any, step: Any, rate: float) -> None:
    """Measure velocities in units of ``rate`` [1/s], so that pivots compare like with like."""
    n = len(step) // 2
    for row in range(n):
        step[n + row] /= rate
        for col in range(n):
            matrix[row, n + col] *= rate
            matrix[n + row, col] /= rate


@jit_inner
def correct(states: Any, step: Any, count: int, w: int) -> None:
    """Write the trajectory moved by its tangents times ``step`` into the last column, which is padding."""
    rows = len(step)
    for x in range(count * rows):
        value = states[x * w]
        for col in range(rows):
            value += states[x * w + 1 + col] * step[col]
        states[x * w + w - 1] = value


@jit
def same_contact(
    kernel: Any, tables: Any, period: float, periods: int, w: Any, states: Any, s: Any, contact: int
) -> bool:
    """Whether the corrected orbit touches and pushes where the pass did: the map was affine."""
    n, meshes, steps = len(kernel.structure.push), kernel.meshes, len(tables.width)
    size, last = np.uint64(2 * n) * w, w - np.uint64(1)
    d, below = kernel.structure.direction, np.uint64(n) * w
    for at in range(periods * steps):
        step = at % steps
        i = np.uint64(at) * size
        if contact == PERMANENT:
            hold_all(kernel, tables, step, s)
            flank_law(meshes, tables, step, 0.0, 1.0, period, s, s.law[0], s.rub[0])
        else:
            see_start(kernel, tables, step, period, w, states, i, s, s.law[0], s.rub[0])
        for m in range(len(meshes.damping)):
            place = row_product(d, m, n, states, i + last, w)
            speed = row_product(d, m, n, states, i + last + below, w)
            if contact_differs(meshes, tables, step, START, m, place, speed, s.law[0, 0, m], s):
                return False
        if not contact_holds(kernel, tables, step, period, w, states, i + last, i + last + size, s, s.law[0]):
            return False
    return True


@jit_inner
def weighted_norm(values: Any, rate: float) -> float:
    """Return the largest of |q| and |q̇|/rate."""
    n = len(values) // 2
    worst = 0.0
    for row in range(n):
        worst = max(worst, abs(values[row]), abs(values[n + row]) / rate)
    return worst


@jit
def shoot(
    kernel: Any, tables: Any, period: float, periods: int, columns: Any, width: Any, start: Any, contact: int,
    most: int, states: Any, monodromy: Any, s: Any,
) -> tuple[int, int, float, int]:  # fmt: skip
    """Find the orbit over ``periods`` mesh periods near ``start`` (2n,), which it moves.

    Parameters
    ----------
    kernel, tables, period, columns, width, s : as in `over_period`; all columns
    contact : of the first pass: `LOCATED`, or `PERMANENT`, the affine map of a mesh whose pairs all touch
    most : passes allowed
    states : (periods · n_steps + 1, 2n, width) flat, tangents and all; the answer in its last column
    monodromy : (2n, 2n): derivative of the map at the answer

    Returns
    -------
    code, passes, relative size of the last step, contact changes met in the last pass
    """
    rows, w, steps = len(start), len(width), len(tables.width)
    rate = 2.0 * np.pi * steps / (16.0 * period)
    exchange(kernel.balance, start)
    matrix, step, trial = np.empty((rows, rows)), np.zeros(rows), start.copy()
    missing = np.empty(rows)
    old_residual, halved, error, changes = np.inf, 0, np.inf, 0
    for passes in range(1, most + 1):
        set_start(kernel.balance, states, trial, w)
        changes = 0
        for k in range(periods):
            changes += over_period(kernel, tables, period, columns, width, states, k * steps, s, contact)
        read_map(kernel.balance, states, periods * steps, w, trial, monodromy, matrix, missing)
        residual = weighted_norm(missing, rate)
        if contact != PERMANENT and not residual <= 4.0 * old_residual and halved < HALVINGS:
            halved += 1
            for row in range(rows):
                step[row] *= 0.5
                trial[row] = start[row] + step[row]
            continue
        copy(trial, np.uint64(0), start, np.uint64(0), rows)
        copy(missing, np.uint64(0), step, np.uint64(0), rows)
        rescale(matrix, step, rate)
        if not solve_linear(matrix, step) > 1e-13:
            restore(kernel.balance, start)
            return SINGULAR, passes, np.inf, changes
        for row in range(rows // 2):
            step[rows // 2 + row] *= rate
        error = weighted_norm(step, rate)
        correct(states, step, periods * steps + 1, w)
        exact = (
            changes == 0
            and is_linear(kernel.meshes.law)
            and same_contact(kernel, tables, period, periods, np.uint64(w), states, s, contact)
        )
        if exact or (contact != PERMANENT and error <= SMALL_STEP * weighted_norm(start, rate)):
            for row in range(rows):
                start[row] += step[row]
            restore(kernel.balance, start)
            return CONVERGED, passes, error, changes
        for row in range(rows):
            trial[row] = start[row] + step[row]
        old_residual = np.inf if contact == PERMANENT else residual
        halved, contact = 0, LOCATED
    restore(kernel.balance, start)
    return STALLED, most, error, changes

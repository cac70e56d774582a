"""Newton shooting: the state that a number of mesh periods maps onto itself."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.flanks import contact_differs, see_contact
from wearlab.dynamics.period_map import (
    LOCATED,
    MIDDLE,
    TOUCHING,
    contact_holds,
    deflection_at_start,
    over_period,
    touch_all,
)
from wearlab.dynamics.registers import START, copy
from wearlab.dynamics.sections import turn_back

CONVERGED, STALLED, SINGULAR = 0, 1, 2
SMALL_STEP, ROUGH_STEP = 1e-7, 1e-3
"""Size of the last step over that of the state: of an answer, and of a start for one."""
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
    if balance is not None:
        for row in range(len(balance.held)):
            at = balance.held[row]
            balance.home[row] = start[at]
            start[at] = balance.size[row]


@jit_inner
def restore(balance: Any, start: Any) -> None:
    """Undo `exchange`, keeping the sizes found."""
    if balance is not None:
        for row in range(len(balance.held)):
            at = balance.held[row]
            balance.size[row] = start[at]
            start[at] = balance.home[row]


@jit_inner
def set_balance(balance: Any, states: Any, start: Any, w: int) -> None:
    """Hold the coordinates at home and set the loads; the tangent by a load starts from rest."""
    if balance is not None:
        for row in range(len(balance.held)):
            at = balance.held[row]
            balance.size[row] = start[at]
            states[at * w] = balance.home[row]
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
    if balance is not None:
        for row in range(len(balance.held)):
            at = balance.held[row]
            matrix[at, at] -= 1.0
            step[at] = states[at_end + at * w] - balance.home[row]


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


@jit_inner
def same_contact(
    kernel: Any, tables: Any, period: float, periods: int, width: Any, states: Any, s: Any, touch: int
) -> bool:
    """Whether the corrected orbit touches where the pass did: the map was affine, the orbit is exact."""
    w = np.uint64(len(width))
    size = np.uint64(2 * len(kernel.structure.push)) * w
    last = w - np.uint64(1)
    steps = len(tables.width)
    for at in range(periods * steps):
        step = at % steps
        i = np.uint64(at) * size
        if touch == TOUCHING:
            touch_all(kernel, tables, step, s.contact)
        for m in range(len(kernel.mesh_damping)):
            if touch != TOUCHING:
                delta = deflection_at_start(kernel, tables, step, m, width, states, i)
                see_contact(kernel, tables, step, delta, m, START, s.contact)
            delta = deflection_at_start(kernel, tables, step, m, width, states, i + last)
            if contact_differs(kernel, tables, step, delta, m, START, s.contact):
                return False
        if not contact_holds(
            kernel, tables, step, period, width, states, i + last, i + last + size, s.contact
        ):
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
    kernel: Any,
    tables: Any,
    period: float,
    periods: int,
    columns: Any,
    width: Any,
    start: Any,
    touch: int,
    most: int,
    states: Any,
    monodromy: Any,
    s: Any,
    turn: Any,
) -> tuple[int, int, float, int]:
    """Find the orbit over ``periods`` mesh periods near ``start`` (2n,), which it moves.

    Parameters
    ----------
    columns, width : see `rk4_step`; all columns
    touch : how contact is taken, see `over_period`: `LOCATED`; `TOUCHING`, which begins with the affine map
        of a mesh whose pairs all touch (a cold start); `MIDDLE` to the end; or `TOUCHING_FIRST`, then that
    most : passes allowed
    states : (periods · n_steps + 2, 2n, width) flat, tangents and all; the answer in its last column
    monodromy : (2n, 2n): derivative of the map at the answer
    turn : (n, n) by which the orbit ends turned, the tables being those of a section of the mesh period, see
        `wearlab.dynamics.symmetry`; (0, 0) or None: it ends where it began

    Returns
    -------
    code, passes, relative size of the last step, contact changes met in the last pass
    """
    rows, w, steps = len(start), len(width), len(tables.width)
    rate = 2.0 * np.pi * steps / (16.0 * period)
    exchange(kernel.balance, start)
    matrix, step, trial = np.empty((rows, rows)), np.zeros(rows), start.copy()
    old_residual, halved, error, changes = np.inf, 0, np.inf, 0
    after = MIDDLE if touch >= MIDDLE else LOCATED
    touch = TOUCHING if touch > MIDDLE else touch
    small = ROUGH_STEP if after == MIDDLE else SMALL_STEP
    for passes in range(1, most + 1):
        set_start(kernel.balance, states, trial, w)
        changes = 0
        for k in range(periods):
            changes += over_period(kernel, tables, period, columns, width, states, k * steps, s, touch)
        residual_vector, end = np.empty(rows), periods * steps
        if turn is not None and len(turn):
            size = rows * w  # the end is written behind itself, turned back
            end += 1
            states[end * size : (end + 1) * size] = states[(end - 1) * size : end * size]
            turn_back(turn, states[end * size : (end + 1) * size].reshape((rows, w)))
        read_map(kernel.balance, states, end, w, trial, monodromy, matrix, residual_vector)
        residual = weighted_norm(residual_vector, rate)
        if touch != TOUCHING and not residual <= 4.0 * old_residual and halved < HALVINGS:
            halved += 1
            for row in range(rows):
                step[row] *= 0.5
                trial[row] = start[row] + step[row]
            continue
        copy(trial, np.uint64(0), start, np.uint64(0), rows)
        copy(residual_vector, np.uint64(0), step, np.uint64(0), rows)
        rescale(matrix, step, rate)
        if not solve_linear(matrix, step) > 1e-13:
            restore(kernel.balance, start)
            return SINGULAR, passes, np.inf, changes
        for row in range(rows // 2):
            step[rows // 2 + row] *= rate
        error = weighted_norm(step, rate)
        correct(states, step, periods * steps + 1, w)
        exact = changes == 0 and same_contact(kernel, tables, period, periods, width, states, s, touch)
        if exact or (touch != TOUCHING and error <= small * weighted_norm(start, rate)):
            for row in range(rows):
                start[row] += step[row]
            restore(kernel.balance, start)
            return CONVERGED, passes, error, changes
        for row in range(rows):
            trial[row] = start[row] + step[row]
        old_residual = np.inf if touch == TOUCHING else residual
        halved, touch = 0, after
    restore(kernel.balance, start)
    return STALLED, most, error, changes

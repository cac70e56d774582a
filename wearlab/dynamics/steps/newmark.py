"""Newmark's method with constant average acceleration, integrated until steady."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.balance import rebalance
from wearlab.dynamics.orbits.integrate import OneState, UntilSteady
from wearlab.dynamics.steps.equation import acceleration, free_acceleration, place_and_speed, see_within
from wearlab.dynamics.steps.kernel import write
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MOST_ITERATIONS = 12


@dataclass(frozen=True)
class Newmark(UntilSteady):
    """Newmark-β with β = 1/4, γ = 1/2, Newton on the contact inside each step (Newmark 1959).

    Second order; implicit and unconditionally stable for constant contact. Parameters: see `UntilSteady`.
    """

    def integrator(self, system: System, tables: StageTables, period: float) -> "AverageAcceleration":
        """Return what integrates a system over mesh periods."""
        return AverageAcceleration(system, tables, period)


class AverageAcceleration(OneState):
    """Integrates by implicit steps, one for each step of the tables."""

    def fill(self, state: Array, count: int, keep: int, orbit: Array, strobe: Array) -> int:
        """Integrate, and count the right-hand sides."""
        return int(
            integrate_newmark(
                self.kernel, self.tables, self.period, state, count, keep, orbit, strobe, self.scratch
            )
        )


@jit
def integrate_newmark(
    kernel: Any, tables: Any, period: float, state: Array, count: int, keep: int, orbit: Array, strobe: Array,
    s: Any,
) -> int:  # fmt: skip
    """Integrate ``count`` periods; fill ``orbit`` with the last ``keep`` and ``strobe``; count evaluations.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    steps, n, flags = len(tables.width), len(state) // 2, s.touch.size
    before, after, trial, matrix = np.empty(n), np.empty(n), np.empty(2 * n), np.empty((n, n))
    seen = np.zeros(2 * flags, np.bool_)
    evaluations = 0
    write(state, strobe[0])
    for k in range(count):
        slot = k - (count - keep)
        for step in range(steps):
            if slot >= 0:
                write(state, orbit[slot * steps + step])
            evaluations += newmark_step(
                kernel, tables, step, period, state, before, after, trial, matrix, seen, s
            )
        rebalance(kernel.balance, strobe[k], state, period)
        write(state, strobe[k + 1])
    write(state, orbit[keep * steps])
    return evaluations


@jit_inner
def newmark_step(
    kernel: Any, tables: Any, step: int, period: float, state: Array, before: Array, after: Array,
    trial: Array, matrix: Array, seen: Any, s: Any,
) -> int:  # fmt: skip
    """Advance ``state`` over one step of the tables; count the evaluations.

    ``q₁ = q₀ + h v₀ + h²/4 (a₀ + a₁)``, ``v₁ = v₀ + h/2 (a₀ + a₁)``, with a₁ from the equation of motion at
    the end of the step; the contact there is guessed, solved for and guessed again until it agrees.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    n, h, touch, pushes = len(before), tables.width[step] * period, s.touch.ravel(), s.pushes.ravel()
    acceleration(kernel, tables, step, 0.0, period, state, s, before)
    write(state, trial)
    evaluations = 0
    for iteration in range(MOST_ITERATIONS):
        see_within(kernel, tables, step, 1.0, period, trial, s)
        agreed = iteration > 0
        for x in range(len(touch)):
            agreed = agreed and seen[x] == touch[x] and seen[len(touch) + x] == pushes[x]
            seen[x], seen[len(touch) + x] = touch[x], pushes[x]
        if agreed:
            break
        evaluations += 1
        for row in range(n):
            trial[row] = state[row] + h * state[n + row] + 0.25 * h * h * before[row]
            trial[n + row] = state[n + row] + 0.5 * h * before[row]
        _end_equation(kernel, tables, step, h, s, trial, after, matrix)
        solve_linear(matrix, after)
        for row in range(n):
            trial[row] += 0.25 * h * h * after[row]
            trial[n + row] += 0.5 * h * after[row]
    write(trial, state)
    return evaluations + 1


@jit_inner
def _end_equation(
    kernel: Any, tables: Any, step: int, h: float, s: Any, predicted: Array, right: Array, matrix: Array
) -> None:
    """Fill matrix and right-hand side of the equation for a₁: what a₁ itself adds goes to the left."""
    n, given, channels = len(right), kernel.series, len(kernel.meshes.channels)
    count, square, half = len(kernel.meshes.damping), 0.25 * h * h, 0.5 * h
    free_acceleration(kernel, predicted, right)
    for row in range(n):
        if kernel.fluctuates:
            right[row] += tables.fluctuation[step, 2] * given.fluctuation[row]
        for col in range(n):
            matrix[row, col] = square * given.stiffness[row, col] + half * given.damping[row, col]
        matrix[row, row] += 1.0
    for c in range(channels):
        k, b = s.mesh[c], s.mesh[3 * channels + c]
        place, speed = place_and_speed(given.direction, c % count, predicted)
        force = k * place + b * speed - s.force[c]
        for row in range(n):
            right[row] -= given.per_force[c, row] * force
            for col in range(n):
                felt = given.direction[c % count, col] * (square * k + half * b)
                matrix[row, col] += given.per_force[c, row] * felt


@jit_inner
def solve_linear(matrix: Any, right: Any) -> float:
    """Solve in place by elimination with row pivots.

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

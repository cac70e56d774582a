"""Newmark's method with constant average acceleration, integrated until steady."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit_inner
from wearlab.dynamics.orbits.integrate import STEPS, OneState, UntilSteady
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

    def integrator(self, system: System, tables: StageTables, period: float) -> OneState:
        """Return what integrates a system over mesh periods."""
        n, flags = len(system.load), np.prod(tables.stiffness.shape[2:]) + len(system.direction)
        ends = np.empty(n), np.empty(n), np.empty(2 * n), np.empty((n, n))
        memory = NewmarkMemory(*ends, np.zeros(2 * flags, np.bool_))
        return OneState(system, tables, period, memory)


class NewmarkMemory(NamedTuple):
    """Memory of a step.

    Parameters
    ----------
    before, after : (n,) accelerations
    trial : (2n,) state tried
    matrix : (n, n) of the equation for the acceleration after
    seen : which flanks touched and pushed
    """

    before: Array
    after: Array
    trial: Array
    matrix: Array
    seen: Array


def newmark_step(memory: Any, kernel: Any, tables: Any, step: int, period: float, state: Any, s: Any) -> int:
    """Advance ``state`` over one step of the tables; count the evaluations.

    ``q₁ = q₀ + h v₀ + h²/4 (a₀ + a₁)``, ``v₁ = v₀ + h/2 (a₀ + a₁)``, with a₁ from the equation of motion at
    the end of the step; the contact there is guessed, solved for and guessed again until it agrees.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    before, after, trial, matrix, seen = memory
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
        write(np.linalg.solve(matrix, after), after)
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


STEPS[NewmarkMemory] = newmark_step

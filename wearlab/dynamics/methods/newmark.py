"""Newmark-β with β = 1/4, γ = 1/2 (Newmark 1959).

Newton's method finds the contact at the end of each step.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit_inner
from wearlab.dynamics.integrators import mesh_law, rk4
from wearlab.dynamics.integrators.instant import acceleration, set_instant
from wearlab.dynamics.integrators.kernel import write
from wearlab.dynamics.steady.until_steady import UntilSteady
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MAX_ITERATIONS = 12


@dataclass(frozen=True)
class Newmark(UntilSteady):
    """Newmark-β with β = 1/4, γ = 1/2 (Newmark 1959).

    Second order; implicit and unconditionally stable for constant contact. Parameters:
    see `UntilSteady`.
    """

    def memory(self, system: System, tables: StageTables) -> "NewmarkMemory":
        """Return the memory of the steps."""
        n = len(system.load)
        flags = np.prod(tables.stiffness.shape[2:]) + len(system.direction)
        return NewmarkMemory(
            first=np.empty(n),
            last=np.empty(n),
            trial=np.empty(2 * n),
            matrix=np.empty((n, n)),
            contact=np.zeros(2 * flags, np.bool_),
        )


class NewmarkMemory(NamedTuple):
    """Memory of a step.

    Parameters
    ----------
    first, last : (n,) accelerations at its start and its end
    trial : (2n,) state tried
    matrix : (n, n) of the equation for the last acceleration
    contact : which flanks touched and pushed
    """

    first: Array
    last: Array
    trial: Array
    matrix: Array
    contact: Array

    def advance(self, kernel: Any, step: int, state: Any) -> int:
        """Advance ``state`` over one step of the tables; count the evaluations.

        ``q₁ = q₀ + h v₀ + h²/4 (a₀ + a₁)``, ``v₁ = v₀ + h/2 (a₀ + a₁)``, with a₁ from
        the equation of motion at the end of the step; the contact there is guessed,
        solved for and guessed again until it agrees.

        Parameters
        ----------
        kernel, step : the system, and a step of its tables
        state : (2n,) at the start; at the end afterwards

        References
        ----------
        Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
        """
        first = self.first
        last = self.last
        trial = self.trial
        n = len(first)
        h = kernel.flanks.tables.width[step] * kernel.flanks.period
        acceleration(kernel, step, 0.0, state, first)
        write(state, trial)
        evaluations = 0
        for iteration in range(MAX_ITERATIONS):
            set_instant(kernel, step, 1.0, trial)
            agreed = _contact_agrees(self.contact, kernel.flanks.scratch)
            if agreed and iteration > 0:
                break
            evaluations += 1
            for row in range(n):
                trial[row] = state[row] + h * state[n + row] + 0.25 * h * h * first[row]
                trial[n + row] = state[n + row] + 0.5 * h * first[row]
            _end_equation(kernel, step, trial, last, self.matrix)
            write(np.linalg.solve(self.matrix, last), last)
            for row in range(n):
                trial[row] += 0.25 * h * h * last[row]
                trial[n + row] += 0.5 * h * last[row]
        write(trial, state)
        return evaluations + 1


@jit_inner
def _contact_agrees(contact: Any, scratch: Any) -> bool:
    """Whether the same flanks touch and push as remembered; remember those that do."""
    touch = scratch.touch.ravel()
    pushes = scratch.pushes.ravel()
    agreed = True
    for x in range(len(touch)):
        agreed = agreed and contact[x] == touch[x]
        agreed = agreed and contact[len(touch) + x] == pushes[x]
        contact[x] = touch[x]
        contact[len(touch) + x] = pushes[x]
    return agreed


@jit_inner
def _end_equation(
    kernel: Any, step: int, predicted: Array, right: Array, matrix: Array
) -> None:
    """Fill matrix and right-hand side of the equation for a₁.

    What a₁ itself adds to the motion goes to the left.
    """
    n = len(right)
    series = kernel.series
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    mesh = kernel.flanks.scratch.mesh[0]
    channels = len(kernel.flanks.meshes.channels)
    count = len(kernel.flanks.meshes.damping)
    square = 0.25 * h * h
    half = 0.5 * h
    rk4.acceleration(kernel, mesh_law.START, predicted, right)
    for row in range(n):
        for col in range(n):
            matrix[row, col] = (
                square * series.stiffness[row, col] + half * series.damping[row, col]
            )
            for c in range(channels):
                force = series.direction[c % count, col] * (
                    square * mesh[c] + half * mesh[3 * channels + c]
                )
                matrix[row, col] += series.enters[c, row] * force
        matrix[row, row] += 1.0

"""Newmark's method with constant average acceleration, marched until steady."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.balance import rebalance
from wearlab.dynamics.events import Scratch, scratch
from wearlab.dynamics.flanks import contact_differs, mesh_law, see_contact
from wearlab.dynamics.motion import acceleration, unmeshed
from wearlab.dynamics.newton import solve_linear
from wearlab.dynamics.registers import END, write
from wearlab.dynamics.steady import Marching, OneState
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MOST_ITERATIONS = 12
ONE_COLUMN = (0,)


@dataclass(frozen=True)
class Newmark(Marching):
    """Newmark-β with β = 1/4, γ = 1/2, Newton on the contact inside each step (Newmark 1959).

    Second order; implicit and unconditionally stable for constant contact. Parameters: see `Marching`.
    """

    def marcher(self, system: System, tables: StageTables, period: float) -> "_NewmarkMarcher":
        """Return what integrates a system over mesh periods."""
        return _NewmarkMarcher(system, tables, period)


class _NewmarkMarcher(OneState):
    def __init__(self, system: System, tables: StageTables, period: float) -> None:
        super().__init__(system, tables, period)
        meshes, pairs = self.tables.stiffness.shape[2:]
        self.scratch: Scratch = scratch(len(system.load), meshes, len(self.kernel.channels), pairs, 1)

    def fill(self, state: Array, count: int, keep: int, orbit: Array, strobe: Array) -> int:
        return int(
            march_newmark(
                self.kernel, self.tables, self.period, state, count, keep, orbit, strobe, self.scratch
            )
        )


@jit
def march_newmark(
    kernel: Any,
    tables: Any,
    period: float,
    state: Array,
    count: int,
    keep: int,
    orbit: Array,
    strobe: Array,
    s: Any,
) -> int:
    """March ``count`` periods; fill ``orbit`` with the last ``keep`` and ``strobe``; count evaluations.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    steps, n = len(tables.width), len(state) // 2
    before, after, trial, matrix = np.empty(n), np.empty(n), np.empty(2 * n), np.empty((n, n))
    evaluations = 0
    write(state, strobe[0])
    for k in range(count):
        slot = k - (count - keep)
        for step in range(steps):
            if slot >= 0:
                write(state, orbit[slot * steps + step])
            evaluations += newmark_step(kernel, tables, step, period, state, before, after, trial, matrix, s)
        rebalance(kernel.balance, strobe[k], state, period)
        write(state, strobe[k + 1])
    write(state, orbit[keep * steps])
    return evaluations


@jit_inner
def newmark_step(
    kernel: Any,
    tables: Any,
    step: int,
    period: float,
    state: Array,
    before: Array,
    after: Array,
    trial: Array,
    matrix: Array,
    s: Any,
) -> int:
    """Advance ``state`` over one step of the tables.

    ``q₁ = q₀ + h v₀ + h²/4 (a₀ + a₁)``, ``v₁ = v₀ + h/2 (a₀ + a₁)``, with a₁ from the equation of motion at
    the end of the step; the contact there is guessed, solved for and guessed again until it agrees.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    n, meshes = len(before), len(kernel.mesh_damping)
    h = tables.width[step] * period
    acceleration(kernel, tables, step, 0.0, period, state, before)
    write(state, trial)
    for iteration in range(MOST_ITERATIONS):
        agreed = iteration > 0
        for m in range(meshes):
            delta = _product(kernel.structure.direction, m, n, trial, 0) - tables.error[step, 2, m]
            if contact_differs(kernel, tables, step, delta, m, END, s.contact) or iteration == 0:
                see_contact(kernel, tables, step, delta, m, END, s.contact)
                agreed = False
        if agreed:
            break
        mesh_law(kernel, tables, step, period, s.contact, ONE_COLUMN, s.mesh, s.push)
        for row in range(n):
            trial[row] = state[row] + h * state[n + row] + 0.25 * h * h * before[row]
            trial[n + row] = state[n + row] + 0.5 * h * before[row]
        _end_equation(kernel, h, s, trial, after, matrix)
        solve_linear(matrix, after)
        for row in range(n):
            trial[row] += 0.25 * h * h * after[row]
            trial[n + row] += 0.5 * h * after[row]
    write(trial, state)
    return iteration + 1


@jit_inner
def _product(direction: Any, m: int, n: int, state: Array, first: int) -> float:
    total = 0.0
    for row in range(n):
        total += direction[m * n + row] * state[first + row]
    return total


@jit_inner
def _end_equation(kernel: Any, h: float, s: Any, predicted: Array, right: Array, matrix: Array) -> None:
    """Fill matrix and right-hand side of the equation for a₁: what a₁ itself adds goes to the left."""
    n, channels = len(right), len(kernel.channels)
    structure = kernel.structure
    unit, answer = np.zeros(2 * n), np.empty(n)
    unmeshed(structure, unit, answer)
    pushed = answer.copy()
    unmeshed(structure, predicted, right)
    for row in range(n):
        right[row] += s.push[2 * n + row] - structure.push[row]
    for m in range(channels):
        force = s.mesh[2 * channels + m] * _product(structure.direction, m, n, predicted, 0)
        force += s.mesh[3 * channels + m] * _product(structure.direction, m, n, predicted, n)
        for row in range(n):
            right[row] -= structure.per_force[m * n + row] * force
    for col in range(n):
        unit[:] = 0.0
        unit[col] = 0.25 * h * h
        unit[n + col] = 0.5 * h
        unmeshed(structure, unit, answer)
        for row in range(n):
            matrix[row, col] = (1.0 if row == col else 0.0) + pushed[row] - answer[row]
        for m in range(channels):
            d = structure.direction[m * n + col]
            force = d * (s.mesh[2 * channels + m] * 0.25 * h * h + s.mesh[3 * channels + m] * 0.5 * h)
            for row in range(n):
                matrix[row, col] += structure.per_force[m * n + row] * force

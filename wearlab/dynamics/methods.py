"""The ways to find a steady response: one road, ``method.solve(system, tables, period, start)``.

Beside shooting, and Runge–Kutta steps that locate changes of contact, these are the
methods of the papers: they integrate the equation of motion itself until steady, and do
not follow changes of contact.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import RK45

from wearlab.arrays import Array
from wearlab.compiled import jit_inner
from wearlab.dynamics.integrators import damping_law, mesh_law, rk4
from wearlab.dynamics.integrators.kernel import write
from wearlab.dynamics.steady.integrate import STEPS, RungeKutta4, UntilSteady
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

__all__ = ["Method", "Newmark", "Periodic", "RungeKutta4", "RungeKutta45"]
MOST_ITERATIONS = 12
NODES = np.append(RK45.C, 1.0)
WEIGHTS = np.zeros((7, 7))
WEIGHTS[:6, :5] = RK45.A
WEIGHTS[6, :6] = RK45.B
FOURTH = np.array(
    [5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40]
)
LEAST_FRACTION = 1e-9


@jit_inner(counted=False)
def see_within(kernel: Any, step: int, x: float, state: Any) -> None:
    """Set what touches and pushes at fraction ``x`` of a step, channels and loads there."""
    for m in range(len(kernel.flanks.meshes.damping)):
        place, speed = mesh_law.motion_of(
            kernel.structure, m, np.uint64(1), state, np.uint64(0)
        )
        damping_law.see_flanks(
            kernel.flanks.meshes.law, kernel.flanks, step, x, m, place, speed
        )
    mesh_law.channel_law(kernel.flanks, mesh_law.THIS, 1)
    mesh_law.fill_loads(kernel, step, x, x, mesh_law.THIS)


@jit_inner(counted=False)
def acceleration(kernel: Any, step: int, x: float, state: Any, out: Any) -> None:
    """Write q̈ (n,) at fraction ``x`` of ``step`` for ``state`` (2n,)."""
    see_within(kernel, step, x, state)
    rk4.acceleration(kernel, mesh_law.START, state, out)


@dataclass(frozen=True)
class RungeKutta45(UntilSteady):
    """Adaptive steps of order five with an embedded fourth order (Dormand & Prince 1980).

    The tables are interpolated within their steps and integration stops at every end of
    them, so no step straddles a jump. Contact changes are left to the error control, as
    in the papers.

    Parameters
    ----------
    relative, absolute : error allowed per step: relative, and of positions [m]
    tolerance, most, longest, averaged : see
        `wearlab.dynamics.steady.integrate.UntilSteady`
    """

    relative: float = 1e-7
    absolute: float = 1e-14

    def memory(self, system: System, tables: StageTables) -> "AdaptiveMemory":
        """Return the memory of the steps."""
        return AdaptiveMemory(
            np.empty((8, 2 * len(system.load))),
            np.ones(1),
            self.relative,
            self.absolute,
        )


class AdaptiveMemory(NamedTuple):
    """Memory of a step.

    Parameters
    ----------
    rows : (8, 2n) slopes of the stages, and the state tried
    fraction : (1,) of a step of the tables that is tried next
    relative, absolute : tolerances
    """

    rows: Array
    fraction: Array
    relative: float
    absolute: float


def adaptive_step(memory: Any, kernel: Any, step: int, state: Any) -> int:
    """Integrate over one step of the tables, in as many parts as tolerances ask for.

    Count the evaluations.

    References
    ----------
    Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19–26.
    """
    slopes = memory.rows[:7]
    trial = memory.rows[7]
    relative = memory.relative
    absolute = memory.absolute
    n = len(state) // 2
    width = kernel.flanks.tables.width[step] * kernel.flanks.period
    x = 0.0
    evaluations = 0
    size = memory.fraction[0]
    while x < 1.0:
        size = max(LEAST_FRACTION, size)
        part = 1.0 - x if x + size > 1.0 - 1e-12 else size
        h = part * width
        for stage in range(7):
            for row in range(2 * n):
                trial[row] = state[row]
                for before in range(stage):
                    trial[row] += h * WEIGHTS[stage, before] * slopes[before, row]
            write(trial[n:], slopes[stage])
            acceleration(
                kernel, step, x + NODES[stage] * part, trial, slopes[stage, n:]
            )
        evaluations += 7
        error = 0.0
        for row in range(2 * n):
            change = 0.0
            for stage in range(7):
                change += h * (WEIGHTS[6, stage] - FOURTH[stage]) * slopes[stage, row]
            allowed = absolute * (1.0 if row < n else 1.0 / width)
            allowed += relative * max(abs(state[row]), abs(trial[row]))
            error = max(error, abs(change) / allowed)
        factor = 5.0 if error == 0.0 else min(5.0, max(0.2, 0.9 * error**-0.2))
        if error <= 1.0 or part <= LEAST_FRACTION:
            x = 1.0 if part == 1.0 - x else x + part
            write(trial, state)
            size = max(size, part * factor) if x == 1.0 else part * factor
        else:
            size = part * factor
    memory.fraction[0] = min(size, 1.0)
    return evaluations


@dataclass(frozen=True)
class Newmark(UntilSteady):
    """Newmark-β with β = 1/4, γ = 1/2, Newton on the contact inside each step (Newmark 1959).

    Second order; implicit and unconditionally stable for constant contact. Parameters:
    see `UntilSteady`.
    """

    def memory(self, system: System, tables: StageTables) -> "NewmarkMemory":
        """Return the memory of the steps."""
        n = len(system.load)
        flags = np.prod(tables.stiffness.shape[2:]) + len(system.direction)
        ends = np.empty(n), np.empty(n), np.empty(2 * n), np.empty((n, n))
        return NewmarkMemory(*ends, np.zeros(2 * flags, np.bool_))


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


def newmark_step(memory: Any, kernel: Any, step: int, state: Any) -> int:
    """Advance ``state`` over one step of the tables; count the evaluations.

    ``q₁ = q₀ + h v₀ + h²/4 (a₀ + a₁)``, ``v₁ = v₀ + h/2 (a₀ + a₁)``, with a₁ from the
    equation of motion at the end of the step; the contact there is guessed, solved for
    and guessed again until it agrees.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.
    """
    before, after, trial, matrix, seen = memory
    touch = kernel.flanks.scratch.touch.ravel()
    pushes = kernel.flanks.scratch.pushes.ravel()
    n = len(before)
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    acceleration(kernel, step, 0.0, state, before)
    write(state, trial)
    evaluations = 0
    for iteration in range(MOST_ITERATIONS):
        see_within(kernel, step, 1.0, trial)
        agreed = iteration > 0
        for x in range(len(touch)):
            agreed = (
                agreed and seen[x] == touch[x] and seen[len(touch) + x] == pushes[x]
            )
            seen[x], seen[len(touch) + x] = touch[x], pushes[x]
        if agreed:
            break
        evaluations += 1
        for row in range(n):
            trial[row] = state[row] + h * state[n + row] + 0.25 * h * h * before[row]
            trial[n + row] = state[n + row] + 0.5 * h * before[row]
        _end_equation(kernel, step, trial, after, matrix)
        write(np.linalg.solve(matrix, after), after)
        for row in range(n):
            trial[row] += 0.25 * h * h * after[row]
            trial[n + row] += 0.5 * h * after[row]
    write(trial, state)
    return evaluations + 1


@jit_inner
def _end_equation(
    kernel: Any, step: int, predicted: Array, right: Array, matrix: Array
) -> None:
    """Fill matrix and right-hand side of the equation for a₁: what a₁ itself adds goes to the left."""
    n = len(right)
    given = kernel.series
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
                square * given.stiffness[row, col] + half * given.damping[row, col]
            )
            for c in range(channels):
                felt = given.direction[c % count, col] * (
                    square * mesh[c] + half * mesh[3 * channels + c]
                )
                matrix[row, col] += given.enters[c, row] * felt
        matrix[row, row] += 1.0


STEPS |= {AdaptiveMemory: adaptive_step, NewmarkMemory: newmark_step}
Method = Periodic | RungeKutta4 | RungeKutta45 | Newmark

"""The adaptive Runge–Kutta pair of Dormand and Prince, integrated until steady, as the papers do."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.integrate import STEPS, OneState, UntilSteady
from wearlab.dynamics.steps.equation import acceleration
from wearlab.dynamics.steps.kernel import write
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
WEIGHTS = np.array(
    [
        [0, 0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
    ]
)
FOURTH = np.array([5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40])
LEAST_FRACTION = 1e-9


@dataclass(frozen=True)
class RungeKutta45(UntilSteady):
    """Adaptive steps of order five with an embedded fourth order (Dormand & Prince 1980).

    The tables are interpolated within their steps and integration stops at every end of them, so no step
    straddles a jump. Contact changes are left to the error control, as in the papers.

    Parameters
    ----------
    relative, absolute : error allowed per step: relative, and of positions [m]
    tolerance, most, longest, averaged : see `wearlab.dynamics.orbits.integrate.UntilSteady`
    """

    relative: float = 1e-7
    absolute: float = 1e-14

    def integrator(self, system: System, tables: StageTables, period: float) -> OneState:
        """Return what integrates a system over mesh periods."""
        rows = np.empty((8, 2 * len(system.load)))
        return OneState(
            system, tables, period, AdaptiveMemory(rows, np.ones(1), self.relative, self.absolute)
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


def adaptive_step(memory: Any, kernel: Any, tables: Any, step: int, period: float, state: Any, s: Any) -> int:
    """Integrate over one step of the tables, in as many parts as tolerances ask for; count the evaluations.

    References
    ----------
    Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19–26.
    """
    slopes, trial, relative, absolute = memory.rows[:7], memory.rows[7], memory.relative, memory.absolute
    n = len(state) // 2
    width = tables.width[step] * period
    x, evaluations, size = 0.0, 0, memory.fraction[0]
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
            acceleration(kernel, tables, step, x + NODES[stage] * part, period, trial, s, slopes[stage, n:])
        evaluations += 7
        error = 0.0
        for row in range(2 * n):
            change = 0.0
            for stage in range(7):
                weight = WEIGHTS[6, stage] - FOURTH[stage]
                change += h * weight * slopes[stage, row]
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


STEPS[AdaptiveMemory] = adaptive_step

"""Adaptive steps of order five, the fourth embedded (Dormand & Prince 1980)."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.integrate import RK45

from wearlab.arrays import Array
from wearlab.compiled import jit_inner
from wearlab.dynamics.integrators.instant import acceleration
from wearlab.dynamics.integrators.kernel import write
from wearlab.dynamics.steady.until_steady import UntilSteady
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

NODES = np.append(RK45.C, 1.0)
WEIGHTS = np.zeros((7, 7))
WEIGHTS[:6, :5] = RK45.A
WEIGHTS[6, :6] = RK45.B
FOURTH = np.array(
    [5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40]
)
"""Weights of the embedded fourth order."""
MIN_FRACTION = 1e-9
"""Of a step of the tables, below which an error is accepted."""


@dataclass(frozen=True)
class RungeKutta45(UntilSteady):
    """Adaptive steps of order five, the fourth embedded (Dormand & Prince 1980).

    The tables are interpolated within their steps and integration stops at every end of
    them, so no step straddles a jump. Contact changes are left to the error control, as
    in the papers.

    Parameters
    ----------
    relative, absolute : error allowed per step: relative, and of positions [m]
    tolerance, max_periods, longest, averaged : see
        `wearlab.dynamics.steady.until_steady.UntilSteady`
    """

    relative: float = 1e-7
    absolute: float = 1e-14

    @classmethod
    def at_tolerance(cls, tolerance: float) -> Self:
        """Return the method of a scene.

        Parameters
        ----------
        tolerance : ``numerics.tolerance`` [1]
        """
        return cls(tolerance=1e-2 * tolerance)

    def memory(self, system: System, tables: StageTables) -> "AdaptiveMemory":
        """Return the memory of the steps."""
        return AdaptiveMemory(
            rows=np.empty((8, 2 * len(system.load))),
            fraction=np.ones(1),
            relative=self.relative,
            absolute=self.absolute,
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

    def advance(self, kernel: Any, step: int, state: Any) -> int:
        """Integrate over one step of the tables, in parts as tolerances ask for.

        Count the evaluations.

        Parameters
        ----------
        kernel, step : the system, and a step of its tables
        state : (2n,) at the start; at the end afterwards

        References
        ----------
        Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19–26.
        """
        trial = self.rows[7]
        width = kernel.flanks.tables.width[step] * kernel.flanks.period
        x = 0.0
        evaluations = 0
        size = self.fraction[0]
        while x < 1.0:
            size = max(MIN_FRACTION, size)
            part = 1.0 - x if x + size > 1.0 - 1e-12 else size
            _try_part(self.rows, kernel, step, x, part, state)
            evaluations += 7
            error = _error_of_part(self, part * width, width, state)
            factor = 5.0 if error == 0.0 else min(5.0, max(0.2, 0.9 * error**-0.2))
            if error <= 1.0 or part <= MIN_FRACTION:
                x = 1.0 if part == 1.0 - x else x + part
                write(trial, state)
                size = max(size, part * factor) if x == 1.0 else part * factor
            else:
                size = part * factor
        self.fraction[0] = min(size, 1.0)
        return evaluations


@jit_inner
def _try_part(
    rows: Any,
    kernel: Any,
    step: int,
    x: float,
    part: float,
    state: Any,
) -> None:
    """Write the slopes of the stages over a part of a step, and its end."""
    trial = rows[7]
    n = len(state) // 2
    h = part * (kernel.flanks.tables.width[step] * kernel.flanks.period)
    for stage in range(7):
        for row in range(2 * n):
            trial[row] = state[row]
            for earlier in range(stage):
                trial[row] += h * WEIGHTS[stage, earlier] * rows[earlier, row]
        write(trial[n:], rows[stage])
        acceleration(kernel, step, x + NODES[stage] * part, trial, rows[stage, n:])


@jit_inner
def _error_of_part(memory: Any, h: float, width: float, state: Any) -> float:
    """Return the largest difference of both orders over what is allowed."""
    slopes = memory.rows
    trial = memory.rows[7]
    n = len(state) // 2
    error = 0.0
    for row in range(2 * n):
        change = 0.0
        for stage in range(7):
            change += h * (WEIGHTS[6, stage] - FOURTH[stage]) * slopes[stage, row]
        allowed = memory.absolute * (1.0 if row < n else 1.0 / width)
        allowed += memory.relative * max(abs(state[row]), abs(trial[row]))
        error = max(error, abs(change) / allowed)
    return error

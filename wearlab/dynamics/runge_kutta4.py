"""The classical Runge–Kutta method, marched until steady."""

from dataclasses import dataclass

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.events import scratch
from wearlab.dynamics.march_kernel import march_periods
from wearlab.dynamics.period_map import LOCATED
from wearlab.dynamics.response import split_periods
from wearlab.dynamics.steady import Marching
from wearlab.dynamics.structure import in_registers, kernel_of, padded_width, tables_for, width_of
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables


@dataclass(frozen=True)
class RungeKutta4(Marching):
    """Fixed steps of order four on the tables, contact changes located (Kutta 1901); see `Marching`."""

    def marcher(self, system: System, tables: StageTables, period: float) -> "TableMarcher":
        """Return what integrates a system over mesh periods."""
        return TableMarcher(system, tables, period)


class TableMarcher:
    """Marches the tabulated map, the trajectory alone: by Runge–Kutta steps, or exactly where that pays."""

    def __init__(
        self,
        system: System,
        tables: StageTables,
        period: float,
        *,
        tangents: bool = False,
        exact: bool = False,
    ) -> None:
        """Prepare the memory.

        Parameters
        ----------
        system, tables, period : what to march
        tangents : states have columns for their tangents (in registers always: one compiled code)
        exact : large systems go by exact steps of their linear part, not by Runge–Kutta steps
        """
        self.tables, self.period = tables_for(system, tables), period
        n, (meshes, pairs) = len(system.load), self.tables.stiffness.shape[2:]
        columns = padded_width(n) if tangents or in_registers(system) else 1
        self.width = width_of(system, columns)
        self.kernel = kernel_of(system, pairs, columns, tables if exact else None, period)
        self.scratch = scratch(n, meshes, len(self.kernel.channels), pairs, columns)
        self.right_hand_sides, self.changes = 0, 0
        self.touch = LOCATED

    def march(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """March ``count`` periods and move ``state``; strobed states and the last ``keep`` periods."""
        steps, rows = len(self.tables.width), len(state)
        orbit, strobe = np.empty((keep * steps + 1) * rows), np.empty((count + 1, rows))
        states = np.empty((steps + 1) * rows * len(self.width))
        trajectory = np.uint64(1)
        self.changes += march_periods(
            self.kernel, self.tables, self.period, trajectory, self.width, state, keep, states, orbit, strobe,
            self.scratch, self.touch,
        )  # fmt: skip
        self.right_hand_sides += 4 * steps * count
        return strobe, split_periods(orbit.reshape(-1, rows), keep)

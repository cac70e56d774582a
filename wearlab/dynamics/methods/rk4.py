"""Fixed steps of order four on the tables, contact changes located (Kutta 1901)."""

from dataclasses import dataclass
from typing import Any, ClassVar

from wearlab.dynamics.integrators.kernel import Dense
from wearlab.dynamics.steady.until_steady import (
    STABILITY_OF_RK4,
    StabilityLimit,
    UntilSteady,
)
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables


@dataclass(frozen=True)
class RungeKutta4(UntilSteady):
    """Fixed steps of order four on the tables, contact changes located (Kutta 1901).

    See `UntilSteady`.
    """

    stability: ClassVar[StabilityLimit | None] = STABILITY_OF_RK4

    def memory(self, system: System, tables: StageTables) -> Any:
        """Return `Dense`: the Runge–Kutta steps of the kernel, which need no memory."""
        return Dense

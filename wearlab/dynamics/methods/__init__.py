"""Ways to find the steady response, one a file: ``dynamics.method`` names the file.

The ``METHOD`` of a file is a class with ``at_tolerance(tolerance)`` and
``solve(system, tables, period, start)``. `periodic` finds the orbit itself. The others
are methods of the papers: they integrate the equation of motion until it is steady and
do not follow changes of contact, but for `rk4`, which locates them. An integrator
derives from `wearlab.dynamics.steady.integrate.UntilSteady` and says one step.

Nothing else names a method: `names` reads the folder.
"""

from importlib import import_module
from pathlib import Path
from typing import ClassVar, Protocol, Self

from wearlab.dynamics.steady.integrate import StabilityLimit
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables


class IntegrationMethod(Protocol):
    """A way to find the steady response."""

    stability: ClassVar[StabilityLimit | None]
    """Of fixed steps on the tables; None: no limit."""
    exact_when_large: ClassVar[bool]
    """Whether systems too large for registers are advanced by exact steps."""

    @classmethod
    def at_tolerance(cls, tolerance: float) -> Self:
        """Return the method of a scene with this ``numerics.tolerance`` [1]."""
        ...

    def solve(
        self,
        system: System,
        tables: StageTables,
        period: float,
        start: Response | None = None,
    ) -> Response:
        """Return the steady response.

        Parameters
        ----------
        system : the equation of motion
        tables : the mesh at the stages
        period : duration of a mesh period [s]
        start : response of a neighbouring case to start from
        """
        ...


def method_named(name: str) -> type[IntegrationMethod]:
    """Return the method of a file in this folder.

    Parameters
    ----------
    name : of the file, without its ending
    """
    module = import_module(f"{__name__}.{name}")
    method: type[IntegrationMethod] = module.METHOD
    return method

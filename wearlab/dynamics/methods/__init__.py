"""Ways to find the steady response, one a file: ``dynamics.method`` names the file.

A file defines one class with ``at_tolerance(tolerance)`` and
``solve(system, tables, period, start)``, and is found by it; no list names it.
`periodic` finds the orbit itself. The others are methods of the papers: they integrate
the equation of motion until it is steady and do not follow changes of contact, but for
`rk4`, which locates them. Such an integrator derives from
`wearlab.dynamics.steady.until_steady.UntilSteady` and says one step.
"""

from importlib import import_module
from types import ModuleType
from typing import ClassVar, Protocol, Self

from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.steady.until_steady import StabilityLimit
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
    return method_of(import_module(f"{__name__}.{name}"))


def method_of(module: ModuleType) -> type[IntegrationMethod]:
    """Return the one method that a file defines, or imports if it defines none.

    Parameters
    ----------
    module : the imported file

    Raises
    ------
    TypeError
        When the file has no method, or several.
    """
    methods: list[type[IntegrationMethod]] = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and hasattr(value, "at_tolerance")
    ]
    defined = [method for method in methods if method.__module__ == module.__name__]
    chosen = defined or methods
    if len(chosen) != 1:
        raise TypeError(
            f"{module.__name__}: a file of a method defines one class with "
            f"at_tolerance and solve, this one has {len(chosen)}"
        )
    return chosen[0]

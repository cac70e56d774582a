"""Models of a pair: rotation, and translations along the line of action (L16).

Helical gears may move along z, too.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.dynamics.supports import Supports, TorsionalSupports, problems_of_pair

if TYPE_CHECKING:
    from wearlab.dynamics.system import System


class TorsionalDynamics(DynamicModel):
    """One degree of freedom along the line of action."""

    model: Literal["torsional"]
    """torsional pair, 1 DOF. Source: L16 Eqs. 3–4"""
    supports: TorsionalSupports = TorsionalSupports()
    """torsional supports, none by default"""

    def build(self, motion: InMotion) -> "System":
        """Return L16's torsional model."""
        from wearlab.dynamics.spur import paired, torsional

        return torsional(paired(self, motion))

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the supports."""
        return problems_of_pair(self, scene, bearings=False)


class Spur3dofDynamics(DynamicModel):
    """Rotation and both translations along the line of action."""

    model: Literal["spur-3dof"]
    """spur pair on bearings, 3 DOF. Source: L16 Eqs. 1–6"""
    supports: Supports
    """the bearings of both gears"""

    def build(self, motion: InMotion) -> "System":
        """Return L16's model with translations."""
        from wearlab.dynamics.spur import paired, spur_3dof

        return spur_3dof(paired(self, motion))

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the supports."""
        return problems_of_pair(self, scene, bearings=True)

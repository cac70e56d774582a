"""One degree of freedom along the line of action (L16)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

from wearlab.dynamics.models import DynamicModel, InMotion
from wearlab.dynamics.supports import TorsionalSupports, problems_of_pair
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.dynamics.system import System


class TorsionalDynamics(DynamicModel):
    """One degree of freedom along the line of action."""

    model: Literal["torsional"] = option(..., "torsional pair, 1 DOF", source="L16 Eqs. 3–4")
    supports: TorsionalSupports = option(TorsionalSupports(), "torsional supports, none by default")

    def build(self, motion: InMotion) -> "System":
        """Return L16's torsional model."""
        from wearlab.dynamics.spur import common_arguments, torsional

        return torsional(**common_arguments(self, motion))

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the supports."""
        return problems_of_pair(self, scene.gears.toothed, bearings=False)

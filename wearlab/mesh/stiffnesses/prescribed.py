"""What prescribed stiffnesses have in common."""

from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import Switch

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness


class PrescribedStiffness(StiffnessModel):
    """Any stiffness that is prescribed, of one pair or of the whole mesh."""

    prescribed: ClassVar[bool] = True
    usual_coupling: ClassVar[str] = "none"

    of: Literal["pair", "mesh"] = "pair"
    """whose stiffness it is: one pair's, or the whole mesh's"""
    follows_modulus: Switch = False
    """with [thermal]: it holds at the temperature of the surroundings, and falls as
    1/(1/E_1 + 1/E_2) does"""

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh."""
        return self.of == "mesh"

    def warm(
        self, pair: "GearPair", cold: "GearPair", grid: "profile.ProfileGrid"
    ) -> "PairStiffness":
        """Return the stiffness as stated, or as much softer as the materials are."""
        stated: Any = self.build(pair, grid)
        if not self.follows_modulus:
            return stated
        softness_now = sum(1.0 / gear.material.youngs_modulus for gear in pair.gears)
        softness = sum(1.0 / gear.material.youngs_modulus for gear in cold.gears)
        return stated.scaled(softness / softness_now)

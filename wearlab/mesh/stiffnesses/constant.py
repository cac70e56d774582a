"""A constant stiffness."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.stiffnesses.prescribed import PrescribedStiffness
from wearlab.options import POSITIVE, SpringRate

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness


class ConstantStiffness(PrescribedStiffness):
    """A constant stiffness, of each pair while in the path, or of the mesh."""

    model: Literal["constant"] = "constant"
    """constant stiffness. Source: wearlab"""
    value: Annotated[SpringRate, POSITIVE]
    """the stiffness"""

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return a pair stiffness of one value everywhere."""
        from wearlab.mesh.stiffness import GivenStiffness, constant

        return GivenStiffness(constant(self.value), self.of_mesh, grid)

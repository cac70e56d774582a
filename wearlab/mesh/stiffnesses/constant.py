"""A constant stiffness, of each pair while in the path, or of the mesh."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.stiffnesses import PrescribedStiffness
from wearlab.options import POSITIVE, SpringRate, option

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.pair_stiffness import PairStiffness
    from wearlab.mesh.profile import ProfileGrid


class ConstantStiffness(PrescribedStiffness):
    """A constant stiffness, of each pair while in the path, or of the mesh."""

    model: Literal["constant"] = option("constant", "constant stiffness", source="wearlab")
    value: Annotated[SpringRate, POSITIVE] = option(..., "the stiffness")

    def build(self, pair: "GearPair", grid: "ProfileGrid") -> "PairStiffness":
        """Return the same everywhere."""
        from wearlab.mesh.curve import constant
        from wearlab.mesh.stiffness import GivenStiffness

        return GivenStiffness(constant(self.value), self.of_mesh, grid)

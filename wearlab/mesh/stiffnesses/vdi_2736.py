"""The one stiffness that VDI 2736 gives every pair of teeth of plastic gears."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness


class Vdi2736Stiffness(StiffnessModel):
    """One pair along the whole path, by Young's moduli and face width alone."""

    usual_coupling: ClassVar[str] = "none"
    prescribed: ClassVar[bool] = True

    model: Literal["vdi-2736"] = "vdi-2736"
    """b/(7.5 (1/E_1 + 1/E_2)) at every place. Source: VDI 2736-2:2014, deformation of
    the tooth"""

    @property
    def model_error(self) -> str:
        """How far it is known to be off."""
        return (
            "VDI 2736's one number for all teeth and places, second-hand; finite "
            "elements differ by place and shape (campaigns/steel_on_pom.toml)"
        )

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the same stiffness at every node."""
        from wearlab.gears.vdi import pair_stiffness
        from wearlab.mesh.stiffness import EvenStiffness

        moduli = [gear.material.youngs_modulus for gear in pair.gears]
        return EvenStiffness(pair_stiffness(pair.face_width, moduli))

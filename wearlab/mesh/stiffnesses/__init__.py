"""``[mesh.stiffness]``: how stiff one tooth pair, or the mesh, is.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness


class StiffnessModel(Variant):
    """Any stiffness model: where it jumps, and its `PairStiffness` at nodes."""

    slot: ClassVar[Slot] = Slot("mesh.stiffness", __name__, default="finite-element")
    of_elements: ClassVar[bool] = False
    """Whether it comes from finite elements, which teeth of solid elements go with."""
    prescribed: ClassVar[bool] = False
    """Whether it is prescribed as a whole, with the contact."""
    usual_coupling: ClassVar[str] = "pasternak"
    """Name of the coupling along the face that a scene has when it names none."""

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh, which knows no pairs."""
        return False

    @property
    def turns_loads(self) -> bool:
        """Whether the slope of worn flanks turns the loads on teeth."""
        return False

    @property
    def model_error(self) -> str:
        """How far it is known to be off, and the source (docs/model_error.md)."""
        return "as prescribed; nothing here tells how far it is off"

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the stiffness of the mesh jumps [1].

        Phases where pairs enter or leave the path are known already.

        Parameters
        ----------
        pair : the gears in their operating position
        """
        return ()

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the stiffness of a pair at the nodes of its path.

        Parameters
        ----------
        pair : the gears in their operating position
        grid : the nodes
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def warm(
        self, pair: "GearPair", cold: "GearPair", grid: "profile.ProfileGrid"
    ) -> "PairStiffness":
        """Return the stiffness of a pair whose materials have softened.

        Parameters
        ----------
        pair : the gears with the moduli that they have now
        cold : the gears with those of the surroundings
        grid : the nodes
        """
        return self.build(pair, grid)

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return the notes that a run must bear about it.

        Parameters
        ----------
        pair : the gears in their operating position
        key : dotted key of the stiffness in the campaign file
        """
        scale = getattr(self, "scale", 1.0)
        return () if scale == 1.0 else (f"{key}.scale = {scale:g} is tuned",)

"""``[mesh.stiffness]``: how stiff one tooth pair, or the mesh, is, one model a file."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.options import option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.pair_stiffness import PairStiffness
    from wearlab.mesh.profile import ProfileGrid


class StiffnessModel(Variant):
    """Any stiffness model: where it jumps, and the `PairStiffness` at the nodes of a path."""

    slot: ClassVar[Slot] = Slot("mesh.stiffness", __name__)

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh, which knows no pairs."""
        return False

    @property
    def departure(self) -> str:
        """How far it is known to be off, with the source of that (docs/model_error.md)."""
        return "as prescribed; nothing here tells how far it is off"

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the stiffness of the mesh jumps besides those where pairs change [1]."""
        return ()

    def build(self, pair: "GearPair", grid: "ProfileGrid") -> "PairStiffness":
        """Return the stiffness of a pair at the nodes of its path.

        Parameters
        ----------
        pair : the gears in their operating position
        grid : the nodes
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return what a run must say of it, in words; ``key`` is where the campaign file says it."""
        scale = getattr(self, "scale", 1.0)
        return () if scale == 1.0 else (f"{key}.scale = {scale:g} is tuned",)


class PrescribedStiffness(StiffnessModel):
    """Any stiffness that is given, of one pair or of the whole mesh."""

    of: Literal["pair", "mesh"] = option("pair", "whose stiffness it is: one pair's, or the whole mesh's")

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh."""
        return self.of == "mesh"

"""``[mesh.excitation]``: how the mesh force reaches the dynamics, one model a file."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.mesh.excitation import Excitation

Combination = Literal["min", "max", "mean"]
Error = Literal["unloaded", "loaded"]
COMBINATION = "how the gaps of the pairs in the path make one transmission error"
ERROR = "transmission error that excites: unloaded, or loaded (counts F/k twice)"


class ExcitationModel(Variant):
    """Any excitation; ``by_pairs`` says whether pairs stay apart, which friction on flanks needs."""

    slot: ClassVar[Slot] = Slot("mesh.excitation", __name__)
    by_pairs: ClassVar[bool] = False

    def build(self) -> "Excitation":
        """Return what makes a mesh force of the contact analysis."""
        raise NotImplementedError(f"{type(self).__name__} has no build")

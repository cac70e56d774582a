"""Every pair a spring with its own gap: no truncation, nothing counted twice."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.excitations import ExcitationModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.mesh.excitation import Excitation


class PairsExcitation(ExcitationModel):
    """Every pair is a spring with its own gap: no truncation, nothing counted twice."""

    by_pairs: ClassVar[bool] = True

    model: Literal["pairs"] = option("pairs", "pair by pair", source="wearlab")

    def build(self) -> "Excitation":
        """Return pair by pair."""
        from wearlab.mesh.excitation import Pairs

        return Pairs()

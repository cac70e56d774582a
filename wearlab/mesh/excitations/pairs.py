"""The mesh force of pairs, each with its own gap."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.excitations import ExcitationModel

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis, Nodes


class PairsExcitation(ExcitationModel):
    """Every pair is a spring with its own gap: no truncation, nothing counted twice."""

    by_pairs: ClassVar[bool] = True

    model: Literal["pairs"] = "pairs"
    """pair by pair. Source: wearlab"""

    def prepare(self, analysis: "ContactAnalysis", nodes: "Nodes") -> None:
        """Return None: nothing is fitted, the tables come straight from the nodes."""

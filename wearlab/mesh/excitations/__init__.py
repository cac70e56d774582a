"""``[mesh.excitation]``: how the mesh force reaches the dynamics.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis, Nodes
    from wearlab.mesh.excitation import AlongPhase


class ExcitationModel(Variant):
    """Any excitation."""

    slot: ClassVar[Slot] = Slot("mesh.excitation", __name__, default="pairs")
    by_pairs: ClassVar[bool] = False
    """Whether every pair has a force of its own, which friction on flanks needs."""

    def build(self) -> "ExcitationModel":
        """Return what makes a mesh force of a contact analysis: by default self."""
        return self

    def prepare(
        self, analysis: "ContactAnalysis", nodes: "Nodes"
    ) -> "AlongPhase | None":
        """Return the series fitted to a wear state, None: forces are those of pairs.

        Parameters
        ----------
        analysis : the contact analysis of the mesh
        nodes : the wear state at its nodes
        """
        raise NotImplementedError(f"{type(self).__name__} has no prepare")

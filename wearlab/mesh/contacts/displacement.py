"""Worn flanks touch on the line of action: gaps are wear depths and modifications added up."""

from typing import TYPE_CHECKING, Literal

from wearlab.mesh.contacts import ContactModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class DisplacementContact(ContactModel):
    """Worn flanks touch on the line of action: gaps are wear depths and modifications added up."""

    model: Literal["displacement"] = option(
        "displacement", "first-order form of worn contact", source="wearlab"
    )

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return gaps of tip corners beyond A and E; within, the contact analysis adds depths up itself."""
        if not extended:
            return None
        from wearlab.mesh.exact.gaps import DisplacementBeyond

        return DisplacementBeyond(flanks)

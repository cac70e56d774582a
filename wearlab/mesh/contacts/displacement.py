"""Worn flanks touch on the line of action: gaps are wear depths and modifications added up."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.contacts import ContactModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class DisplacementContact(ContactModel):
    """Worn flanks touch on the line of action: gaps are wear depths and modifications added up."""

    departure: ClassVar[str] = (
        "first order in wear; the unloaded error of Y23's internal flanks is 13 to 63 % too large at 20 to "
        '100 um (mesh.contact = "exact" has no such error)'
    )

    model: Literal["displacement"] = option(
        "displacement", "first-order form of worn contact", source="wearlab"
    )

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return gaps of tip corners beyond A and E; within, the contact analysis adds depths up itself."""
        if not extended:
            return None
        from wearlab.mesh.exact.gaps import DisplacementBeyond

        return DisplacementBeyond(flanks)

"""Worn flanks touch on the line of action: the first-order form."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.contacts import ContactModel

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class DisplacementContact(ContactModel):
    """Worn flanks touch on the line of action: gaps are wear plus modifications."""

    along_line_of_action: ClassVar[bool] = True
    model_error: ClassVar[str] = (
        "first order in wear; the unloaded error of Y23's internal flanks is 13 to 63 "
        '% too large at 20 to 100 um (mesh.contact = "exact" has no such error); '
        "contacts move off slopes of wear to first order: lives to depths of 0.01 to "
        "0.1 modules of an external pair of steel are within 4 % of those of whole "
        "outlines. Without an elastic patch contacts stay, and lives to 0.01 modules "
        "are too short by a tenth, to 0.025 and more by a quarter"
    )

    model: Literal["displacement"] = "displacement"
    """first-order form of worn contact. Source: wearlab"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the gaps of tip corners beyond A and E, None without these.

        Between A and E the contact analysis itself adds the depths up.

        Parameters
        ----------
        flanks : makes worn flanks of wear depths at the nodes
        extended : whether tip corners touch beyond A and E
        """
        if not extended:
            return None
        from wearlab.mesh.exact.gaps import DisplacementBeyond

        return DisplacementBeyond(flanks)

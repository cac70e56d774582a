"""Worn flanks touch where they really meet."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.contacts import ContactModel

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ExactContact(ContactModel):
    """Worn flanks touch where they really meet, off the line of action."""

    pairs_corners: ClassVar[bool] = True
    model_error: ClassVar[str] = (
        "gaps are those of whole outlines, and wear goes to the points that touch: "
        "lives to depths of 0.01 to 0.1 modules of an external pair of steel are "
        "within 2 % of a brute force; pairs beyond A and E wear flanks with "
        "wear.beyond_path alone"
    )

    model: Literal["exact"] = "exact"
    """smallest rotation gap of the worn flanks. Source: Y23"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the smallest rotation gaps, whatever ``extended`` is."""
        from wearlab.mesh.exact.gaps import MeetingGaps

        return MeetingGaps(flanks)

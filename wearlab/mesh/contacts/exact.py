"""Worn flanks touch where they really meet."""

from typing import TYPE_CHECKING, Literal

from wearlab.mesh.contacts import ContactModel

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ExactContact(ContactModel):
    """Worn flanks touch where they really meet, off the line of action."""

    model: Literal["exact"] = "exact"
    """smallest rotation gap of the worn flanks. Source: Y23"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the smallest rotation gaps, whatever ``extended`` is."""
        from wearlab.mesh.exact.gaps import MeetingGaps

        return MeetingGaps(flanks)

"""Worn flanks touch where they really meet, off the line of action."""

from typing import TYPE_CHECKING, Literal

from wearlab.mesh.contacts import ContactModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ExactContact(ContactModel):
    """Worn flanks touch where they really meet, off the line of action."""

    model: Literal["exact"] = option("exact", "smallest rotation gap of the worn flanks", source="Y23")

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the smallest rotation gaps."""
        from wearlab.mesh.exact.gaps import ExactGaps

        return ExactGaps(flanks)

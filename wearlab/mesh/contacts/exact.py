"""Worn flanks touch where they really meet."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.contacts import ContactModel

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ExactContact(ContactModel):
    """Worn flanks touch where they really meet, off the line of action."""

    model_error: ClassVar[str] = (
        "gaps are exact, but wear is given to the point of the unworn path, not to the "
        "points that touch: lives to depths beyond 0.01 modules are too short, those "
        "of an external pair of steel by a third at 0.025 modules, by half at 0.05 "
        "and by 57 % at 0.1"
    )

    model: Literal["exact"] = "exact"
    """smallest rotation gap of the worn flanks. Source: Y23"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the smallest rotation gaps, whatever ``extended`` is."""
        from wearlab.mesh.exact.gaps import MeetingGaps

        return MeetingGaps(flanks)

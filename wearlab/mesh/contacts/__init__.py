"""``[mesh.contact]``: where the gaps of worn flanks come from."""

from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge

from wearlab.options import POSITIVE, Angle, Count
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ContactModel(Variant):
    """Any contact of worn flanks.

    ``tip_corners`` says whether it knows what touches beyond A and E.
    """

    slot: ClassVar[Slot] = Slot("mesh.contact", __name__, default="displacement")
    tip_corners: ClassVar[bool] = True
    model_error: ClassVar[str] = ""
    """How far its gaps are known to be off, with the source of that; "": they are
    not."""

    engagement: Literal["load", "threshold"] = "load"
    """pairs in contact: those that carry load, or those closer than a threshold.
    Source: Y23"""
    threshold: Annotated[Angle, POSITIVE] = 1e-4
    """rotation of the driven gear within which a pair counts as engaged. Source: Y23
    Algorithm 1"""

    @property
    def by_threshold(self) -> bool:
        """Whether pairs closer than a threshold are engaged, loaded or not."""
        return self.engagement == "threshold"

    def engagement_gap(self, pair: "GearPair") -> float:
        """Return the gap beyond the smallest at which a pair no longer engages, infinite by load [m]."""
        return (
            self.threshold * pair.driven.base_radius
            if self.by_threshold
            else float("inf")
        )

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return where the gaps come from, None for the displacement form on A–E.

        Parameters
        ----------
        flanks : what makes worn flanks of wear depths at the nodes
        extended : whether tip corners touch beyond A and E
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def flags(self) -> tuple[str, ...]:
        """Return what a run must say of it, in words."""
        return ()


class DisplacementContact(ContactModel):
    """Worn flanks touch on the line of action: gaps are wear depths and modifications added up."""

    model_error: ClassVar[str] = (
        "first order in wear; the unloaded error of Y23's internal flanks is 13 to 63 "
        "% too large at 20 to "
        '100 um (mesh.contact = "exact" has no such error)'
    )

    model: Literal["displacement"] = "displacement"
    """first-order form of worn contact. Source: wearlab"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return gaps of tip corners beyond A and E.

        Within, the contact analysis adds depths up itself.
        """
        if not extended:
            return None
        from wearlab.mesh.exact.gaps import DisplacementBeyond

        return DisplacementBeyond(flanks)


class ExactContact(ContactModel):
    """Worn flanks touch where they really meet, off the line of action."""

    model: Literal["exact"] = "exact"
    """smallest rotation gap of the worn flanks. Source: Y23"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the smallest rotation gaps."""
        from wearlab.mesh.exact.gaps import MeetingGaps

        return MeetingGaps(flanks)


class AlgorithmOneContact(ContactModel):
    """Y23's own search of one flank's points against the other's, half a step of it off (as published)."""

    tip_corners: ClassVar[bool] = False

    model: Literal["algorithm-1"] = "algorithm-1"
    """Y23's search. Source: Y23 Algorithm 1"""
    points: Annotated[Count, Ge(9)] = 1849
    """points searched on each flank. Source: Y23 Table 1"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the gaps that the search finds."""
        from wearlab.mesh.exact.gaps import MeetingGaps, searched

        return MeetingGaps(flanks, partial(searched, flanks.pair, self.points))

    def flags(self) -> tuple[str, ...]:
        """Return by how much it errs."""
        return (
            f"contact by Algorithm 1: errors are half a step of {self.points} points "
            "off",
        )

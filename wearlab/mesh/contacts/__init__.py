"""``[mesh.contact]``: where the gaps of worn flanks come from.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.options import POSITIVE, Angle
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ContactModel(Variant):
    """Any contact of worn flanks."""

    slot: ClassVar[Slot] = Slot("mesh.contact", __name__, default="displacement")
    tip_corners: ClassVar[bool] = True
    """Whether it knows what touches beyond A and E."""
    pairs_corners: ClassVar[bool] = False
    """Whether it tells which points of both flanks meet there."""
    along_line_of_action: ClassVar[bool] = False
    """Whether flanks meet on the line of action, as flanks with a width must."""
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
        """Return the largest difference of an engaged pair's gap to the smallest [m].

        Infinite where the load decides which pairs engage.

        Parameters
        ----------
        pair : the gears in their operating position
        """
        if not self.by_threshold:
            return float("inf")
        return self.threshold * pair.driven.base_radius

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the source of the gaps, None for the displacement form on A–E.

        Parameters
        ----------
        flanks : makes worn flanks of wear depths at the nodes
        extended : whether tip corners touch beyond A and E
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def flags(self) -> tuple[str, ...]:
        """Return the notes that a run must bear about it."""
        return ()

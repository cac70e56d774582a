"""``[mesh.contact]``: where the gaps of worn flanks come from, one model a file."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.options import POSITIVE, Angle, option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class ContactModel(Variant):
    """Any contact of worn flanks; ``tip_corners`` says whether it knows what touches beyond A and E."""

    slot: ClassVar[Slot] = Slot("mesh.contact", __name__)
    tip_corners: ClassVar[bool] = True
    departure: ClassVar[str] = ""
    """How far its gaps are known to be off, with the source of that; "": they are not."""

    engagement: Literal["load", "threshold"] = option(
        "load", "pairs in contact: those that carry load, or those closer than a threshold", source="Y23"
    )
    threshold: Annotated[Angle, POSITIVE] = option(
        1e-4,
        "rotation of the driven gear within which a pair counts as engaged",
        source="Y23 Algorithm 1",
    )

    @property
    def by_threshold(self) -> bool:
        """Whether pairs closer than a threshold are engaged, loaded or not."""
        return self.engagement == "threshold"

    def engagement_gap(self, pair: "GearPair") -> float:
        """Return the gap beyond the smallest at which a pair no longer engages, infinite by load [m]."""
        return self.threshold * pair.driven.base_radius if self.by_threshold else float("inf")

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

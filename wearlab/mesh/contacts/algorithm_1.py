"""Y23's own search of one flank's points against the other's, half a step of it off (as published)."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge

from wearlab.mesh.contacts import ContactModel
from wearlab.options import Count, option

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class AlgorithmOneContact(ContactModel):
    """Y23's own search of one flank's points against the other's, half a step of it off (as published)."""

    tip_corners: ClassVar[bool] = False

    model: Literal["algorithm-1"] = option("algorithm-1", "Y23's search", source="Y23 Algorithm 1")
    points: Annotated[Count, Ge(9)] = option(1849, "points searched on each flank", source="Y23 Table 1")

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the gaps that the search finds."""
        from wearlab.mesh.exact.gaps import AlgorithmOneGaps

        return AlgorithmOneGaps(flanks, self.points)

    def flags(self) -> tuple[str, ...]:
        """Return by how much it errs."""
        return (f"contact by Algorithm 1: errors are half a step of {self.points} points off",)

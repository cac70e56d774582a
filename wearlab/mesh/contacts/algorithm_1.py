"""Worn flanks touch where Y23's Algorithm 1 finds them."""

from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge

from wearlab.mesh.contacts import ContactModel
from wearlab.options import Count

if TYPE_CHECKING:
    from wearlab.mesh.exact.gaps import Gaps, WornFlanks


class AlgorithmOneContact(ContactModel):
    """Y23's own search among the points of both flanks, as published.

    Its gaps are half a step of its points off.
    """

    tip_corners: ClassVar[bool] = False

    model: Literal["algorithm-1"] = "algorithm-1"
    """Y23's search. Source: Y23 Algorithm 1"""
    points: Annotated[Count, Ge(9)] = 1849
    """points searched on each flank. Source: Y23 Table 1"""

    def build(self, flanks: "WornFlanks", extended: bool) -> "Gaps | None":
        """Return the gaps that the search finds, whatever ``extended`` is."""
        from wearlab.mesh.exact.gaps import MeetingGaps, searched

        find = partial(searched, flanks.pair, self.points)
        return MeetingGaps(flanks, find, wears_there=False)

    def flags(self) -> tuple[str, ...]:
        """Return a note on the error of the search."""
        return (
            "contact by Algorithm 1: errors are half a step of "
            f"{self.points} points off",
        )

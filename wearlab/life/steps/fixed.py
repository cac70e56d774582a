"""Equal explicit steps over cycles."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Discriminator, Tag

from wearlab.life.steps import StepMethod
from wearlab.options import POSITIVE, Number, Part

if TYPE_CHECKING:
    from wearlab.life.euler import Fixed


Positive = Annotated[Number, POSITIVE]


class StabilitySize(Part):
    """A step as a fraction of the stability limit."""

    stability: Positive
    """fraction of the stability limit. Source: wearlab"""


def _kind_of_size(value: Any) -> str:
    """Return the tag of a size: share of the stability limit, or count of cycles."""
    return "fraction" if isinstance(value, dict | StabilitySize) else "count"


class FixedStep(StepMethod):
    """Equal explicit steps."""

    method: Literal["fixed"] = "fixed"
    """equal steps over cycles. Source: wearlab"""
    size: Annotated[
        Annotated[Positive, Tag("count")] | Annotated[StabilitySize, Tag("fraction")],
        Discriminator(_kind_of_size),
    ]
    """cycles per step, or {stability = 0.9} of the limit"""

    def build(self) -> "Fixed":
        """Return equal steps."""
        from wearlab.life.euler import Fixed

        if isinstance(self.size, StabilitySize):
            return Fixed(stability=self.size.stability)
        return Fixed(size=self.size)

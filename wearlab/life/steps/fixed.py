"""Equal explicit steps, of so many cycles or of a fraction of the stability limit."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Discriminator, Tag

from wearlab.life.steps import StepMethod
from wearlab.options import POSITIVE, Number, Part, option

if TYPE_CHECKING:
    from wearlab.life.march import Method

Positive = Annotated[Number, POSITIVE]


class StabilitySize(Part):
    """A step as a fraction of the stability limit."""

    stability: Positive = option(..., "fraction of the stability limit", source="wearlab")


def _size(value: Any) -> str:
    return "fraction" if isinstance(value, dict | StabilitySize) else "count"


class FixedStep(StepMethod):
    """Equal explicit steps."""

    method: Literal["fixed"] = option("fixed", "equal steps over cycles", source="wearlab")
    size: Annotated[
        Annotated[Positive, Tag("count")] | Annotated[StabilitySize, Tag("fraction")], Discriminator(_size)
    ] = option(..., "cycles per step, or {stability = 0.9} of the limit")

    def build(self) -> "Method":
        """Return equal steps."""
        from wearlab.life.euler import Fixed

        if isinstance(self.size, StabilitySize):
            return Fixed(stability=self.size.stability)
        return Fixed(size=self.size)

"""Explicit Euler, a step as long as the wear takes to grow by a threshold (as published)."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.life.steps import StepMethod
from wearlab.options import POSITIVE, Depth, option

if TYPE_CHECKING:
    from wearlab.life.march import Method


class EulerStep(StepMethod):
    """Explicit Euler, a step as long as the wear takes to grow by a threshold (as published)."""

    method: Literal["euler"] = option("euler", "the papers' Euler steps", source="L16 Fig. 2")
    threshold: Annotated[Depth, POSITIVE] = option(..., "wear per step, ε^q", source="L16 Eq. 21")

    def build(self) -> "Method":
        """Return L16's method."""
        from wearlab.life.euler import Euler

        return Euler(self.threshold)

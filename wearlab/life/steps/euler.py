"""Euler's method over cycles; in a step the wear grows by a threshold."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.life.steps import StepMethod
from wearlab.options import POSITIVE, Depth

if TYPE_CHECKING:
    from wearlab.life.euler import Euler


class EulerStep(StepMethod):
    """Explicit Euler; in a step the wear grows by a threshold (as published)."""

    method: Literal["euler"] = "euler"
    """the papers' Euler steps. Source: L16 Fig. 2"""
    threshold: Annotated[Depth, POSITIVE]
    """wear per step, ε^q. Source: L16 Eq. 21"""

    def build(self) -> "Euler":
        """Return L16's method."""
        from wearlab.life.euler import Euler

        return Euler(self.threshold)

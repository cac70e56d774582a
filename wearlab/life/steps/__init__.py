"""``[wear.step]``: how the wear is stepped over cycles.

A file beside this one adds another method.
"""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Tag

from wearlab.options import POSITIVE, Depth, Number, Part
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.life.integrate import Method

Positive = Annotated[Number, POSITIVE]


class StepMethod(Variant):
    """Any way to step the wear over cycles."""

    slot: ClassVar[Slot] = Slot("wear.step", __name__, "method", default="adaptive")
    chooser: ClassVar[str] = "method"

    def build(self) -> "Method":
        """Return the method."""
        raise NotImplementedError(f"{type(self).__name__} has no build")


class AdaptiveStep(StepMethod):
    """Steps as long as error and stability allow."""

    method: Literal["adaptive"] = "adaptive"
    """adaptive steps over cycles. Source: wearlab"""

    def build(self) -> "Method":
        """Return the adaptive method."""
        from wearlab.life.adaptive import Adaptive

        return Adaptive()


class EulerStep(StepMethod):
    """Explicit Euler, a step as long as the wear takes to grow by a threshold (as published)."""

    method: Literal["euler"] = "euler"
    """the papers' Euler steps. Source: L16 Fig. 2"""
    threshold: Annotated[Depth, POSITIVE]
    """wear per step, ε^q. Source: L16 Eq. 21"""

    def build(self) -> "Method":
        """Return L16's method."""
        from wearlab.life.adaptive import Euler

        return Euler(self.threshold)


class StabilitySize(Part):
    """A step as a fraction of the stability limit."""

    stability: Positive
    """fraction of the stability limit. Source: wearlab"""


def _size(value: Any) -> str:
    return "fraction" if isinstance(value, dict | StabilitySize) else "count"


class FixedStep(StepMethod):
    """Equal explicit steps."""

    method: Literal["fixed"] = "fixed"
    """equal steps over cycles. Source: wearlab"""
    size: Annotated[
        Annotated[Positive, Tag("count")] | Annotated[StabilitySize, Tag("fraction")],
        Discriminator(_size),
    ]
    """cycles per step, or {stability = 0.9} of the limit"""

    def build(self) -> "Method":
        """Return equal steps."""
        from wearlab.life.adaptive import Fixed

        if isinstance(self.size, StabilitySize):
            return Fixed(stability=self.size.stability)
        return Fixed(size=self.size)

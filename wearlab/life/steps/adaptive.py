"""Steps with an error estimate and a stability bound."""

from typing import TYPE_CHECKING, Literal

from wearlab.life.steps import StepMethod
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.life.march import Method


class AdaptiveStep(StepMethod):
    """Steps as long as error and stability allow."""

    method: Literal["adaptive"] = option("adaptive", "adaptive steps over cycles", source="wearlab")

    def build(self) -> "Method":
        """Return the adaptive method."""
        from wearlab.life.adaptive import Adaptive

        return Adaptive()

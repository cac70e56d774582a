"""Steps over cycles as long as error and stability allow."""

from typing import TYPE_CHECKING, Literal

from wearlab.life.steps import StepMethod

if TYPE_CHECKING:
    from wearlab.life.adaptive import Adaptive


class AdaptiveStep(StepMethod):
    """Steps as long as error and stability allow."""

    method: Literal["adaptive"] = "adaptive"
    """adaptive steps over cycles. Source: wearlab"""

    def build(self) -> "Adaptive":
        """Return the adaptive method."""
        from wearlab.life.adaptive import Adaptive

        return Adaptive()

"""A wear coefficient that depends on pressure: mild wear below a pressure, severe wear above.

``k = k_mild + (k_severe − k_mild) / (1 + (p_0/p)^m)``: a smooth step at the transition pressure p_0.
"""

from typing import Annotated, Literal

from wearlab.options import NOT_NEGATIVE, POSITIVE, Number, Pressure, WearCoefficient
from wearlab.wear.coefficients import CoefficientModel


class MildToSevere(CoefficientModel):
    """A wear coefficient that rises where the pressure passes a transition."""

    model: Literal["mild-to-severe"] = "mild-to-severe"
    """a step of k over pressure. Source: a user"""
    mild: Annotated[WearCoefficient, NOT_NEGATIVE]
    """k at low pressure"""
    severe: Annotated[WearCoefficient, NOT_NEGATIVE]
    """k at high pressure"""
    transition: Annotated[Pressure, POSITIVE]
    """pressure p_0 halfway between both"""
    steepness: Annotated[Number, POSITIVE] = 8.0
    """exponent m of the step"""

    def build(self, setting):
        """Return k of a flank's state [m²/N]."""
        mild, severe, transition, steepness = self.mild, self.severe, self.transition, self.steepness

        def coefficient(state):
            share = state.pressure**steepness
            return mild + (severe - mild) * share / (share + transition**steepness)

        return coefficient

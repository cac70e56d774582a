"""Friction by the forces of each wear state, heat transfer by VDI 2736."""

from typing import ClassVar, Literal

from wearlab.thermal.models import ThermalModel


class ComputedLoss(ThermalModel):
    """Loss of each wear state from the forces and the sliding of all pairs."""

    model_error: ClassVar[str] = (
        "a fitted guideline's (VDI 2736-2, second-hand): one steady number for each "
        "gear, its two gears exchange no heat; of S30, a published pair of POM, it "
        "gives a flank of 227 to 244 degC, above its melting point; the loss it starts "
        "from is that of the forces of each wear state"
    )

    model: Literal["computed-loss"] = "computed-loss"
    """loss from the forces of each wear state, pairs beyond A and E included. Source:
    wearlab; heat transfer VDI 2736-2"""

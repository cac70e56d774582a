"""Friction and heat transfer by VDI 2736: one temperature for the whole life."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.thermal.models import ThermalModel

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair


class Vdi2736Temperature(ThermalModel):
    """The guideline as it is: its loss factor knows the unworn gears alone."""

    model_error: ClassVar[str] = (
        "a fitted guideline's (VDI 2736-2, second-hand): one steady number for each "
        "gear and the whole life, whatever wears; of S30, a published pair of POM, it "
        "gives a flank of 244 degC, above its melting point"
    )

    model: Literal["vdi-2736"]
    """H_V of equal shares on unworn flanks. Source: VDI 2736-2:2014, second-hand"""

    def fixed_loss_factor(self, pair: "GearPair") -> float:
        """Return the guideline's degree of tooth loss H_V [1]."""
        from wearlab.gears.vdi import loss_factor

        return loss_factor(pair)

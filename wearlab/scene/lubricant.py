"""``[lubricant]``: the oil at the temperature of the contact."""

from typing import Annotated

from wearlab.options import POSITIVE, Part, PressureViscosity, Viscosity, option


class Lubricant(Part):
    """Viscosity and its growth with pressure."""

    viscosity: Annotated[Viscosity, POSITIVE] = option(
        ..., "dynamic viscosity η0 at ambient pressure", source="Dowson & Higginson 1966"
    )
    pressure_viscosity: Annotated[PressureViscosity, POSITIVE] = option(
        ..., "pressure-viscosity coefficient α", source="Dowson & Higginson 1966, W23 Eq. 42"
    )

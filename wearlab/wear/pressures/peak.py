"""The pressure in the middle of the contact."""

from math import pi
from typing import ClassVar, Literal

from wearlab.wear.pressures import PressureModel


class PeakPressure(PressureModel):
    """The pressure in the middle of the contact."""

    factor: ClassVar[float] = 4.0 / pi

    model: Literal["peak"] = "peak"
    """peak Hertz pressure. Source: Johnson 1985"""

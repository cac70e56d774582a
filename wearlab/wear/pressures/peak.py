"""The peak of Hertz's ellipse of pressure, ``4/π`` times its mean."""

from math import pi
from typing import ClassVar, Literal

from wearlab.options import option
from wearlab.wear.pressures import PressureModel


class PeakPressure(PressureModel):
    """The pressure in the middle of the contact."""

    factor: ClassVar[float] = 4.0 / pi

    model: Literal["peak"] = option("peak", "peak Hertz pressure", source="Johnson 1985")

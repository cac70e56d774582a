"""The mean pressure of a line contact, F/(2aB): with it the width of contact cancels in Archard's law."""

from typing import ClassVar, Literal

from wearlab.options import option
from wearlab.wear.pressures import PressureModel


class MeanPressure(PressureModel):
    """The mean over the width of contact."""

    factor: ClassVar[float] = 1.0

    model: Literal["mean"] = option("mean", "mean Hertz pressure", source="Archard 1953")

"""The mean pressure over the width of contact."""

from typing import ClassVar, Literal

from wearlab.wear.pressures import PressureModel


class MeanPressure(PressureModel):
    """The mean over the width of contact."""

    factor: ClassVar[float] = 1.0

    model: Literal["mean"] = "mean"
    """mean Hertz pressure. Source: Archard 1953"""

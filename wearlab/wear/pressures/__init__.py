"""``wear.pressure``: which pressure of a line contact wears.

A file beside this one adds another.
"""

from math import pi
from typing import ClassVar, Literal

from wearlab.options import option
from wearlab.slots import Slot, Variant


class PressureModel(Variant):
    """Any pressure of Hertz's ellipse; ``factor`` is its ratio to the mean pressure [1]."""

    slot: ClassVar[Slot] = Slot("wear.pressure", __name__, by_name=True)
    factor: ClassVar[float]


class MeanPressure(PressureModel):
    """The mean over the width of contact."""

    factor: ClassVar[float] = 1.0

    model: Literal["mean"] = option("mean", "mean Hertz pressure", source="Archard 1953")


class PeakPressure(PressureModel):
    """The pressure in the middle of the contact."""

    factor: ClassVar[float] = 4.0 / pi

    model: Literal["peak"] = option("peak", "peak Hertz pressure", source="Johnson 1985")

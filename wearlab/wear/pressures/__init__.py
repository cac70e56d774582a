"""``wear.pressure``: which pressure of a line contact wears.

A file beside this one adds another.
"""

from math import pi
from typing import ClassVar, Literal

from wearlab.slots import Slot, Variant


class PressureModel(Variant):
    """Any pressure of Hertz's ellipse.

    ``factor`` is its ratio to the mean pressure [1].
    """

    slot: ClassVar[Slot] = Slot("wear.pressure", __name__, default="mean", by_name=True)
    factor: ClassVar[float]


class MeanPressure(PressureModel):
    """The mean over the width of contact."""

    factor: ClassVar[float] = 1.0

    model: Literal["mean"] = "mean"
    """mean Hertz pressure. Source: Archard 1953"""


class PeakPressure(PressureModel):
    """The pressure in the middle of the contact."""

    factor: ClassVar[float] = 4.0 / pi

    model: Literal["peak"] = "peak"
    """peak Hertz pressure. Source: Johnson 1985"""

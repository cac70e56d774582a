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

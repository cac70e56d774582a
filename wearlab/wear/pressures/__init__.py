"""``wear.pressure``: which pressure of a line contact wears, one variant a file."""

from typing import ClassVar

from wearlab.slots import Slot, Variant


class PressureModel(Variant):
    """Any pressure of Hertz's ellipse; ``factor`` is its ratio to the mean pressure [1]."""

    slot: ClassVar[Slot] = Slot("wear.pressure", __name__, words=True)
    factor: ClassVar[float]

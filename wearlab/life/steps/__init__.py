"""``[wear.step]``: how the wear is stepped over cycles.

A file beside this one adds another method.
"""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.life.step import Method


class StepMethod(Variant):
    """Any way to step the wear over cycles."""

    slot: ClassVar[Slot] = Slot("wear.step", __name__, "method", default="adaptive")
    chooser: ClassVar[str] = "method"

    def build(self) -> "Method":
        """Return the method: a :class:`wearlab.life.step.Method`."""
        raise NotImplementedError(f"{type(self).__name__} has no build")

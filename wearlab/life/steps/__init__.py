"""``[wear.step]``: how the wear is stepped over cycles, one method a file."""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.life.march import Method


class StepMethod(Variant):
    """Any way to step the wear over cycles."""

    slot: ClassVar[Slot] = Slot("wear.step", __name__, "method")
    chooser: ClassVar[str] = "method"

    def build(self) -> "Method":
        """Return the method."""
        raise NotImplementedError(f"{type(self).__name__} has no build")

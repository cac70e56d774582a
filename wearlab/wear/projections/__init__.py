"""``wear.projection``: along which direction the depth of wear is counted, one variant a file."""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.wear.path import WearPath


class ProjectionModel(Variant):
    """Any direction of the depth."""

    slot: ClassVar[Slot] = Slot("wear.projection", __name__, words=True)

    def factor(self, path: "WearPath") -> "Array":
        """Return the depth over that along the flank normal, (2, n) [1]."""
        raise NotImplementedError(f"{type(self).__name__} has no factor")

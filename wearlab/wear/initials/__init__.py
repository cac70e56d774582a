"""``wear.initial.<flank>``: wear before the first cycle, one variant a file."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.options import NOT_NEGATIVE, Alternatives, Depth, option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.gears.pair import GearPair


class InitialModel(Variant):
    """Any wear of one gear's flanks before the first cycle.

    ``by_law`` says that the wear law of the scene makes it, so that only a run finds out its course.
    """

    slot: ClassVar[Slot] = Slot("wear.initial", __name__, "shape")
    chooser: ClassVar[str] = "shape"
    keeps_table: ClassVar[bool] = True
    by_law: ClassVar[bool] = False

    sides: Literal["drive", "both"] = option("drive", "which flanks of each tooth carry it")

    def flags(self, flank: str) -> Iterator[str]:
        """Yield what a run must say of it, in words."""
        if self.sides == "both":
            yield "initial wear of back flanks is not part of the back contact"

    def at_nodes(self, pair: "GearPair", gear: int, position: "Array") -> "Array":
        """Return its depth along the flank normal, (n,) [m].

        Parameters
        ----------
        pair, gear : the gears; 0 driving, 1 driven
        position : (n,) path positions of the nodes, A to E [m]

        Raises
        ------
        GearError
            When the gears cannot have it.
        """
        raise NotImplementedError(f"{type(self).__name__} has no at_nodes")


class ShapedWear(InitialModel):
    """Wear of a given depth, whatever its shape."""

    alternatives: ClassVar[Alternatives] = (
        (
            ("depth", "shape"),
            ("file", "x", "y", "direction", "units", "columns", "zero", "smooth", "continuation"),
        ),
    )

    depth: Annotated[Depth, NOT_NEGATIVE] = option(..., "largest depth of the initial wear", source="W23")

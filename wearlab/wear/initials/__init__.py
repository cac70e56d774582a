"""``wear.initial.<flank>``: wear before the first cycle.

A file beside this one adds another.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ConfigDict, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from wearlab import arrays
from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Count,
    Depth,
    Length,
    Part,
    option,
)
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.gears.helix import SlicedFlank
    from wearlab.wear.measured_profile import MeasuredProfile


Array = arrays.Array


class InitialModel(Variant):
    """Any wear of one gear's flanks before the first cycle.

    ``by_law`` says that the wear law of the scene makes it, so that only a run finds
    out its course.
    """

    slot: ClassVar[Slot] = Slot("wear.initial", __name__, "shape", default="worn")
    chooser: ClassVar[str] = "shape"
    keeps_table: ClassVar[bool] = True
    by_law: ClassVar[bool] = False

    sides: Literal["drive", "both"] = "drive"
    """which flanks of each tooth carry it; wear of both thins its section. Source:
    Y23"""
    planet: Annotated[Count, POSITIVE] | None = option(None)
    """number of the one planet whose flanks carry it, from 1; the others are new [all
    planets]. Source: wearlab"""

    @property
    def thins_teeth(self) -> bool:
        """Whether the back flanks carry it, and its course is known before a run."""
        return self.sides == "both" and not self.by_law

    def flags(self, flank: str) -> Iterator[str]:
        """Yield what a run must say of it, in words."""
        if self.sides == "both":
            yield "initial wear of back flanks is not part of the back contact"
            if self.by_law:
                remark = (
                    "back flanks worn by the wear law do not thin the teeth; give a "
                    "shape or a file"
                )
                yield f"wear.initial.{flank}: {remark}"

    def at_nodes(self, pair: "GearPair", gear: int, position: Array) -> Array:
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

    def over_face(
        self, pair: "GearPair", gear: int, position: Array, flank: "SlicedFlank"
    ) -> Array:
        """Return its depth along the normal at all slices of a face, (n_face, n) [m].

        Parameters
        ----------
        pair, gear, position : as of `at_nodes`
        flank : the slices
        """
        depth = self.at_nodes(pair, gear, position)
        return np.broadcast_to(depth, (len(flank.position), len(depth)))


OF_FILES = (
    "file",
    "sheet",
    "decimal",
    "x",
    "y",
    "direction",
    "units",
    "columns",
    "zero",
    "smooth",
    "continuation",
)


class ShapedWear(InitialModel):
    """Wear of a given depth, whatever its shape."""

    alternatives: ClassVar[Alternatives] = ((("depth", "shape"), OF_FILES),)

    depth: Annotated[Depth, NOT_NEGATIVE]
    """largest depth of the initial wear. Source: W23"""

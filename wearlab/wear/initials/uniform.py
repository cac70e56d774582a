"""The same initial wear everywhere."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.options import option
from wearlab.wear.initials import ShapedWear

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.gears.pair import GearPair


class UniformWear(ShapedWear):
    """The same depth everywhere."""

    shape: Literal["uniform"] = option("uniform", "the same everywhere", source="W23")

    def at_nodes(self, pair: "GearPair", gear: int, position: "Array") -> "Array":
        """Return the depth, (n,) [m]."""
        return np.full(np.shape(position), self.depth)

"""Initial wear of the same depth everywhere."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.wear.initials import ShapedWear

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair


class UniformWear(ShapedWear):
    """The same depth everywhere."""

    shape: Literal["uniform"] = "uniform"
    """the same everywhere. Source: W23"""

    def at_nodes(self, pair: "GearPair", gear: int, position: Array) -> Array:
        """Return the depth, (n,) [m]."""
        return np.full(np.shape(position), self.depth)

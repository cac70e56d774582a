"""Initial wear that grows with the square of the distance from the pitch point."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.wear.initials import ShapedWear

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair


class QuadraticWear(ShapedWear):
    """``depth (s/s_far)²``: zero at the pitch point, ``depth`` at the far end."""

    shape: Literal["quadratic"] = "quadratic"
    """depth·(s/s_far)² from the pitch point. Source: W23"""

    def at_nodes(self, pair: "GearPair", gear: int, position: Array) -> Array:
        """Return ``depth (s/s_far)²``, s_far the end farther from the pitch point."""
        return quadratic(position, self.depth)


def quadratic(position: Array, depth: float) -> Array:
    """Return ``depth (s/s_far)²`` at path positions (n,) from end to end, (n,) [m].

    Parameters
    ----------
    position : (n,) on the path [m]
    depth : at the far end [m]
    """
    return np.asarray(depth * (position / np.abs(position).max()) ** 2)

"""``wear.projection``: along which direction depth is counted, and gaps felt.

A file beside this one adds another.
"""

from typing import ClassVar

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.slots import Slot, Variant
from wearlab.wear.path import WearPath


class ProjectionModel(Variant):
    """Any direction of the depth: what is counted of it, and what the mesh feels."""

    slot: ClassVar[Slot] = Slot(
        "wear.projection", __name__, default="normal", by_name=True
    )
    moves_gaps: ClassVar[bool] = False
    """whether `felt` is other than 1"""

    def factor(self, path: WearPath) -> Array:
        """Return the depth over that along the flank normal, (2, n) [1].

        It multiplies the wear rate, so that the depth that is counted has it.
        """
        return np.ones_like(path.curvature)

    def felt(self, gear: Gear, radius: Array) -> Array:
        """Return the gap that a depth makes over that depth, (n,) [1].

        Only the mesh feels it; the depth that is counted does not have it.

        Parameters
        ----------
        gear : whose flank is worn
        radius : (n,) of the places on its flank [m]
        """
        return np.ones_like(radius)

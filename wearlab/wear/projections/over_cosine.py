"""Gap over the cosine of the load angle."""

from typing import ClassVar, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import load_angle
from wearlab.wear.projections import ProjectionModel


class OverCosine(ProjectionModel):
    """Gap ``h/cos λ`` of a depth h that is counted along the normal.

    λ is the load angle, between the flank normal and the direction of the tooth's
    thickness. It overstates the gap, by 4 % at the pitch point and 15 % at the tip of
    W23's sun (PHYSICS §1).
    """

    model: Literal["over-cosine"] = "over-cosine"
    """W23's h/cos α in the gap of the flanks, α the load angle. Source: W23 Eq. 33"""

    moves_gaps: ClassVar[bool] = True

    def felt(self, gear: Gear, radius: Array) -> Array:
        """Return ``1/cos λ(r)``, (n,) [1]."""
        return np.asarray(1.0 / np.cos(load_angle(gear, radius)))

"""Depth over the cosine of the pressure angle."""

from typing import Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.wear.path import WearPath
from wearlab.wear.projections import ProjectionModel


class OverCosine(ProjectionModel):
    """Depth ``h/cos α``.

    It overstates the depth, by 4 % at the pitch point and 15 % at the tip of W23's sun
    (PHYSICS §1).
    """

    model: Literal["over-cosine"] = "over-cosine"
    """W23's h/cos α. Source: W23 Eq. 33"""

    def factor(self, path: WearPath) -> Array:
        """Return ``1/cos α(r)``, (2, n) [1]."""
        return np.asarray(1.0 / np.cos(path.pressure_angle))

"""As published, W23 Eq. 33: depth divided by the cosine of the local transverse pressure angle."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.options import option
from wearlab.wear.projections import ProjectionModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.wear.path import WearPath


class OverCosine(ProjectionModel):
    """Depth ``h/cos α``.

    It overstates the depth, by 4 % at the pitch point and 15 % at the tip of W23's sun (PHYSICS §1).
    """

    model: Literal["over-cosine"] = option("over-cosine", "W23's h/cos α", source="W23 Eq. 33")

    def factor(self, path: "WearPath") -> "Array":
        """Return ``1/cos α(r)``, (2, n) [1]."""
        return np.asarray(1.0 / np.cos(path.pressure_angle))

"""``wear.projection``: along which direction the depth of wear is counted.

A file beside this one adds another.
"""

from typing import ClassVar, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant
from wearlab.wear.path import WearPath


class ProjectionModel(Variant):
    """Any direction of the depth."""

    slot: ClassVar[Slot] = Slot(
        "wear.projection", __name__, default="normal", by_name=True
    )

    def factor(self, path: WearPath) -> Array:
        """Return the depth over that along the flank normal, (2, n) [1]."""
        raise NotImplementedError(f"{type(self).__name__} has no factor")


class NormalProjection(ProjectionModel):
    """Depth along the flank normal."""

    model: Literal["normal"] = "normal"
    """along the normal. Source: Archard 1953"""

    def factor(self, path: WearPath) -> Array:
        """Return 1, (2, n) [1]."""
        return np.ones_like(path.curvature)


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

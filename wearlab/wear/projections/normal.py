"""Depth along the flank normal, as Archard's law gives it."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.options import option
from wearlab.wear.projections import ProjectionModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.wear.path import WearPath


class NormalProjection(ProjectionModel):
    """Depth along the flank normal."""

    model: Literal["normal"] = option("normal", "along the normal", source="Archard 1953")

    def factor(self, path: "WearPath") -> "Array":
        """Return 1, (2, n) [1]."""
        return np.ones_like(path.curvature)

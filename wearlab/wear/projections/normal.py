"""Depth along the flank normal."""

from typing import Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.wear.path import WearPath
from wearlab.wear.projections import ProjectionModel


class NormalProjection(ProjectionModel):
    """Depth along the flank normal."""

    model: Literal["normal"] = "normal"
    """along the normal. Source: Archard 1953"""

    def factor(self, path: WearPath) -> Array:
        """Return 1, (2, n) [1]."""
        return np.ones_like(path.curvature)

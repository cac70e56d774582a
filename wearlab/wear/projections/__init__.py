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

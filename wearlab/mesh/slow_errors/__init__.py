"""``errors.slow``: what is made of errors that come once per revolution.

A file beside this one adds another.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class SlowErrorModel(Variant):
    """Any treatment of once-per-revolution errors."""

    slot: ClassVar[Slot] = Slot(
        "errors.slow", __name__, default="averaged", by_name=True
    )
    realised: ClassVar[bool] = False
    """Whether it is one drawn realisation of many."""
    turns: ClassVar[bool] = False
    """Whether errors turn with their members: a response lasts until the same teeth
    meet again."""

    def periods(self, teeth: Sequence[int]) -> int:
        """Return how many mesh periods a response lasts.

        Parameters
        ----------
        teeth : numbers of teeth of the gears
        """
        return 1

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> "Array | None":
        """Return the constant errors of the responses, one row a response.

        Parameters
        ----------
        meshes : with their errors
        at_angles : (n_angles, n_mesh) errors over equally weighted member angles [m]

        Returns
        -------
        (n_angles, n_mesh) [m]; None: the errors are part of the motion
        """
        raise NotImplementedError(f"{type(self).__name__} has no rows")

    def constant(self, meshes: "Sequence[Mesh]") -> "Array":
        """Return the part of it that a transmission error contains, (n_mesh,) [m].

        Parameters
        ----------
        meshes : with their errors
        """
        return np.zeros(len(meshes))

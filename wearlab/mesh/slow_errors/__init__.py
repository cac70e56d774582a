"""``errors.slow``: what is made of errors that come once per revolution, one variant a file."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class SlowErrorModel(Variant):
    """Any treatment of once-per-revolution errors.

    ``realised`` says whether it is one drawn realisation of many; ``turns`` whether errors turn with their
    members, so that a response lasts until the same teeth meet again.
    """

    slot: ClassVar[Slot] = Slot("errors.slow", __name__, words=True)
    realised: ClassVar[bool] = False
    turns: ClassVar[bool] = False

    def periods(self, teeth: Sequence[int]) -> int:
        """Return the mesh periods of a response of gears of so many teeth."""
        return 1

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> "Array | None":
        """Return the constant errors under which responses are found, (n_angles, n_mesh) [m].

        Parameters
        ----------
        meshes : with their errors
        at_angles : (n_angles, n_mesh) errors over equally weighted member angles [m]
        """
        raise NotImplementedError(f"{type(self).__name__} has no rows")

    def constant(self, meshes: "Sequence[Mesh]") -> "Array":
        """Return what a transmission error contains of it, (n_mesh,) [m]."""
        import numpy as np

        return np.zeros(len(meshes))

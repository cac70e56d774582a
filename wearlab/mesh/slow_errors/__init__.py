"""``errors.slow``: what is made of errors that come once per revolution."""

from collections.abc import Sequence
from math import lcm
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class SlowErrorModel(Variant):
    """Any treatment of once-per-revolution errors.

    ``realised`` says whether it is one drawn realisation of many; ``turns`` whether
    errors turn with their members, so that a response lasts until the same teeth meet
    again.
    """

    slot: ClassVar[Slot] = Slot(
        "errors.slow", __name__, default="averaged", by_name=True
    )
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
        return np.zeros(len(meshes))


class AveragedErrors(SlowErrorModel):
    """Quadrature over member angles."""

    model: Literal["averaged"] = "averaged"
    """quadrature over member angles. Source: wearlab"""

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> "Array":
        """Return the errors at every angle of the quadrature."""
        return at_angles


class FrozenErrors(SlowErrorModel):
    """One drawn angle."""

    realised: ClassVar[bool] = True

    model: Literal["frozen"] = "frozen"
    """one drawn angle. Source: wearlab"""

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> "Array":
        """Return the errors at the drawn angle, (1, n_mesh) [m]."""
        return self.constant(meshes)[None]

    def constant(self, meshes: "Sequence[Mesh]") -> "Array":
        """Return the errors at the drawn angle, (n_mesh,) [m]."""
        return np.array(
            [float(mesh.error.slow.value(np.zeros(1))[0]) for mesh in meshes]
        )


class HuntingErrors(SlowErrorModel):
    """The full period, until the same teeth meet again."""

    turns: ClassVar[bool] = True

    model: Literal["hunting"] = "hunting"
    """the full period. Source: wearlab"""

    def periods(self, teeth: Sequence[int]) -> int:
        """Return the least common multiple of the numbers of teeth."""
        return lcm(*teeth)

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> None:
        """Return nothing: the errors are part of the motion."""
        return None

"""Once-per-revolution errors, at one drawn angle of the members."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from wearlab.mesh.slow_errors import SlowErrorModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


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

"""Once-per-revolution errors, averaged over the angles of the members."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from wearlab.mesh.slow_errors import SlowErrorModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class AveragedErrors(SlowErrorModel):
    """Quadrature over member angles."""

    model: Literal["averaged"] = "averaged"
    """quadrature over member angles. Source: wearlab"""

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> "Array":
        """Return the errors at every angle of the quadrature."""
        return at_angles

"""The force at the moment when a point is in contact wears it."""

from typing import TYPE_CHECKING, Literal

from wearlab.arrays import Array
from wearlab.life.loads import Forces, LoadModel

if TYPE_CHECKING:
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


class InstantLoad(LoadModel):
    """The force when the point is in contact."""

    model: Literal["instant"] = "instant"
    """when the point is in contact. Source: L16"""

    def of_pairs(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force on each pair, (n_rows, n_phase_nodes, n_pairs) [N]."""
        return force.pair

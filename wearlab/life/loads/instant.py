"""The force at the moment each point of the flank is in contact."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.life.loads import LoadModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.life.load import Forces
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


class InstantLoad(LoadModel):
    """The force when the point is in contact."""

    model: Literal["instant"] = option("instant", "when the point is in contact", source="L16")

    def at_nodes(self, flanks: "MeshFlanks", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, (n_rows, n) [N]."""
        return np.stack([flanks.analysis.force_at_nodes(pair) for pair in force.pair])

"""Miner's equivalent torque in place of the static one, shared quasi-statically (L16 Eq. 25)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from wearlab.life.loads import LoadModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.life.load import Forces
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


@dataclass(frozen=True)
class Equivalent:
    """The equivalent of the mesh force over a period.

    Parameters
    ----------
    wohler_slope : exponent l of the damage line [1]
    """

    moving: ClassVar[bool] = True

    wohler_slope: float

    def at_nodes(self, flanks: "MeshFlanks", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, (1, n) [N]."""
        from wearlab.life.load import equivalent_force

        analysis = flanks.analysis
        equivalent = equivalent_force(analysis, force.weight, force.drive, self.wohler_slope)
        loads = np.full(len(static.deflection), equivalent)
        state = analysis.quasistatic(flanks.nodes, analysis.at_nodes, loads)
        return analysis.force_at_nodes(state.force)[None]


class EquivalentLoad(LoadModel):
    """L16's Miner torque."""

    needs_slope: ClassVar[bool] = True

    model: Literal["equivalent"] = option("equivalent", "L16's Miner torque", source="L16 Eq. 25")

    def build(self, wohler_slope: float | None) -> Equivalent:
        """Return the equivalent force."""
        assert wohler_slope is not None  # `problems` asks for it
        return Equivalent(wohler_slope)

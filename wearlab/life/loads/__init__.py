"""``wear.load``: which force wears the flanks.

A file beside this one adds another.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from wearlab.options import option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.life.load import Forces, Load
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


class LoadModel(Variant):
    """Any force that wears.

    ``moving`` says whether it is read off a response, ``needs_slope`` whether it counts damage along a Wöhler
    line.
    """

    slot: ClassVar[Slot] = Slot("wear.load", __name__, by_name=True)
    moving: ClassVar[bool] = True
    needs_slope: ClassVar[bool] = False

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what it asks of a scene, as (key, reason)."""
        if scene.dynamics is None:
            yield "wear.load", f"{self.chosen!r} needs [dynamics]; without it the load is 'static'"
        if self.needs_slope and scene.wear.wohler_slope is None:
            yield "wear.load", f"{self.chosen!r} needs 'wohler_slope', such as 6.61"

    def build(self, wohler_slope: float | None) -> "Load":
        """Return which force wears the flanks; ``wohler_slope`` is that of ``[wear]`` [1]."""
        return self

    def at_nodes(self, flanks: "MeshFlanks", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, as `wearlab.life.load.Load` does [N]."""
        raise NotImplementedError(f"{type(self).__name__} has neither build nor at_nodes")


class StaticLoad(LoadModel):
    """The static force: the wear rate needs no response."""

    moving: ClassVar[bool] = False

    model: Literal["static"] = option("static", "static force", source="W23")

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Ask nothing."""
        return iter(())

    def at_nodes(self, flanks: "MeshFlanks", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, (1, n) [N]."""
        return flanks.analysis.force_at_nodes(static.force)[None]


class InstantLoad(LoadModel):
    """The force when the point is in contact."""

    model: Literal["instant"] = option("instant", "when the point is in contact", source="L16")

    def at_nodes(self, flanks: "MeshFlanks", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, (n_rows, n) [N]."""
        return np.stack([flanks.analysis.force_at_nodes(pair) for pair in force.pair])


@dataclass(frozen=True)
class Equivalent:
    """Miner's equivalent of the mesh force over a period in place of the static one, shared quasi-statically.

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

"""``wear.load``: which force wears the flanks, one variant a file."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

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

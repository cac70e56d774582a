"""The static force, shared quasi-statically, whatever the dynamics do."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.life.loads import LoadModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.life.load import Forces
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


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

"""The static force, shared quasi-statically, whatever the dynamics do."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wearlab.life.loads import LoadModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.life.load import Forces
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import Touching


@dataclass(frozen=True)
class Static:
    """The static force: the wear rate needs no response."""

    moving: ClassVar[bool] = False

    def at_nodes(self, flanks: "Touching", static: "Quasistatic", force: "Forces") -> "Array":
        """Return the force on a pair at every node, (1, n) [N]."""
        return flanks.analysis.force_at_nodes(static.force)[None]


class StaticLoad(LoadModel):
    """The static force."""

    model: Literal["static"] = option("static", "static force", source="W23")

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Ask nothing."""
        return iter(())

    def build(self, wohler_slope: float | None) -> Static:
        """Return the static force."""
        return Static()

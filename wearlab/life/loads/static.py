"""The static force wears: the rate needs no response."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.life.loads import Forces, LoadModel

if TYPE_CHECKING:
    from wearlab.mesh.contact import Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


class StaticLoad(LoadModel):
    """The static force: the wear rate needs no response."""

    moving: ClassVar[bool] = False

    model: Literal["static"] = "static"
    """static force. Source: W23"""

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Ask nothing."""
        return iter(())

    def at_nodes(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force on a pair at every node, (1, n) [N]."""
        return flanks.analysis.force_at_nodes(static.force)[None]


def static_forces(flanks: "MeshFlanks", static: "Quasistatic") -> Forces:
    """Return the static forces as one row."""
    return Forces(
        np.ones(1),
        np.full((1, len(static.deflection)), flanks.analysis.load),
        static.force[None],
    )

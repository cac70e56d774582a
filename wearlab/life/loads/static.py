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

    def of_pairs(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the static force on each pair, (1, n_phase_nodes, n_pairs) [N]."""
        return static.force[None]


def static_forces(flanks: "MeshFlanks", static: "Quasistatic") -> Forces:
    """Return the static forces as one row."""
    return Forces(
        np.ones(1),
        np.full((1, len(static.deflection)), flanks.analysis.load),
        static.force[None],
    )

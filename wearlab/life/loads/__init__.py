"""``wear.load``: which force wears the flanks, from forces at the phase nodes.

A file beside this one adds another.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import PrivateAttr

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis, Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


class Forces(NamedTuple):
    """Mesh forces at the phase nodes of one kind of mesh.

    Parameters
    ----------
    weight : (n_rows,) of each row, summing to 1 [1]
    drive : (n_rows, n_phase_nodes) normal force of the drive flanks [N]
    pair : (n_rows, n_phase_nodes, n_pairs) that of each pair [N]
    periods : mesh periods of each response, () for the static forces
    """

    weight: Array
    drive: Array
    pair: Array
    periods: tuple[int, ...] = ()


class LoadModel(Variant):
    """Any force that wears.

    ``moving`` says whether it is read off a response, ``needs_slope`` whether it counts
    damage along a Wöhler line.
    """

    slot: ClassVar[Slot] = Slot("wear.load", __name__, by_name=True)
    moving: ClassVar[bool] = True
    needs_slope: ClassVar[bool] = False

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what it asks of a scene, as (key, reason)."""
        if scene.dynamics is None:
            yield (
                "wear.load",
                f"{self.chosen!r} needs [dynamics]; without it the load is 'static'",
            )
        if self.needs_slope and scene.wear.wohler_slope is None:
            yield "wear.load", f"{self.chosen!r} needs 'wohler_slope', such as 6.61"

    def build(self, wohler_slope: float | None) -> "LoadModel":
        """Return which force wears the flanks.

        ``wohler_slope`` is that of ``[wear]`` [1].
        """
        return self

    @property
    def tells_pairs(self) -> bool:
        """Whether it says the force on each pair, also of those beyond A and E."""
        return type(self).of_pairs is not LoadModel.of_pairs

    def of_pairs(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force on each pair that wears, (n_rows, n_phase_nodes, n_pairs).

        In newtons; one row for loads that know no rows.

        Parameters
        ----------
        flanks : the flanks in a wear state
        static : sharing of the static load at the phase nodes
        force : mesh and pair forces of the response, the static ones as one row without
        """
        raise NotImplementedError(
            f"{type(self).__name__} has neither build nor of_pairs"
        )

    def at_nodes(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force that wears each node, (n_rows, n) or (1, n) [N].

        Parameters
        ----------
        flanks, static, force : as of `of_pairs`
        """
        rows = self.of_pairs(flanks, static, force)
        return np.stack([flanks.analysis.force_at_nodes(pair) for pair in rows])

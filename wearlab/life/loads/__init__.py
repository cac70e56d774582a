"""``wear.load``: which force wears the flanks, and what it is made from: forces at the phase nodes.

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

    def at_nodes(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force that wears each node of a kind of mesh, (n_rows, n) or (1, n) [N].

        Parameters
        ----------
        flanks : the flanks in a wear state
        static : sharing of the static load at the phase nodes
        force : mesh and pair forces of the response, the static ones as one row without
        """
        raise NotImplementedError(
            f"{type(self).__name__} has neither build nor at_nodes"
        )


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


class InstantLoad(LoadModel):
    """The force when the point is in contact."""

    model: Literal["instant"] = "instant"
    """when the point is in contact. Source: L16"""

    def at_nodes(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return the force on a pair at every node, (n_rows, n) [N]."""
        return np.stack([flanks.analysis.force_at_nodes(pair) for pair in force.pair])


class EquivalentLoad(LoadModel):
    """L16's Miner torque, on all teeth alike.

    The equivalent of the drive-side force over the period, all meshes of the kind and
    every error angle, carried like a static load (L16 Eq. 25).
    """

    needs_slope: ClassVar[bool] = True

    model: Literal["equivalent"] = "equivalent"
    """L16's Miner torque. Source: L16 Eq. 25"""
    _wohler_slope: float = PrivateAttr(1.0)

    def build(self, wohler_slope: float | None) -> "EquivalentLoad":
        """Return the equivalent of this Wöhler line."""
        assert wohler_slope is not None  # `problems` asks for it
        own = self.model_copy()
        own._wohler_slope = wohler_slope
        return own

    def at_nodes(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return one row: the same wherever a phase stands."""
        analysis = flanks.analysis
        equivalent = equivalent_force(
            analysis, force.weight, force.drive, self._wohler_slope
        )
        loads = np.full(len(static.deflection), equivalent)
        state = analysis.quasistatic(flanks.nodes, analysis.at_nodes, loads)
        return analysis.force_at_nodes(state.force)[None]


def still(flanks: "MeshFlanks", static: "Quasistatic") -> Forces:
    """Return the static forces as one row."""
    return Forces(
        np.ones(1),
        np.full((1, len(static.deflection)), flanks.analysis.load),
        static.force[None],
    )


def equivalent_force(
    analysis: "ContactAnalysis", row: Array, drive: Array, slope: float
) -> float:
    """Return the Miner-equivalent of a mesh force (n_rows, n_phase_nodes), drive side only [N]."""
    _, weight = analysis.grid.phase_nodes
    weights = np.outer(row * len(row), weight).ravel()
    return float(equivalent_load(np.maximum(0.0, drive).ravel(), slope, weights))


def equivalent_load(
    load: ArrayLike, slope: float, weight: ArrayLike | None = None
) -> float:
    """Return the equivalent load of Miner's rule, ``(Σ n T^l / Σ n)^(1/l)``.

    Between the mean (l = 1) and the maximum (l → ∞).

    Computed on loads divided by their maximum, so that a steep Wöhler line does not
    overflow.

    Parameters
    ----------
    load : samples of the load (force or torque) over a period, ≥ 0; separation is 0,
        any shape
    slope : slope l of the Wöhler line, ≥ 1 [1]
    weight : times of occurrence or quadrature weights of the samples, broadcast [equal]

    Returns
    -------
    the equivalent load, in the unit of ``load``

    Raises
    ------
    ValueError
        When the slope is below 1 or a load is negative.

    Notes
    -----
    L16 Eq. 25. Archard's wear is linear in the load, so the mean would do; any l > 1
    can only raise it.
    """
    T = np.asarray(load, float)
    if not slope >= 1.0:
        raise ValueError(
            f"Wöhler slope {slope:g} is below 1: an equivalent load cannot lie below "
            "the mean"
        )
    if np.any(T < 0.0):
        raise ValueError(f"load {T.min():.3g} is negative: a flank cannot pull")
    largest = float(T.max())
    if largest == 0.0:
        return 0.0
    n = np.broadcast_to(1.0 if weight is None else np.asarray(weight, float), T.shape)
    return largest * float(np.sum(n * (T / largest) ** slope) / np.sum(n)) ** (
        1.0 / slope
    )

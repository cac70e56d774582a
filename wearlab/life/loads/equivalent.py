"""The equivalent of a load by Miner's rule wears, on all teeth alike."""

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import PrivateAttr

from wearlab.arrays import Array
from wearlab.life.loads import Forces, LoadModel

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis, Quasistatic
    from wearlab.mesh.excitation import MeshFlanks


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
        model = self.model_copy()
        model._wohler_slope = wohler_slope
        return model

    def of_pairs(
        self, flanks: "MeshFlanks", static: "Quasistatic", force: Forces
    ) -> Array:
        """Return one row of pairs under the equivalent load [N]."""
        analysis = flanks.analysis
        equivalent = equivalent_force(
            analysis, force.weight, force.drive, self._wohler_slope
        )
        loads = np.full(len(static.deflection), equivalent)
        state = analysis.quasistatic(flanks.nodes, analysis.at_nodes, loads)
        return state.force[None]


def equivalent_force(
    analysis: "ContactAnalysis", row: Array, drive: Array, slope: float
) -> float:
    """Return the Miner-equivalent of a mesh force (n_rows, n), drive side only [N].

    Parameters
    ----------
    analysis : contact of the mesh
    row : (n_rows,) weights of the rows [1]
    drive : (n_rows, n) force on the drive flanks [N]
    slope : Wöhler exponent [1]
    """
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

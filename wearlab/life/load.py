"""What a force that wears is made from: mesh and pair forces at the phase nodes, and their equivalent."""

from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
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


class Load(Protocol):
    """A force that wears the flanks; ``moving`` says whether it is read off a response."""

    moving: ClassVar[bool]

    def at_nodes(self, flanks: MeshFlanks, static: Quasistatic, force: Forces) -> Array:
        """Return the force that wears each node of a kind of mesh, (n_rows, n) or (1, n) [N].

        Parameters
        ----------
        flanks : the flanks in a wear state
        static : sharing of the static load at the phase nodes
        force : mesh and pair forces of the response, the static ones as one row without
        """
        ...


def still(flanks: MeshFlanks, static: Quasistatic) -> Forces:
    """Return the static forces as one row."""
    return Forces(np.ones(1), np.full((1, len(static.deflection)), flanks.analysis.load), static.force[None])


def equivalent_force(analysis: ContactAnalysis, row: Array, drive: Array, slope: float) -> float:
    """Return the Miner-equivalent of a mesh force (n_rows, n_phase_nodes), drive side only [N]."""
    _, weight = analysis.grid.phase_nodes
    weights = np.outer(row * len(row), weight).ravel()
    return float(equivalent_load(np.maximum(0.0, drive).ravel(), slope, weights))


def equivalent_load(load: ArrayLike, slope: float, weight: ArrayLike | None = None) -> float:
    """Return the equivalent load of Miner's rule, ``(Σ n T^l / Σ n)^(1/l)``.

    Between the mean (l = 1) and the maximum (l → ∞).

    Computed on loads divided by their maximum, so that a steep Wöhler line does not overflow.

    Parameters
    ----------
    load : samples of the load (force or torque) over a period, ≥ 0; separation is 0, any shape
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
    L16 Eq. 25. Archard's wear is linear in the load, so the mean would do; any l > 1 can only raise it.
    """
    T = np.asarray(load, float)
    if not slope >= 1.0:
        raise ValueError(f"Wöhler slope {slope:g} is below 1: an equivalent load cannot lie below the mean")
    if np.any(T < 0.0):
        raise ValueError(f"load {T.min():.3g} is negative: a flank cannot pull")
    largest = float(T.max())
    if largest == 0.0:
        return 0.0
    n = np.broadcast_to(1.0 if weight is None else np.asarray(weight, float), T.shape)
    return largest * float(np.sum(n * (T / largest) ** slope) / np.sum(n)) ** (1.0 / slope)

"""What excites the dynamics: the flanks of a mesh, pair by pair, or series fitted to the contact analysis.

Pairs are the consistent physics: ``W = Σ_j k_j(φ) max(0, δ − g_j(φ))``. Series are the papers' forms
``W = k(φ) f(u)`` with ``u = d·q − e(φ)``; their truncation is part of the model, and their force is handed to
the pairs by the quasi-static share.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.harmonics import Harmonics, Modulation

Combination = Literal["min", "max", "mean"]
LoadedOrNot = Literal["unloaded", "loaded"]


class AlongPhase(NamedTuple):
    """Mesh stiffness [N/m] and transmission error [m] as functions of phase."""

    stiffness: Harmonics | Modulation
    error: Harmonics | Modulation


def combined_error(state: Quasistatic, combination: Combination, error: LoadedOrNot) -> Array:
    """Return one transmission error for the mesh from the gaps of the pairs in the path, (n,) [m].

    References
    ----------
    W23 Eq. 36, min; L16 Eq. 18, loaded.
    """
    return ERRORS[error](state, combination)


def _largest(state: Quasistatic) -> Array:
    return np.where(np.isfinite(state.gap), state.gap, -np.inf).max(axis=1)


def _mean(state: Quasistatic) -> Array:
    present = np.isfinite(state.gap)
    return np.where(present, state.gap, 0.0).sum(axis=1) / present.sum(axis=1)


COMBINED: dict[Combination, Callable[[Quasistatic], Array]] = {
    "min": lambda state: state.unloaded,
    "max": _largest,
    "mean": _mean,
}

ERRORS: dict[LoadedOrNot, Callable[[Quasistatic, Combination], Array]] = {
    "loaded": lambda state, _: state.deflection,
    "unloaded": lambda state, combination: COMBINED[combination](state),
}


class MeshFlanks(NamedTuple):
    """The flanks of one kind of mesh in one wear state.

    Parameters
    ----------
    analysis, nodes : the contact of this wear state
    series : what the excitation was fitted to, None: pair by pair
    """

    analysis: ContactAnalysis
    nodes: Nodes
    series: AlongPhase | None

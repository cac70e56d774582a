"""How the mesh force reaches the dynamics: pair by pair, or as a series fitted to the contact analysis.

``Pairs`` is the consistent physics: ``W = Σ_j k_j(φ) max(0, δ − g_j(φ))``. ``Fourier`` and ``Modulated``
are the papers' forms ``W = k(φ) f(u)`` with ``u = d·q − e(φ)``; their truncation is part of the model, and
their force is handed to the pairs by the quasi-static share.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.harmonics import Harmonics, Modulation, fit, harmonics

Combination = Literal["min", "max", "mean"]


LoadedOrNot = Literal["unloaded", "loaded"]


class AlongPhase(NamedTuple):
    """Mesh stiffness [N/m] and transmission error [m] as functions of phase."""

    stiffness: Harmonics | Modulation
    error: Harmonics | Modulation


@dataclass(frozen=True)
class Pairs:
    """Pair by pair: no truncation, sharing follows the dynamic load, nothing counted twice."""

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> None:
        """Return None: nothing is fitted, the tables come straight from the nodes."""


@dataclass(frozen=True)
class Fourier:
    """Truncated Fourier series of stiffness and error, as published in W23 and L16 Eqs. 7–8.

    Parameters
    ----------
    stiffness_harmonics, error_harmonics : numbers of harmonics l and l_e
    combination : how the gaps of the pairs in the path make one error (W23 Eq. 36: min)
    error : the unloaded error, or the loaded one, which counts F/k twice (L16 Eq. 18)
    """

    stiffness_harmonics: int
    error_harmonics: int
    combination: Combination = "min"
    error: LoadedOrNot = "unloaded"

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> AlongPhase:
        """Expand the contact analysis of this wear state."""
        state = analysis.quasistatic(nodes, analysis.at_nodes)
        phase, weight = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)
        return AlongPhase(
            harmonics(phase, weight, state.tangent, self.stiffness_harmonics),
            harmonics(phase, weight, error, self.error_harmonics),
        )


@dataclass(frozen=True)
class Modulated:
    """One harmonic with amplitude and frequency modulation, as published in L16 Eqs. 10–13.

    Parameters
    ----------
    combination, error : as in :class:`Fourier`
    stiffness_given, error_given : modulations prescribed instead of fitted
    """

    combination: Combination = "min"
    error: LoadedOrNot = "unloaded"
    stiffness_given: Modulation | None = None
    error_given: Modulation | None = None

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> AlongPhase:
        """Fit the modulations to the contact analysis of this wear state."""
        state = analysis.quasistatic(nodes, analysis.at_nodes)
        phase, weight = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)
        return AlongPhase(
            self.stiffness_given or fit(phase, weight, state.tangent),
            self.error_given or fit(phase, weight, error),
        )


Excitation = Pairs | Fourier | Modulated


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

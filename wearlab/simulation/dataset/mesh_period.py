"""Stiffness and transmission error over a mesh period: mean, RMS, harmonics."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import ContactAnalysis, Nodes
from wearlab.mesh.harmonics import harmonics
from wearlab.mesh.onsets import rule_between_onsets


class PeriodSamples(NamedTuple):
    """Samples of a quantity over one mesh period, with a rule of integration.

    Parameters
    ----------
    phase : (n,) phases of the clock [1]
    weight : (n,) weights of a mean over these phases [1]
    value : (n,)
    """

    phase: Array
    weight: Array
    value: Array


class PeriodContact(NamedTuple):
    """The contact of one wear state over a mesh period.

    Parameters
    ----------
    stiffness : of the mesh [N/m]
    error : static transmission error [m]
    further_error : (k,) transmission error at further phases, where its extremes may
        lie: beside onsets of contact [m]
    """

    stiffness: PeriodSamples
    error: PeriodSamples
    further_error: Array

    @property
    def largest_error(self) -> float:
        """Largest transmission error [m]."""
        return float(max(self.error.value.max(), self.further_error.max()))

    @property
    def peak_to_peak(self) -> float:
        """Largest less smallest transmission error [m]."""
        smallest = min(self.error.value.min(), self.further_error.min())
        return float(self.largest_error - smallest)


def contact_over_period(
    analysis: ContactAnalysis,
    nodes: Nodes,
    lag: float = 0.0,
    error_at: Callable[[Array], Array] = np.zeros_like,
) -> PeriodContact:
    """Return the contact of pairs over a mesh period.

    The stiffness between onsets of contact, where it is smooth; the transmission error,
    which has no jumps there, at the nodes.

    Parameters
    ----------
    analysis : the contact of the mesh
    nodes : the wear state at its nodes
    lag : phase of the clock at which a pair enters at A [1]
    error_at : error of the mesh at phases of the mesh (n,), added to that of contact
        [m]
    """
    rule = rule_between_onsets(analysis, nodes)
    between_onsets = analysis.quasistatic(nodes, rule.where)
    stiffness = PeriodSamples(
        rule.where.phase + lag, rule.weight, between_onsets.tangent
    )

    phase, weight = analysis.grid.phase_nodes
    at_nodes = analysis.quasistatic(nodes, analysis.at_nodes)
    error = at_nodes.deflection + error_at(phase)

    return PeriodContact(
        stiffness=stiffness,
        error=PeriodSamples(phase + lag, weight, error),
        further_error=between_onsets.deflection + error_at(rule.where.phase),
    )


def over_period(states: Sequence[PeriodContact], count: int) -> dict[str, Array]:
    """Return mean, RMS, harmonics and extremes of stiffness and transmission error.

    Parameters
    ----------
    states : the contact of every state
    count : number of harmonics

    Returns
    -------
    Variable → values (n_updates, …).
    """
    values = {
        "ste_peak_to_peak": np.array([contact.peak_to_peak for contact in states]),
        "ste_max": np.array([contact.largest_error for contact in states]),
    }
    samples = {
        "stiffness": [contact.stiffness for contact in states],
        "ste": [contact.error for contact in states],
    }
    for name, of_states in samples.items():
        series = [harmonics(*of_state, count) for of_state in of_states]
        values[f"{name}_mean"] = np.array([state.mean for state in series])
        values[f"{name}_rms"] = np.array([state.rms for state in series])
        values[f"{name}_harmonics"] = np.array([state.amplitude for state in series])
        values[f"{name}_harmonics_phase"] = np.array([state.phase for state in series])
    return values

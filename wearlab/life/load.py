"""Which force wears the flanks, and the forces there are to choose from."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.mesh.contact import ContactAnalysis, Quasistatic
from wearlab.mesh.excitation import Touching
from wearlab.wear.miner import equivalent_load

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InstantLoad:
    """The force at the moment each point of the flank is in contact."""


@dataclass(frozen=True)
class EquivalentLoad:
    """Miner's equivalent torque in place of the static one, shared quasi-statically (L16 Eq. 25).

    Parameters
    ----------
    wohler_slope : exponent l of the damage line [1]
    """

    wohler_slope: float


@dataclass(frozen=True)
class StaticLoad:
    """The static force, shared quasi-statically, whatever the dynamics do."""


Load = InstantLoad | EquivalentLoad | StaticLoad


class Forces(NamedTuple):
    """Mesh forces at the phase nodes of one kind of mesh.

    Parameters
    ----------
    weight : (n_rows,) of each row, summing to 1 [1]
    elastic : (n_rows, n_phase_nodes) [N]
    pair : (n_rows, n_phase_nodes, n_pairs) [N]
    periods : mesh periods of each response, () for the static forces
    """

    weight: Array
    elastic: Array
    pair: Array
    periods: tuple[int, ...] = ()


def still(one: Touching, static: Quasistatic) -> Forces:
    """Return the static forces as one row."""
    return Forces(np.ones(1), np.full((1, len(static.deflection)), one.analysis.load), static.force[None])


def equivalent_force(analysis: ContactAnalysis, row: Array, elastic: Array, slope: float) -> float:
    """Return the Miner-equivalent of a mesh force (n_rows, n_phase_nodes), drive side only [N]."""
    _, weight = analysis.grid.phase_nodes
    weights = np.outer(row * len(row), weight).ravel()
    return float(equivalent_load(np.maximum(0.0, elastic).ravel(), slope, weights))


def wearing_force(load: Load, one: Touching, static: Quasistatic, force: Forces) -> Array:
    """Return the force that wears each node of a kind of mesh, (n_rows, n) or (1, n) [N]."""
    analysis = one.analysis
    match load:
        case InstantLoad():
            return np.stack([analysis.force_at_nodes(pair) for pair in force.pair])
        case EquivalentLoad(slope):
            equivalent = equivalent_force(analysis, force.weight, force.elastic, slope)
            loads = np.full(len(static.deflection), equivalent)
            state = analysis.quasistatic(one.nodes, analysis.at_nodes, loads)
            return analysis.force_at_nodes(state.force)[None]
        case StaticLoad():
            return analysis.force_at_nodes(static.force)[None]

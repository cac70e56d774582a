"""One wear state, wholly evaluated: the flanks of every kind of mesh, and the steady responses."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response
from wearlab.life.vibration import Responses
from wearlab.mesh.contact import Nodes, Quasistatic
from wearlab.mesh.excitation import AlongPhase

Wear = tuple[Array, ...]
"""Wear depths of every kind of mesh, each (2, n) ordered (driving, driven) [m]."""


class KindState(NamedTuple):
    """One kind of mesh in a wear state.

    Rows are mesh periods of every mesh of the kind at every error angle; their weights sum to 1.

    Parameters
    ----------
    wear : (2, n) wear depth, (driving, driven) [m]
    nodes : compliance and gaps at the nodes
    static : sharing of the static load at the phase nodes
    fitted : the series the dynamics received, None for pairs
    weight : (n_rows,) of each row [1]
    drive : (n_rows, n_phase_nodes) normal force of the drive flanks at the phase nodes [N]
    tooth_force : (n_rows, n), one row for loads that know no rows: force on a pair at the node [N]
    rate : (2, n) wear depth per cycle, None without a wear law [m]
    """

    wear: Array
    nodes: Nodes
    static: Quasistatic
    fitted: AlongPhase | None
    weight: Array
    drive: Array
    tooth_force: Array
    rate: Array | None

    @property
    def mean_tooth_force(self) -> Array:
        """Force on a pair at the node, averaged over the rows, (n,) [N]."""
        single = len(self.tooth_force) == 1
        return np.asarray(self.tooth_force[0] if single else self.weight @ self.tooth_force)


class WearState(NamedTuple):
    """Everything known of one wear state.

    Parameters
    ----------
    kind : the flanks of every kind of mesh
    responses : the steady responses, none without dynamics
    noise : standard error of the rate of aperiodic responses, largest over the nodes; else 0 [m]
    block : the state in every block of a duty, none without; then this is the first with the mixed rate
    """

    kind: tuple[KindState, ...]
    responses: Responses
    noise: float
    block: "tuple[WearState, ...]" = ()

    @property
    def response(self) -> Response | None:
        """The steady response (at the first error angle), None without dynamics."""
        return self.responses[0] if self.responses else None

    @property
    def wear(self) -> Wear:
        """Wear depths of every kind of mesh."""
        return tuple(kind.wear for kind in self.kind)

    @property
    def wears(self) -> bool:
        """Whether there is a wear law."""
        return all(kind.rate is not None for kind in self.kind)

    @property
    def rate(self) -> Wear:
        """Wear rates of every kind of mesh [m per cycle]."""
        return tuple(kind.rate for kind in self.kind if kind.rate is not None)

"""The power that sliding flanks turn into heat, and the load beyond A and E.

Over a mesh period ``P_V = (1/T) ∮ Σ_j μ F_j |v_s,j| dt``, ``v_s = ω_1 (1 + 1/u) s``,
all pairs included: those beyond A and E slide most. Their sliding is taken as on the
line of action, an estimate.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.gears.gear import GearPair
from wearlab.mesh.profile import ProfileGrid


class SlidingPairs(NamedTuple):
    """Where and how fast pairs slide over a mesh period.

    Parameters
    ----------
    weight : (n_phase_nodes,) quadrature over the period, summing to 1 [1]
    speed : (n_phase_nodes, n_pairs) |v_s| of each pair, 0 of an absent one [m/s]
    is_beyond : (n_phase_nodes, n_pairs) whether it touches before A or after E
    power : nominal power of the mesh, F r_b1 ω_1 [W]
    """

    weight: Array
    speed: Array
    is_beyond: Flags
    power: float

    def loss(self, rows: Array, force: Array) -> float:
        """Return the loss over the coefficient of friction, ``P_V/μ`` [W].

        Parameters
        ----------
        rows : (n_rows,) weights of mesh periods, summing to 1 [1]
        force : (n_rows, n_phase_nodes, n_pairs) normal forces of the pairs [N]
        """
        over_pairs = np.einsum("rnp,np->rn", force, self.speed)
        return float(rows @ over_pairs @ self.weight)

    def load_beyond(self, rows: Array, force: Array) -> float:
        """Return the share of the load that pairs beyond A and E carry [1].

        Parameters
        ----------
        rows : (n_rows,) weights of mesh periods, summing to 1 [1]
        force : (n_rows, n_phase_nodes, n_pairs) normal forces of the pairs [N]
        """
        whole = float(rows @ force.sum(axis=2) @ self.weight)
        beyond = np.where(self.is_beyond, force, 0.0).sum(axis=2)
        return float(rows @ beyond @ self.weight) / whole if whole > 0.0 else 0.0


def sliding_pairs(
    pair: GearPair, grid: ProfileGrid, speed: float, load: float
) -> SlidingPairs:
    """Return where and how fast the pairs of a mesh slide.

    Parameters
    ----------
    pair : the gears in their operating position
    grid : the nodes
    speed : ω_1 of the driving gear [rad/s]
    load : static normal force of the mesh [N]
    """
    _, weight = grid.phase_nodes
    number = grid.pairs_at_phase_nodes
    present = number >= 0
    at_nodes = speed * np.abs(pair.sliding(grid.contact_position))
    first = grid.before
    last = first + len(grid.position) - 1
    return SlidingPairs(
        weight=weight,
        speed=np.where(present, at_nodes[number], 0.0),
        is_beyond=present & ((number < first) | (number > last)),
        power=load * pair.driving.base_radius * speed,
    )

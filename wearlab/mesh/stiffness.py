"""How stiff one pair of teeth is: the choices a scene has, each a type.

Every choice answers the same three questions at the profile nodes: the compliance of teeth and bodies for
given wear, the compliance of the contact itself, and what neighbouring pairs share.
"""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from wearlab.mesh.curve import Curve
from wearlab.mesh.profile import Lookup, ProfileGrid, lookup

Array = NDArray[np.float64]


class PairStiffness(Protocol):
    """What a contact analysis asks of a stiffness model."""

    @property
    def load_dependent(self) -> bool:
        """Whether :meth:`contact` depends on the force."""

    def body(self, wear: Array) -> Array:
        """Return the compliance of teeth and bodies for wear (2, n), (n,) [m/N]."""

    def contact(self, force: Array | None) -> Array | float:
        """Return the compliance of the contact under pair forces (n,), (n,) [m/N]."""

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""


@dataclass(frozen=True)
class GivenStiffness:
    """A stiffness that is prescribed, constant or from a table, of one pair or of the whole mesh.

    A mesh stiffness is shared out evenly among the pairs that are in the path at that phase.

    Parameters
    ----------
    curve : stiffness over phase (of the mesh, [0, 1]) or over ``(s − s_A)/p_b`` (of a pair, [0, ε]) [N/m]
    of : whose stiffness the curve is
    grid : the nodes
    """

    curve: Curve
    of: Literal["pair", "mesh"]
    grid: ProfileGrid
    load_dependent = False

    def at(self, where: Lookup) -> Array:
        """Return the pair stiffness at phases, 0 when out of the path, (n, n_pairs) [N/m]."""
        present = self.grid.first[where.segment] >= 0
        if self.of == "mesh":
            middle = 0.5 * (self.grid.breaks[where.segment] + self.grid.breaks[where.segment + 1])
            value = self.curve.value(where.phase, middle)[:, None] / present.sum(axis=1, keepdims=True)
        else:
            ahead = np.arange(self.grid.n_pairs)[::-1]
            value = self.curve.value(where.phase[:, None] + ahead, where.phase[:, None] + ahead)
        return np.where(present, value, 0.0)

    def body(self, wear: Array) -> Array:
        """Return the reciprocal of the stiffness at the nodes, whatever the wear, (n,) [m/N]."""
        phases, _ = self.grid.phase_nodes
        segment = np.repeat(np.arange(len(self.grid.intervals)), self.grid.intervals + 1)
        pairs = self.grid.pairs_at_phase_nodes
        nodal = np.empty(len(self.grid.position))
        nodal[pairs[pairs >= 0]] = self.at(lookup(self.grid, phases, segment))[pairs >= 0]
        return 1.0 / nodal

    def contact(self, force: Array | None) -> float:
        """Return zero: a given stiffness already contains the contact [m/N]."""
        return 0.0

    def cross(self, wear: Array) -> Array:
        """Return no shared compliance, (0, n) [m/N]."""
        return np.zeros((0, len(self.grid.position)))

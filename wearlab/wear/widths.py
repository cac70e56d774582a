"""How wide the contacts at the nodes are, as shares of a few widths.

Hertz' half width goes with the root of the force. Operators are made for forces that
are powers of two of a reference, and a contact between two of them takes a share of
either, linear in the force: so the second moment of what it spreads is exact.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array

NARROWEST = -4
"""Power of two of the reference force below which contacts do not get narrower: a
quarter of its width, about the distance of two nodes."""
WIDEST = 8
"""Power of two above which they do not get wider, if they may be as wide [1]."""


class NodeForces(NamedTuple):
    """Forces on a pair that touches at the nodes, as they take turns.

    Parameters
    ----------
    weight : (n_rows,) of each row, summing to 1 [1]
    force : (n_rows, n) ≥ 0 [N]
    """

    weight: Array
    force: Array

    @property
    def mean(self) -> Array:
        """Mean force at the nodes, (n,) [N]."""
        if len(self.force) == 1:
            return self.force[0]
        return np.asarray(self.weight @ self.force)

    @property
    def wearing(self) -> Array:
        """Mean force with the weight of what it wears, ``Σ w F²/Σ w F``, (n,) [N].

        That of the mean width squared; 0 where nothing touches.
        """
        if len(self.force) == 1:
            return self.force[0]
        mean = self.mean
        square = self.weight @ self.force**2
        return np.divide(square, mean, out=np.zeros_like(mean), where=mean > 0.0)


def node_forces(force: Array) -> NodeForces:
    """Return one force at each node as forces that take turns.

    Parameters
    ----------
    force : (n,) [N]
    """
    return NodeForces(np.ones(1), force[None])


def shares_of_widths(ratio: Array, weight: Array, widest: int) -> dict[int, Array]:
    """Return the share of every contact at each width that any has, (n,) each [1].

    Parameters
    ----------
    ratio : (n_rows, n) force over the reference [1]
    weight : (n_rows, n) of each, summing to the shares [1]
    widest : power of two of the widest

    Returns
    -------
    Powers of two of the reference force, and the shares there.
    """
    kept = np.clip(ratio, 2.0**NARROWEST, 2.0**widest)
    mantissa, exponent = np.frexp(kept)  # of a half to one
    lower = exponent - 1
    of_upper = weight * (2.0 * mantissa - 1.0)
    of_lower = weight - of_upper

    shares: dict[int, Array] = {}
    for power in range(int(lower.min()), int(lower.max()) + 2):
        here = np.where(lower == power, of_lower, 0.0)
        here += np.where(lower == power - 1, of_upper, 0.0)
        share = here.sum(axis=0)
        if share.any():
            shares[power] = share
    return shares


def shares_that_level(ratio: Array, weight: Array, widest: int) -> dict[int, Array]:
    """Return the share of the passes of every contact at each width, (n,) each [1].

    A contact that bears nothing levels nothing: below the narrowest width its share
    falls with the force.

    Parameters
    ----------
    ratio : (n_rows, n) force over the reference [1]
    weight : (n_rows,) of each row [1]
    widest : as of `shares_of_widths`
    """
    touching = np.minimum(1.0, ratio / 2.0**NARROWEST)
    return shares_of_widths(ratio, weight[:, None] * touching, widest)

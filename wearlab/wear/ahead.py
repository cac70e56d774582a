"""A wear rate that looks ahead of what levels, so that steps need not be short for it.

Short waves level within a micrometre of wear. A rate that is what the flanks will be
given after some of it is not stiff.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from wearlab.arrays import Array

LAG = 6e-4
"""Largest wear by which a rate looks ahead, at the fastest static rate, times nodes of
the path [m]."""
LAG_OVER_DEPTH = 10.0
"""That wear over the deepest so far, times nodes of the path [1]."""
LEAST_LAG = 4.0**-3
"""Least lag over the largest [1]."""
BETWEEN_LAGS = 4.0
"""A lag that is factored over the next shorter one [1]."""


def looking_ahead(matrix: csr_array, lag: float) -> SuperLU:
    """Return I − τD, factored, for D (2n, 2n) [1/cycle] and a lag τ [cycles]."""
    return splu((eye_array(matrix.shape[0]) - lag * matrix).tocsc())


@dataclass(frozen=True)
class Ahead:
    """A rate that looks ahead, ``(2A − A²) r`` with ``A = (I − τD)⁻¹``.

    Its error is of second order in τ: what D evens out while the fastest contact wears
    by the lag. It is a share of the depth so far, since waves that have not grown need
    not be followed, and 3 µm at most. Between lags that are four times each other,
    which are factored once, rates are interpolated.

    Parameters
    ----------
    matrix : D of contacts that bear the whole load, (2n, 2n) [1/cycle]
    fastest : static rate of the fastest contact [m per cycle]
    nodes : of the path of contact [1]
    """

    matrix: csr_array
    fastest: float
    nodes: int
    _factors: dict[int, SuperLU] = field(default_factory=dict, compare=False)

    def rate(self, forced: Array, depth: float) -> Array:
        """Return the rate (2n,) that looks ahead [m per cycle].

        Parameters
        ----------
        forced : (2n,) rate [m per cycle]
        depth : deepest wear so far [m]
        """
        if self.fastest <= 0.0:
            return forced
        share = min(LAG_OVER_DEPTH * depth / LAG, 1.0)
        place = -math.log(max(share, LEAST_LAG)) / math.log(BETWEEN_LAGS)
        level = int(place)
        between = place - level
        shorter = between**2 * (3.0 - 2.0 * between)  # smooth from lag to lag
        longer = self._looking_ahead(forced, level)
        if shorter == 0.0:
            return longer
        following = self._looking_ahead(forced, level + 1)
        return longer + shorter * (following - longer)

    def _looking_ahead(self, forced: Array, level: int) -> Array:
        """Return the rate with one of the lags."""
        if level not in self._factors:
            lag = LAG / self.nodes * BETWEEN_LAGS**-level / self.fastest
            self._factors[level] = looking_ahead(self.matrix, lag)
        once = self._factors[level].solve(forced)
        twice = self._factors[level].solve(once)
        return np.asarray(2.0 * once - twice)

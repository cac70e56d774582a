"""How far the first-order form of worn contact is from the exact one, over wear depth."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.exact.gaps import WornFlanks
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.stiffness import SectionVanished

AGREEMENT = 0.05
SHALLOWEST, DEEPEST = 1e-8, 1e-3
BISECTIONS = 30


class Errors(NamedTuple):
    """Unloaded transmission error of one wear state in both forms, over the phase nodes [m].

    Parameters
    ----------
    displacement : (n_phase_nodes,) ``min_j (h1 + h2)`` at s_j
    exact : (n_phase_nodes,) smallest rotation gap of the pairs
    """

    displacement: Array
    exact: Array

    @property
    def excess(self) -> float:
        """By how much the first-order form overestimates the largest error, over the exact one [1]."""
        return float(self.displacement.max() / self.exact.max() - 1.0)


def errors_in_both_forms(flanks: WornFlanks, wear: Array) -> Errors:
    """Return the unloaded transmission error of wear (2, n) [m] in both forms.

    References
    ----------
    Y23 Eq. 62 for the exact one, there as an angle of the driven gear.
    """
    grid = flanks.grid
    displacement = grid.beyond((wear + flanks.modification).sum(axis=0))
    exact = minimum_gap(*flanks.worn(wear), grid.touching).gap
    pairs = grid.pairs_at_phase_nodes
    return Errors(*(np.where(pairs >= 0, gap[pairs], np.inf).min(axis=1) for gap in (displacement, exact)))


def depth_of_disagreement(flanks: WornFlanks, shape: Array, share: float = AGREEMENT) -> float:
    """Return the wear depth beyond which the first-order error differs by a share from the exact one.

    Parameters
    ----------
    flanks : the pair and its nodes
    shape : (2, n) wear over its largest depth, (driving, driven) [1]
    share : of the exact error [1]

    Returns
    -------
    largest depth of the shape [m]; inf when both agree up to ``DEEPEST``, or as deep as flanks of this shape
    can be worn
    """

    def excess(depth: float) -> float:
        try:
            return abs(errors_in_both_forms(flanks, depth * shape).excess)
        except SectionVanished:
            return np.inf

    low, high = SHALLOWEST, DEEPEST
    beyond = excess(high)
    if beyond < share:
        return np.inf
    for _ in range(BISECTIONS):
        middle = float(np.sqrt(low * high))
        found = excess(middle)
        low, high, beyond = (middle, high, beyond) if found < share else (low, middle, found)
    return high if beyond < np.inf else np.inf

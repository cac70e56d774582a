"""How far contact reaches beyond the path: tip corners that a
deflection keeps on the mating flank.
"""

from dataclasses import dataclass

from wearlab.arrays import Array
from wearlab.mesh.exact.gaps import WornFlanks, beyond_path
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.profile import Extension

CLOSE = 1e-12
"""Of the furthest: how narrowly the end of contact is enclosed."""


@dataclass(frozen=True)
class Deflections:
    """Deflection δ where a pair is about to enter at A, and where one
    has just left at E [m].
    """

    entering: float
    leaving: float


def extension(flanks: WornFlanks, wear: Array, deflection: Deflections) -> Extension:
    """Return how far beyond A and E deflected teeth touch: where the gap of the tip
    corner reaches δ.

    Parameters
    ----------
    flanks : the pair and its nodes
    wear : (2, n) wear depth, (driving, driven) [m]
    deflection : δ at both ends, wear included as in the static transmission error [m]

    Returns
    -------
    Extension, as `wearlab.mesh.exact.gaps.beyond_path` gives it

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    first, second = flanks.worn(wear)
    both = deflection.entering, deflection.leaving
    return beyond_path(
        flanks.pair, lambda x: minimum_gap(first, second, x).gap, both, CLOSE
    )

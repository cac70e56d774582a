"""How far contact reaches beyond the path: tip corners that a deflection keeps on the mating flank."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearlab.mesh.exact.gaps import WornFlanks
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.profile import Extension

Array = NDArray[np.float64]

FURTHEST = 0.45
"""Base pitches beyond either end at most: before A and after E pairs stay apart in phase."""
SCAN = 32
CLOSE = 1e-12
"""Of the furthest: how narrowly the end of contact is enclosed."""


@dataclass(frozen=True)
class Deflections:
    """Deflection δ where a pair is about to enter at A, and where one has just left at E [m]."""

    entering: float
    leaving: float


def extension(flanks: WornFlanks, wear: Array, deflection: Deflections) -> Extension:
    """Return how far beyond A and E deflected teeth touch: where the gap of the tip corner reaches δ.

    Parameters
    ----------
    flanks : the pair and its nodes
    wear : (2, n) wear depth, (driving, driven) [m]
    deflection : δ at both ends, wear included as in the static transmission error [m]

    Returns
    -------
    Extension, each at most ``FURTHEST`` base pitches, and 0 where the end itself does not touch
    """
    first, second = flanks.worn(wear)
    path, most = flanks.pair.path, FURTHEST * flanks.pair.base_pitch

    def reached(end: float, sense: float, delta: float) -> float:
        low, high = 0.0, most
        while high - low > CLOSE * most:
            distance = np.linspace(low, high, SCAN)
            touching = minimum_gap(first, second, end + sense * distance).gap < delta
            if touching.all():
                return high
            index = int(np.argmin(touching))
            if index == 0:
                return low
            low, high = distance[index - 1], distance[index]
        return float(low)

    return Extension(reached(path.A, -1.0, deflection.entering), reached(path.E, 1.0, deflection.leaving))


def furthest(flanks: WornFlanks) -> Extension:
    """Return how far beyond A and E tip corners of unworn gears meet an involute at all."""
    everything = Deflections(np.inf, np.inf)
    return extension(flanks, np.zeros((2, len(flanks.grid.position))), everything)

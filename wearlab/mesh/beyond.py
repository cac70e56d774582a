"""Where contact ends beyond A and E: the path positions at which a gap no longer stays below a deflection."""

from collections.abc import Callable

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.mesh.profile import Extension

FURTHEST = 0.95
"""Base pitches beyond either end at most: no second pair comes before the one that approaches A."""


def beyond_path(
    pair: GearPair, gap: Callable[[Array], Array], deflection: tuple[float, float], close: float, points: int
) -> Extension:
    """Return how far beyond A and E a gap stays below a deflection, by scans that enclose its end.

    Parameters
    ----------
    pair : the gears
    gap : gap at path positions, (m,) from (m,) [m]
    deflection : δ where a pair is about to enter at A, and where one has just left at E [m]
    close : how narrowly the end of contact is enclosed, over the furthest place looked at [1]
    points : positions of a scan

    Returns
    -------
    Extension, each at most ``FURTHEST`` base pitches, and 0 where the end itself does not touch

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    path, most = pair.path, FURTHEST * pair.base_pitch

    def reached(end: float, sense: float, delta: float) -> float:
        low, high = 0.0, most
        while high - low > close * most:
            distance = np.linspace(low, high, points)
            touching = gap(end + sense * distance) < delta
            if touching.all():
                return high
            index = int(np.argmin(touching))
            if index == 0:
                return low
            low, high = distance[index - 1], distance[index]
        return float(low)

    return Extension(reached(path.A, -1.0, deflection[0]), reached(path.E, 1.0, deflection[1]))

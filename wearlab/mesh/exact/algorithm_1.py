"""Algorithm 1 of Y23 as published: every point of one flank against every point of the other."""

import numpy as np

from wearlab.gears.gear import GearPair
from wearlab.mesh.exact.angles import local_points, position_of
from wearlab.mesh.exact.flank import Flank
from wearlab.mesh.exact.tangency import FlankContact

PUBLISHED_POINTS = 1849
CENTRE_TOLERANCE = 1e-5
BLOCK = 64


def algorithm_1(
    pair: GearPair,
    driving: Flank,
    driven: Flank,
    points: int = PUBLISHED_POINTS,
    tolerance: float = CENTRE_TOLERANCE,
) -> FlankContact:
    """Return the mesh relationship by Y23's search over NUM × NUM points.

    For each point of the driving flank the point of the driven one is taken for which the centre distance
    comes out nearest to a; it is half a step of the search off, and so is the transmission error in first
    order of the step.

    Parameters
    ----------
    pair : the gears; an external pair has its centre on the other side
    driving, driven : worn flanks
    points : NUM, equally spaced in the angle α of each active flank
    tolerance : ε_a, centre distance beyond which a point finds no partner [m]; not printed in Y23

    Returns
    -------
    FlankContact, each (points,), NaN without a partner

    References
    ----------
    Y23, Algorithm 1.
    """
    s = np.linspace(pair.path.A, pair.path.E, points)
    gamma1, R1, lam1 = local_points(pair, 0, driving, s)
    gamma2, R2, lam2 = local_points(pair, 1, driven, s)
    side = driving.side * driven.side
    touching = FlankContact(s.copy(), *(np.full(points, np.nan) for _ in range(3)))
    for begin in range(0, points, BLOCK):
        rows = np.arange(begin, min(begin + BLOCK, points))
        turned = gamma2 + lam2 - lam1[rows, None]
        n = side * R2 * np.cos(turned) - (R1 * np.cos(gamma1))[rows, None]
        u = side * R2 * np.sin(turned) - (R1 * np.sin(gamma1))[rows, None]
        distance = np.abs(np.hypot(n, u) - pair.centre_distance)
        best = np.argmin(distance, axis=1)
        close = distance[np.arange(len(rows)), best] <= tolerance
        rows, at = rows[close], (np.flatnonzero(close), best[close])
        # line 11, the line of centres as the driving tooth sees it, counted counter-clockwise
        phi1 = -np.arctan2(driven.side * u[at], driven.side * n[at])
        phi2 = phi1 + lam2[at[1]] - lam1[rows]
        touching.driven[rows] = s[at[1]]
        touching.x_driving[rows] = position_of(pair, 0, driving.side * phi1)
        touching.x_driven[rows] = position_of(pair, 1, driven.side * phi2)
    return touching

"""How far beyond A and E deflected teeth would touch, told without the exact search: a measure, not a part.

A run without extended contact asks this once, to say how much it leaves out. Both flanks are taken as their
nodes with straight lines between, and the tip corner is met exactly; kinematics as in
:mod:`wearlab.mesh.exact.kinematics`, for all points and positions at once.
"""

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import DRIVING, GearPair
from wearlab.mesh.beyond import beyond_path
from wearlab.mesh.exact.flank import healthy_reach, side_of
from wearlab.mesh.exact.kinematics import point_seen, turned_to
from wearlab.mesh.profile import Extension

SCAN = 33
CLOSE = 2e-3
"""Of the furthest: a thousandth of a base pitch, by two scans."""
POINTS_BELOW = 40
"""Points between the form circle and the active flank."""


class Folded(ValueError):
    """A flank so steeply worn that it overhangs."""


def reach_beyond(pair: GearPair, position: Array, depth: Array, deflection: tuple[float, float]) -> Extension:
    """Return how far beyond A and E the gap stays below a deflection, to a thousandth of a base pitch.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions of the nodes, A to E [m]
    depth : (2, n) material removed from the flanks along their normals, (driving, driven) [m]
    deflection : δ where a pair is about to enter at A, and where one has just left at E [m]

    Raises
    ------
    Folded
        When a flank overhangs.

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    driving, driven = (_Points(pair, gear, position, depth[gear]) for gear in (0, 1))
    return beyond_path(pair, lambda x: _gap(driving, driven, x), deflection, CLOSE, SCAN)


class _Points:
    """A worn flank as points: path position s, shift w along the healthy normal, and ``s + w``, ascending."""

    def __init__(self, pair: GearPair, gear: int, position: Array, depth: Array) -> None:
        low, high = healthy_reach(pair, gear)
        before, after = _between(low, position[0]), _between(high, position[-1])[::-1]
        self.s = np.concatenate([before, position, after])
        signed = -depth if gear == DRIVING else depth
        self.w = np.interp(self.s, position, signed)
        self.w[len(before) : len(before) + len(position)] = signed
        self.reach = self.s + self.w
        self.base_radius = pair.gears[gear].base_radius
        self.curvature = self.base_radius * np.tan(pair.working_pressure_angle)
        self.side = side_of(pair, gear)
        smooth = np.diff(self.s) > 0.0
        if np.any(np.diff(self.reach)[smooth] <= 0.0):
            raise Folded("the flank overhangs")
        self.rising = np.maximum.accumulate(self.reach)


def _between(end: float, active: float) -> Array:
    """Return points from the end of a flank to its active part, which is left out."""
    return np.linspace(end, active, POINTS_BELOW if end != active else 0, endpoint=False)


def _gap(driving: _Points, driven: _Points, x: Array) -> Array:
    """Return the smallest rotation gap over the points of the driving flank and at the driven tip, (m,)."""
    with np.errstate(invalid="ignore"):
        reach, q_n, q_u = point_seen(driving, driven, x[:, None], driving.s, driving.w)
    s2 = np.interp(reach, driven.rising, driven.s, left=np.nan, right=np.nan)
    gap = x[:, None] - s2 - turned_to(driven, reach, q_n, q_u)
    best = np.where(np.isnan(gap), np.inf, gap).min(axis=1)
    for end in (0, -1):
        best = np.minimum(best, _corner_gap(driving, driven, x, reach, end))
    return np.asarray(best)


def _corner_gap(driving: _Points, driven: _Points, x: Array, reach: Array, end: int) -> Array:
    """Return the gap of one end of the driven flank, inf where the driving flank has no such point, (m,)."""
    corner = driven.reach[end]
    with np.errstate(invalid="ignore"):
        crosses = (reach[:, :-1] - corner) * (reach[:, 1:] - corner) <= 0.0
    reached = crosses.any(axis=1)
    at, row = np.argmax(crosses, axis=1), np.arange(len(x))
    before, after = reach[row, at], reach[row, at + 1]
    share = np.divide(
        corner - before, after - before, out=np.zeros(len(x)), where=reached & (after != before)
    )
    s, w = (values[at] + share * (values[at + 1] - values[at]) for values in (driving.s, driving.w))
    with np.errstate(invalid="ignore"):
        _, q_n, q_u = point_seen(driving, driven, x, s, w)
    return np.where(reached, x - driven.s[end] - turned_to(driven, corner, q_n, q_u), np.inf)

"""Contact beyond A and E: the gaps of tip corners, and how far a deflection keeps them in contact.

Before A the driven tip meets the driving flank, after E the driving tip the driven one, both inside the
active flanks. Geometry knows neither load nor wear, so it is a table: the unworn separation of each node near
the tip from the mate, and which point of the mate it meets. Wear adds what is gone of both points, and the
pair touches where the sum is least: at the tip corner, or inside of it where the tip is worn round.

`reach_beyond` tells a run without extended contact once how much it leaves out, by the same table.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears.gear import DRIVEN, DRIVING, TIP_AT, GearPair
from wearlab.mesh.exact.flank import OverhangingFlank, involute_of
from wearlab.mesh.exact.kinematics import point_seen, turned_to
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
            in_contact = gap(end + sense * distance) < delta
            if in_contact.all():
                return high
            index = int(np.argmin(in_contact))
            if index == 0:
                return low
            low, high = distance[index - 1], distance[index]
        return float(low)

    return Extension(reached(path.A, -1.0, deflection[0]), reached(path.E, 1.0, deflection[1]))


NEAR_TIP = 0.3
"""Base pitches from the tip within which a worn flank may touch beyond the path."""
SCAN, CLOSE = 33, 1e-6
"""Positions of a scan for the end of contact, and how narrowly it is enclosed, of the furthest."""
TURNS = 40
"""Steps by which the driven gear is turned back; each leaves a tenth to a third of the last."""
AS_GOOD_AS_MET = 1e-12
"""Base pitches by which the last step may still turn the flanks: a thousandth of an atom."""


class Corner(NamedTuple):
    """The flank of a tip against its mate, at positions beyond one end of the path.

    Parameters
    ----------
    gear : whose tip it is, 0 driving, 1 driven
    own : (m,) nodes near the tip, the tip itself first
    separation : (n, m) gap of these points of the unworn flank from the mate, along the line of action [m]
    low, share : (n, m) the mate's point each would meet: the node before it, and how far on to the next [1]
    """

    gear: int
    own: Index
    separation: Array
    low: Index
    share: Array

    def gap(self, removed: Array) -> Array:
        """Return the smallest gap for material removed from the flanks (2, …, n_nodes), (…, n) [m]."""
        own, mate = removed[self.gear][..., None, self.own], removed[1 - self.gear]
        theirs = mate[..., self.low] * (1.0 - self.share) + mate[..., self.low + 1] * self.share
        return np.asarray((self.separation + theirs + own).min(axis=-1))


def corner(pair: GearPair, end: str, x: Array, position: Array) -> Corner:
    """Lay out the geometry of one end of the path.

    Parameters
    ----------
    pair : the gears
    end : "A" (tip of the driven gear) or "E" (tip of the driving gear)
    x : (n,) positions to which the gears have turned, beyond that end or at it [m along the line of action]
    position : (n_nodes,) path positions of the nodes, A to E [m]

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    gear, tip = TIP_AT[end], getattr(pair.path, end)
    own = np.flatnonzero(np.abs(position - tip) <= NEAR_TIP * pair.base_pitch)
    own = own if gear == DRIVEN else own[::-1]
    separation, mate = separations(pair, gear, np.asarray(x, float)[:, None], position[own])
    low = np.clip(np.searchsorted(position, mate, side="right") - 1, 0, len(position) - 2)
    length = position[low + 1] - position[low]
    reached = np.divide(mate - position[low], length, out=np.zeros_like(mate), where=length > 0.0)
    return Corner(gear, own, separation, low, np.clip(reached, 0.0, 1.0))


NEARLY = 2e-3
"""Of the furthest: a thousandth of a base pitch, by two scans."""


def reach_beyond(
    pair: GearPair, position: Array, depth: Array, deflection: tuple[float, float], close: float = NEARLY
) -> Extension:
    """Return how far beyond A and E the gap stays below a deflection, to first order in wear.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions of the nodes, A to E [m]
    depth : (2, n) material removed from the flanks along their normals, (driving, driven) [m]
    deflection : δ where a pair is about to enter at A, and where one has just left at E [m]
    close : how narrowly the end of contact is enclosed, of the furthest [1]

    Raises
    ------
    OverhangingFlank
        When a flank overhangs.

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    reached = position + np.array([[-1.0], [1.0]]) * depth
    if np.any(np.diff(reached)[:, np.diff(position) > 0.0] <= 0.0):
        raise OverhangingFlank("the flank overhangs")

    def gap(x: Array) -> Array:
        return corner(pair, "A" if x[-1] < pair.path.C else "E", x, position).gap(depth)

    return beyond_path(pair, gap, deflection, close, SCAN)


def unworn_extension(pair: GearPair, deflection: float) -> Extension:
    """Return how far beyond A and E a deflection keeps the tip corners of unworn gears in contact [m].

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    ends = np.array([pair.path.A, pair.path.E])
    return reach_beyond(pair, ends, np.zeros((2, 2)), (deflection, deflection), CLOSE)


def separations(pair: GearPair, gear: int, x: Array, s: Array) -> tuple[Array, Array]:
    """Return how far points of one unworn flank are from the mate, and the mate's points they meet.

    A flank point that touches at s lies, with its gear turned to x, at the angle (x − s)/r_b from there. The
    mate's point at the same distance from the mate's centre touches at s', and lies (x − s')/r_b' from there.
    The separation is how far the driven gear must turn back until the two meet: at once for its own points,
    step by step where its points are those that meet the driving flank.

    Parameters
    ----------
    pair : the gears
    gear : whose points, 0 driving, 1 driven
    x : positions to which the gears have turned [m along the line of action]
    s : path positions of the points [m]; broadcasts with x

    Returns
    -------
    separation, times the driven base radius [m], and s' [m], of the broadcast shape

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    own, mate, turned = involute_of(pair, gear), involute_of(pair, 1 - gear), x + 0.0 * s
    for _ in range(TURNS):
        with np.errstate(invalid="ignore"):
            reach, q_n, q_u = point_seen(own, mate, turned, s, 0.0)
        theirs = np.where(np.isnan(reach), -mate.side * mate.curvature, reach)  # within its base circle: that
        mate_turned = theirs + turned_to(mate, theirs, q_n, q_u)
        if gear == DRIVING:
            return x - mate_turned, theirs
        turned = turned + (x - mate_turned)
        if np.abs(x - mate_turned).max(initial=0.0) <= AS_GOOD_AS_MET * pair.base_pitch:
            break
    return x - turned, theirs

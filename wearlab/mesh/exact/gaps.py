"""Gaps of the pairs for a contact analysis: exact, first order, or Y23's Algorithm 1.

Before A the driven tip meets the driving flank, after E the driving tip the driven one,
both inside the active flanks. Geometry knows neither load nor wear, so it is a table:
the unworn separation of each node near the tip from the mate, and which point of the
mate it meets. Wear adds what is gone of both points, and the pair touches where the sum
is least: at the tip corner, or inside of it where the tip is worn round.

`reach_beyond` tells a run without extended contact once how much it leaves out, by the
same table.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.gears.gear import DRIVEN, DRIVING, TIP_AT, GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh import profile, stiffness
from wearlab.mesh.exact import flank, kinematics, minimum_gap

FURTHEST = 0.95
"""Base pitches beyond either end at most: no second pair comes before the one that
approaches A."""
SCAN, CLOSE = 33, 1e-6
"""Places of a scan for the end of contact, and how narrowly it is enclosed, of the
furthest."""


def end_of(
    holds: Callable[[Array], Flags], inside: float, outside: float, close: float
) -> float:
    """Return the last place where a condition holds, by ever narrower scans.

    Parameters
    ----------
    holds : whether it does at places (m,), (m,)
    inside, outside : where it holds, and the furthest place looked at
    close : how narrowly the end is enclosed
    """
    while abs(outside - inside) > close:
        scan = np.linspace(inside, outside, SCAN)
        lost = np.flatnonzero(~holds(scan))
        if not len(lost) or not lost[0]:
            return float(inside if len(lost) else outside)
        inside = scan[lost[0] - 1]
        outside = scan[lost[0]]
    return float(inside)


def beyond_path(
    pair: GearPair,
    gap: Callable[[Array], Array],
    deflection: tuple[float, float],
    close: float,
) -> profile.Extension:
    """Return how far beyond A and E a gap stays below a deflection, by scans.

    Parameters
    ----------
    pair : the gears
    gap : gap at path positions, (m,) from (m,) [m]
    deflection : δ where a pair is about to enter at A, and where one has just left at E
        [m]
    close : how narrowly the end of contact is enclosed, over the furthest place looked
        at [1]

    Returns
    -------
    profile.Extension, each at most ``FURTHEST`` base pitches, and 0 where the end
    itself does not touch

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    path = pair.path
    most = FURTHEST * pair.base_pitch

    def reached(end: float, sense: float, delta: float) -> float:
        return end_of(
            lambda far: gap(end + sense * far) < delta, 0.0, most, close * most
        )

    return profile.Extension(
        reached(path.A, -1.0, deflection[0]), reached(path.E, 1.0, deflection[1])
    )


class Corner(NamedTuple):
    """The flank of a tip against its mate, at positions beyond one end of the path.

    Parameters
    ----------
    gear : whose tip it is, 0 driving, 1 driven
    own : (m,) nodes near the tip, the tip itself first
    separation : (n, m) gap of these points of the unworn flank from the mate, along the
        line of action [m]
    low, share : (n, m) the mate's point each would meet: the node before it, and how
        far on to the next [1]
    """

    gear: int
    own: Index
    separation: Array
    low: Index
    share: Array

    def gap(self, removed: Array) -> Array:
        """Return the smallest gap, (…, n) [m].

        Parameters
        ----------
        removed : (2, …, n_nodes) material removed from the flanks [m]
        """
        own = removed[self.gear][..., None, self.own]
        mate = removed[1 - self.gear]
        theirs = (
            mate[..., self.low] * (1.0 - self.share)
            + mate[..., self.low + 1] * self.share
        )
        return np.asarray((self.separation + theirs + own).min(axis=-1))


def corner(pair: GearPair, end: str, x: Array, position: Array) -> Corner:
    """Lay out the geometry of one end of the path.

    Parameters
    ----------
    pair : the gears
    end : "A" (tip of the driven gear) or "E" (tip of the driving gear)
    x : (n,) positions to which the gears have turned, beyond that end or at it [m along
        the line of action]
    position : (n_nodes,) path positions of the nodes, A to E [m]

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    gear = TIP_AT[end]
    tip = getattr(pair.path, end)
    # base pitches from the tip within which a worn flank may touch beyond the path
    own = np.flatnonzero(np.abs(position - tip) <= 0.3 * pair.base_pitch)
    own = own if gear == DRIVEN else own[::-1]
    separation, mate = separations(
        pair, gear, np.asarray(x, float)[:, None], position[own]
    )
    low = np.clip(
        np.searchsorted(position, mate, side="right") - 1, 0, len(position) - 2
    )
    length = position[low + 1] - position[low]
    reached = np.divide(
        mate - position[low], length, out=np.zeros_like(mate), where=length > 0.0
    )
    return Corner(gear, own, separation, low, np.clip(reached, 0.0, 1.0))


NEARLY = 2e-3
"""Of the furthest: a thousandth of a base pitch, by two scans."""


def reach_beyond(
    pair: GearPair,
    position: Array,
    depth: Array,
    deflection: tuple[float, float],
    close: float = NEARLY,
) -> profile.Extension:
    """Return how far beyond A and E the gap stays below a deflection, to first order.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions of the nodes, A to E [m]
    depth : (2, n) material removed from the flanks along their normals, (driving,
        driven) [m]
    deflection : δ where a pair is about to enter at A, and where one has just left at E
        [m]
    close : how narrowly the end of contact is enclosed, of the furthest [1]

    Raises
    ------
    flank.OverhangingFlank
        When a flank overhangs.

    References
    ----------
    Munro, Morrish & Palmer 1999: contact of tip corners beyond the ends of the path.
    """
    if np.any(
        np.diff(position + np.array([[-1.0], [1.0]]) * depth)[
            :, np.diff(position) > 0.0
        ]
        <= 0.0
    ):
        raise flank.OverhangingFlank("the flank overhangs")

    def gap(x: Array) -> Array:
        return corner(pair, "A" if x[-1] < pair.path.C else "E", x, position).gap(depth)

    return beyond_path(pair, gap, deflection, close)


def unworn_extension(pair: GearPair, deflection: float) -> profile.Extension:
    """Return how far beyond A and E tip corners of unworn gears touch [m].

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    ends = np.array([pair.path.A, pair.path.E])
    return reach_beyond(pair, ends, np.zeros((2, 2)), (deflection, deflection), CLOSE)


def separations(pair: GearPair, gear: int, x: Array, s: Array) -> tuple[Array, Array]:
    """Return how far points of an unworn flank are from the mate, and where.

    A flank point that touches at s lies, with its gear turned to x, at the angle (x −
    s)/r_b from there. The mate's point at the same distance from the mate's centre
    touches at s', and lies (x − s')/r_b' from there. The separation is how far the
    driven gear must turn back until the two meet: at once for its own points, step by
    step where its points are those that meet the driving flank.

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
    own = flank.involute_of(pair, gear)
    mate = flank.involute_of(pair, 1 - gear)
    turned = x + 0.0 * s
    # steps by which the driven gear is turned back; each leaves a tenth to a third of
    # the last
    for _ in range(40):
        with np.errstate(invalid="ignore"):
            reach, q_n, q_u = kinematics.point_seen(own, mate, turned, s, 0.0)
        theirs = np.where(
            np.isnan(reach), -mate.side * mate.curvature, reach
        )  # within its base circle: that
        mate_turned = theirs + kinematics.turned_to(mate, theirs, q_n, q_u)
        if gear == DRIVING:
            return x - mate_turned, theirs
        turned = turned + (x - mate_turned)
        # base pitches by which the last step may still turn the flanks: a thousandth of
        # an atom
        if np.abs(x - mate_turned).max(initial=0.0) <= 1e-12 * pair.base_pitch:
            break
    return x - turned, theirs


BLOCK = 64


def algorithm_1(
    pair: GearPair, driving: flank.Flank, driven: flank.Flank, points: int = 1849
) -> kinematics.FlankContact:
    """Return the mesh relationship by Y23's search over NUM × NUM points.

    For each point of the driving flank the point of the driven one is taken for which
    the centre distance comes out nearest to a; it is half a step of the search off, and
    so is the transmission error in first order of the step.

    Parameters
    ----------
    pair : the gears; an external pair has its centre on the other side
    driving, driven : worn flanks
    points : NUM, equally spaced in the angle α of each active flank

    Returns
    -------
    FlankContact, each (points,), NaN without a partner

    References
    ----------
    Y23, Algorithm 1.
    """
    s = np.linspace(pair.path.A, pair.path.E, points)
    gamma1, R1, lam1 = flank.local_points(pair, 0, driving, s)
    gamma2, R2, lam2 = flank.local_points(pair, 1, driven, s)
    side = driving.side * driven.side
    contact = kinematics.FlankContact(
        s.copy(), *(np.full(points, np.nan) for _ in range(3))
    )
    for begin in range(0, points, BLOCK):
        rows = np.arange(begin, min(begin + BLOCK, points))
        turned = gamma2 + lam2 - lam1[rows, None]
        n = side * R2 * np.cos(turned) - (R1 * np.cos(gamma1))[rows, None]
        u = side * R2 * np.sin(turned) - (R1 * np.sin(gamma1))[rows, None]
        distance = np.abs(np.hypot(n, u) - pair.centre_distance)
        best = np.argmin(distance, axis=1)
        close = distance[np.arange(len(rows)), best] <= 1e-5
        rows = rows[close]
        at = (np.flatnonzero(close), best[close])
        # line 11, the line of centres as the driving tooth sees it, counted
        # counter-clockwise
        phi1 = -np.arctan2(driven.side * u[at], driven.side * n[at])
        phi2 = phi1 + lam2[at[1]] - lam1[rows]
        contact.driven[rows] = s[at[1]]
        contact.x_driving[rows] = flank.position_of(pair, 0, driving.side * phi1)
        contact.x_driven[rows] = flank.position_of(pair, 1, driven.side * phi2)
    return contact


@dataclass(frozen=True)
class WornFlanks:
    """What makes worn flanks of wear depths at the nodes.

    Parameters
    ----------
    pair : the gears
    grid : the nodes
    modification : (2, n) material removed on purpose, (driving, driven) [m]
    """

    pair: GearPair
    grid: profile.ProfileGrid
    modification: Array

    @cached_property
    def runs(self) -> list[slice]:
        """Smooth runs of nodes."""
        return flank.smooth_runs(self.grid)

    @cached_property
    def thickness(self) -> Array:
        """Thickness of each tooth along the flank normal at the nodes, (2, n) [m]."""
        radii = [self.pair.radius(i, self.grid.position) for i in (DRIVING, DRIVEN)]
        return 2.0 * np.stack([*map(contact_depth, self.pair.gears, radii)])

    def worn(self, wear: Array) -> tuple[flank.Flank, flank.Flank]:
        """Return both flanks with wear (2, n) (driving, driven) [m].

        Raises
        ------
        SectionVanished
            When wear is deeper than the tooth is thick, or leaves no flank.
        """
        self.check_thickness(wear)
        depth = wear + self.modification
        s = self.grid.position
        first = flank.worn_flank(self.pair, 0, s, depth[0], self.runs)
        second = flank.worn_flank(self.pair, 1, s, depth[1], self.runs)
        return first, second

    def check_thickness(self, wear: Array) -> None:
        """Refuse wear (2, n) deeper than the tooth [m].

        Raises
        ------
        SectionVanished
            With the flank, the depth and the thickness.
        """
        if np.any(wear >= self.thickness):
            gear, node = np.argwhere(wear >= self.thickness)[0]
            raise stiffness.SectionVanished(
                f"{self.pair.gears[gear].name}: wear of {1e3 * wear[gear, node]:.4g} "
                "mm is deeper than the "
                f"tooth, {1e3 * self.thickness[gear, node]:.4g} mm thick there along "
                "its normal"
            )


class MeetingGaps(NamedTuple):
    """Gaps at the points of both flanks that meet; beyond A and E, at the tip corners.

    Parameters
    ----------
    flanks : the flanks
    find : where (driving, driven) touch when the driving gear has turned to x (m,) [m]:
        first of all, or where :func:`searched` finds them
    """

    flanks: WornFlanks
    find: Callable[[flank.Flank, flank.Flank, Array], kinematics.FlankContact] = (
        minimum_gap.minimum_gap
    )

    def contact(self, wear: Array, x: Array) -> kinematics.FlankContact:
        """Return where a pair of worn flanks touches.

        Parameters
        ----------
        wear : (2, n) depths [m]
        x : (m,) positions to which the driving gear has turned [m]
        """
        return self.find(*self.flanks.worn(wear), x)

    def at(self, wear: Array) -> Array:
        """Return the gap at every touching node for wear (2, n), (n_contact,) [m]."""
        return self.contact(wear, self.flanks.grid.contact_position).gap


def searched(
    pair: GearPair, points: int, driving: flank.Flank, driven: flank.Flank, x: Array
) -> kinematics.FlankContact:
    """Return where flanks touch by Y23's Algorithm 1, to half a step of its search.

    Between the points found it is interpolated; beyond the last of them their points
    and gap are kept.

    Parameters
    ----------
    pair : the gears
    points : NUM, points searched on each flank
    driving, driven : worn flanks
    x : (m,) positions to which the driving gear has turned [m]

    References
    ----------
    Y23, Algorithm 1.
    """
    contact = algorithm_1(pair, driving, driven, points)
    have = np.flatnonzero(np.isfinite(contact.gap))
    order = have[np.argsort(contact.x_driving[have])]
    first = np.interp(x, contact.x_driving[order], contact.driving[order])
    second = np.interp(x, contact.x_driving[order], contact.driven[order])
    gap = np.interp(x, contact.x_driving[order], contact.gap[order])
    return kinematics.FlankContact(first, second, x, x - gap)


@dataclass(frozen=True)
class DisplacementBeyond:
    """First-order gaps on A–E, carried on beyond by those of the tip corners.

    Beyond A and E the corner's gap is shifted by the difference of the two forms at
    that end, so that the gap is continuous there. To first order flanks meet on the
    line of action.

    Parameters
    ----------
    flanks : the flanks
    """

    flanks: WornFlanks

    @cached_property
    def corners(self) -> tuple[tuple[slice, Corner], ...]:
        """The nodes beyond each end, and the corner that touches there.

        Its last position is the end.
        """
        grid = self.flanks.grid
        inside = self.flanks.grid.on_flank
        pair = self.flanks.pair
        return tuple(
            (
                part,
                corner(
                    pair,
                    end,
                    np.append(grid.contact_position[part], tip),
                    grid.position,
                ),
            )
            for end, tip, part in (
                ("A", grid.position[0], slice(0, inside.start)),
                ("E", grid.position[-1], slice(inside.stop, None)),
            )
        )

    def at(self, wear: Array) -> Array:
        """Return the gap at every touching node for wear (2, n), (n_contact,) [m].

        Raises
        ------
        SectionVanished
            When wear is deeper than the tooth is thick.
        """
        self.flanks.check_thickness(wear)
        return self.of(wear + self.flanks.modification)

    def of(self, removed: Array) -> Array:
        """Return the gap, (…, n_contact) [m].

        Parameters
        ----------
        removed : (2, …, n) material removed from the flanks [m]
        """
        gap = self.flanks.grid.beyond(removed.sum(axis=0))
        for part, tip in self.corners:
            least = tip.gap(removed)
            gap[..., part] += least[..., :-1] - least[..., -1:]
        return gap


Gaps = MeetingGaps | DisplacementBeyond
"""Where the gaps of worn flanks come from."""

"""Gaps of the pairs for a contact analysis: exact, first order, or Y23's Algorithm 1.

Before A the driven tip meets the driving flank, after E the driving tip the driven one,
both inside the active flanks. Geometry knows neither load nor wear, so it is a table:
the unworn separation of each node near the tip from the mate, and which point of the
mate it meets. Wear adds what is gone of both points, and the pair touches where the sum
is least: at the tip corner, or inside of it where the tip is worn round.

A run without extended contact calls `reach_beyond` once, which finds by the same table
how much contact the run leaves out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.gears.gear import DRIVEN, DRIVING, GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh import profile, stiffness
from wearlab.mesh.exact import flank, kinematics, minimum_gap

FURTHEST = 0.95
"""Base pitches beyond either end at most: no second pair comes before the one that
approaches A."""
SCAN = 33
"""Places of a scan for the end of contact."""
CLOSE = 1e-6
"""How narrowly the end of contact is enclosed, over the furthest distance [1]."""
NEARLY = 2e-3
"""The same for an estimate: a thousandth of a base pitch, by two scans [1]."""
TIP_REGION = 0.3
"""Distance from the tip, in base pitches, within which a worn flank may touch beyond
the path [1]."""
MAX_TURNS = 40
"""Steps by which the driven gear is turned back at most; each leaves a tenth to a third
of the last."""
TURN_TOLERANCE = 1e-12
"""Largest last step, in base pitches: a thousandth of an atom [1]."""
BLOCK = 64
"""Points of the driving flank that Algorithm 1 compares with all others at a time."""
CENTRE_TOLERANCE = 1e-5
"""How far the centre distance of a found pair of points may be off [m]."""


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
        failing = np.flatnonzero(~holds(scan))
        if not len(failing):
            return float(outside)
        first = failing[0]
        if first == 0:
            return float(inside)
        inside = scan[first - 1]
        outside = scan[first]
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
    furthest = FURTHEST * pair.base_pitch
    at_entry, at_exit = deflection

    def touches_before(distance: Array) -> Flags:
        return gap(pair.path.A - distance) < at_entry

    def touches_after(distance: Array) -> Flags:
        return gap(pair.path.E + distance) < at_exit

    return profile.Extension(
        approach=end_of(touches_before, 0.0, furthest, close * furthest),
        recess=end_of(touches_after, 0.0, furthest, close * furthest),
    )


class Corner(NamedTuple):
    """The flank of a tip against its mate, at positions beyond one end of the path.

    Where contact ends at the edge of an undercut gear, that edge takes the place of the
    tip.

    Parameters
    ----------
    gear : whose tip it is, 0 driving, 1 driven
    node : (m,) nodes near the tip, the tip itself first
    separation : (n, m) gap of these points of the unworn flank from the mate, along the
        line of action [m]
    low, share : (n, m) the mate's point each would meet: the node before it, and how
        far on to the next [1]
    """

    gear: int
    node: Index
    separation: Array
    low: Index
    share: Array

    def gap(self, removed: Array) -> Array:
        """Return the smallest gap, (…, n) [m].

        Parameters
        ----------
        removed : (2, …, n_nodes) material removed from the flanks [m]
        """
        of_tip = removed[self.gear][..., None, self.node]
        mate = removed[1 - self.gear]
        below = mate[..., self.low]
        above = mate[..., self.low + 1]
        of_mate = below * (1.0 - self.share) + above * self.share
        return np.asarray((self.separation + of_mate + of_tip).min(axis=-1))


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
    gear = pair.corner_at(end)
    distance = np.abs(position - getattr(pair.path, end))
    node = np.flatnonzero(distance <= TIP_REGION * pair.base_pitch)
    if end == "E":
        node = node[::-1]

    turned = np.asarray(x, float)[:, None]
    separation, mate = separations(pair, gear, turned, position[node])

    following = np.searchsorted(position, mate, side="right")
    low = np.clip(following - 1, 0, len(position) - 2)
    length = position[low + 1] - position[low]
    start = np.zeros_like(mate)
    share = np.divide(mate - position[low], length, out=start, where=length > 0.0)
    return Corner(gear, node, separation, low, np.clip(share, 0.0, 1.0))


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
    # driving flanks are shifted backwards, driven ones forwards
    reached = position + np.array([[-1.0], [1.0]]) * depth
    is_interval = np.diff(position) > 0.0
    if np.any(np.diff(reached)[:, is_interval] <= 0.0):
        raise flank.OverhangingFlank("the flank overhangs")

    def gap(x: Array) -> Array:
        end = "A" if x[-1] < pair.path.C else "E"
        return corner(pair, end, x, position).gap(depth)

    return beyond_path(pair, gap, deflection, close)


def unworn_extension(pair: GearPair, deflection: float) -> profile.Extension:
    """Return how far beyond A and E tip corners of unworn gears touch [m].

    Parameters
    ----------
    pair : the gears
    deflection : δ at both ends of the path [m]

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
    involute = flank.involute_of(pair, gear)
    mate = flank.involute_of(pair, 1 - gear)
    inside_base_circle = -mate.side * mate.curvature
    turned = x + 0.0 * s
    for _ in range(MAX_TURNS):
        with np.errstate(invalid="ignore"):
            reach, q_n, q_u = kinematics.point_seen(involute, mate, turned, s, 0.0)
        met = np.where(np.isnan(reach), inside_base_circle, reach)
        mate_turned = met + kinematics.turned_to(mate, met, q_n, q_u)
        if gear == DRIVING:
            return x - mate_turned, met

        step = x - mate_turned
        turned = turned + step
        if np.abs(step).max(initial=0.0) <= TURN_TOLERANCE * pair.base_pitch:
            break
    return x - turned, met


class _TurnedFlanks(NamedTuple):
    """Points of both flanks in the axes of their teeth, turned to a common normal.

    Parameters
    ----------
    position : (points,) path positions [m]
    driving, driven : polar angle γ [rad], radius R [m] and angle of the normal λ [rad]
        of the points, (points,) each
    side : 1 or −1, the side of the driven gear's centre
    """

    position: Array
    driving: tuple[Array, Array, Array]
    driven: tuple[Array, Array, Array]
    side: float

    def centres(self, rows: Index) -> tuple[Array, Array]:
        """Return where the driven centre lies, seen from the driving tooth.

        Parameters
        ----------
        rows : (m,) points of the driving flank, each with all of the driven one

        Returns
        -------
        components across and along the tooth, (m, points) each [m]
        """
        gamma1, R1, lam1 = self.driving
        gamma2, R2, lam2 = self.driven
        across = self.side * R2 * np.cos(gamma2 + lam2)
        along = self.side * R2 * np.sin(gamma2 + lam2)
        cos = np.cos(lam1[rows, None])
        sin = np.sin(lam1[rows, None])
        x1 = (R1 * np.cos(gamma1))[rows, None]
        y1 = (R1 * np.sin(gamma1))[rows, None]
        return across * cos + along * sin - x1, along * cos - across * sin - y1


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
    flanks = _TurnedFlanks(
        position=s,
        driving=flank.local_points(pair, 0, driving, s),
        driven=flank.local_points(pair, 1, driven, s),
        side=driving.side * driven.side,
    )
    lam1 = flanks.driving[2]
    lam2 = flanks.driven[2]
    contact = kinematics.FlankContact(
        driving=s.copy(),
        driven=np.full(points, np.nan),
        x_driving=np.full(points, np.nan),
        x_driven=np.full(points, np.nan),
    )

    for begin in range(0, points, BLOCK):
        block = np.arange(begin, min(begin + BLOCK, points))
        n, u = flanks.centres(block)
        miss = np.abs(np.hypot(n, u) - pair.centre_distance)
        nearest = np.argmin(miss, axis=1)
        is_close = miss[np.arange(len(block)), nearest] <= CENTRE_TOLERANCE
        rows = block[is_close]
        columns = nearest[is_close]
        found_at = (np.flatnonzero(is_close), columns)

        # line 11, the line of centres as the driving tooth sees it, counted
        # counter-clockwise
        side = driven.side
        phi1 = -np.arctan2(side * u[found_at], side * n[found_at])
        phi2 = phi1 + lam2[columns] - lam1[rows]
        contact.driven[rows] = s[columns]
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
    def layouts(self) -> tuple[flank.FlankLayout, flank.FlankLayout]:
        """What wear does not change of both flanks, (driving, driven)."""
        return (
            flank.flank_layout(self.pair, DRIVING, self.grid),
            flank.flank_layout(self.pair, DRIVEN, self.grid),
        )

    @cached_property
    def thickness(self) -> Array:
        """Thickness of each tooth along the flank normal at the nodes, (2, n) [m]."""
        depths = []
        for number in (DRIVING, DRIVEN):
            radius = self.pair.radius(number, self.grid.position)
            depths.append(contact_depth(self.pair.gears[number], radius))
        return 2.0 * np.stack(depths)

    def worn(self, wear: Array) -> tuple[flank.Flank, flank.Flank]:
        """Return both flanks with wear (2, n) (driving, driven) [m].

        Raises
        ------
        SectionVanished
            When wear is deeper than the tooth is thick, or leaves no flank.
        """
        self.check_thickness(wear)
        depth = wear + self.modification
        first, second = self.layouts
        return flank.worn_flank(first, depth[0]), flank.worn_flank(second, depth[1])

    def check_thickness(self, wear: Array) -> None:
        """Refuse wear (2, n) deeper than the tooth [m].

        Raises
        ------
        SectionVanished
            With the flank, the depth and the thickness.
        """
        too_deep = np.argwhere(wear >= self.thickness)
        if len(too_deep):
            gear, node = too_deep[0]
            name = self.pair.gears[gear].name
            depth = 1e3 * wear[gear, node]
            thickness = 1e3 * self.thickness[gear, node]
            raise stiffness.SectionVanished(
                f"{name}: wear of {depth:.4g} mm is deeper than the tooth, "
                f"{thickness:.4g} mm thick there along its normal"
            )


class MeetingGaps(NamedTuple):
    """Gaps at the points of both flanks that meet; beyond A and E, at the tip corners.

    Parameters
    ----------
    flanks : the flanks
    find : where (driving, driven) touch when the driving gear has turned to x (m,) [m]:
        first of all, or where :func:`searched` finds them
    wears_there : whether wear belongs to the points that touch, not to those of the
        unworn path
    """

    flanks: WornFlanks
    find: Callable[[flank.Flank, flank.Flank, Array], kinematics.FlankContact] = (
        minimum_gap.minimum_gap
    )
    wears_there: bool = True

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
    met = np.flatnonzero(np.isfinite(contact.gap))
    order = met[np.argsort(contact.x_driving[met])]
    turned = contact.x_driving[order]
    first = np.interp(x, turned, contact.driving[order])
    second = np.interp(x, turned, contact.driven[order])
    gap = np.interp(x, turned, contact.gap[order])
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
        """The nodes beyond A and beyond E, and the corner that touches there.

        The last position of each corner is the end of the path itself.
        """
        grid = self.flanks.grid
        before = slice(0, grid.on_flank.start)
        after = slice(grid.on_flank.stop, None)
        return (
            (before, self._corner("A", before, grid.position[0])),
            (after, self._corner("E", after, grid.position[-1])),
        )

    def _corner(self, end: str, nodes: slice, tip: float) -> Corner:
        """Return the corner of one end of the path, at the nodes beyond and the end."""
        grid = self.flanks.grid
        x = np.append(grid.contact_position[nodes], tip)
        return corner(self.flanks.pair, end, x, grid.position)

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
        for nodes, tip in self.corners:
            of_corner = tip.gap(removed)
            gap[..., nodes] += of_corner[..., :-1] - of_corner[..., -1:]
        return gap


Gaps = MeetingGaps | DisplacementBeyond
"""Where the gaps of worn flanks come from."""

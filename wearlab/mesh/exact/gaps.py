"""Gaps of the pairs as a contact analysis asks for them: exact, to first order, or by Y23's Algorithm 1."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh import profile, stiffness
from wearlab.mesh.corners import Corner, corner
from wearlab.mesh.exact import flank, kinematics, minimum_gap

PUBLISHED_POINTS = 1849
CENTRE_TOLERANCE = 1e-5
BLOCK = 64


def algorithm_1(
    pair: GearPair,
    driving: flank.Flank,
    driven: flank.Flank,
    points: int = PUBLISHED_POINTS,
    tolerance: float = CENTRE_TOLERANCE,
) -> kinematics.FlankContact:
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
    gamma1, R1, lam1 = flank.local_points(pair, 0, driving, s)
    gamma2, R2, lam2 = flank.local_points(pair, 1, driven, s)
    side = driving.side * driven.side
    contact = kinematics.FlankContact(s.copy(), *(np.full(points, np.nan) for _ in range(3)))
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
        radii = (self.pair.radius(i, self.grid.position) for i in (0, 1))
        return 2.0 * np.stack([contact_depth(*both) for both in zip(self.pair.gears, radii, strict=True)])

    def worn(self, wear: Array) -> tuple[flank.Flank, flank.Flank]:
        """Return both flanks with wear (2, n) (driving, driven) [m].

        Raises
        ------
        SectionVanished
            When wear is deeper than the tooth is thick, or leaves no flank.
        """
        self.check_thickness(wear)
        depth, s = wear + self.modification, self.grid.position
        try:
            first, second = (flank.worn_flank(self.pair, i, s, depth[i], self.runs) for i in (0, 1))
        except flank.OverhangingFlank as error:
            raise stiffness.SectionVanished(str(error)) from error
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
                f"{self.pair.gears[gear].name}: wear of {1e3 * wear[gear, node]:.4g} mm is deeper than the "
                f"tooth, {1e3 * self.thickness[gear, node]:.4g} mm thick there along its normal"
            )


@dataclass(frozen=True)
class MeetingGaps:
    """Gaps from the points of both flanks that meet, beyond A and E against the tip corners.

    Parameters
    ----------
    flanks : the flanks
    find : where (driving, driven) touch when the driving gear has turned to x (m,) [m]: first of all, or
        where :func:`searched` finds them
    """

    flanks: WornFlanks
    find: Callable[[flank.Flank, flank.Flank, Array], kinematics.FlankContact] = minimum_gap.minimum_gap

    def contact(self, wear: Array, x: Array) -> kinematics.FlankContact:
        """Return where a pair touches for wear (2, n) when the driving gear has turned to x (m,) [m]."""
        return self.find(*self.flanks.worn(wear), x)

    def at(self, wear: Array) -> Array:
        """Return the gap at every touching node for wear (2, n), (n_contact,) [m]."""
        return self.contact(wear, self.flanks.grid.contact_position).gap


def searched(
    pair: GearPair, points: int, driving: flank.Flank, driven: flank.Flank, x: Array
) -> kinematics.FlankContact:
    """Return where flanks touch by Y23's Algorithm 1, to half a step of its search.

    Between the points found it is interpolated; beyond the last of them their points and gap are kept.

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
    first, second, gap = (
        np.interp(x, contact.x_driving[order], values[order])
        for values in (contact.driving, contact.driven, contact.gap)
    )
    return kinematics.FlankContact(first, second, x, x - gap)


@dataclass(frozen=True)
class DisplacementBeyond:
    """First-order gaps on A–E, carried on beyond by those of the tip corners.

    Beyond A and E the corner's gap is shifted by the difference of the two forms at that end, so that the gap
    is continuous there. To first order flanks meet on the line of action.

    Parameters
    ----------
    flanks : the flanks
    """

    flanks: WornFlanks

    @cached_property
    def corners(self) -> tuple[tuple[slice, Corner], ...]:
        """The nodes beyond each end, and the corner that touches there; its last position is the end."""
        grid, inside, pair = self.flanks.grid, self.flanks.grid.on_flank, self.flanks.pair
        return tuple(
            (part, corner(pair, end, np.append(grid.contact_position[part], tip), grid.position))
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
        """Return the gap for material removed from the flanks (2, …, n), (…, n_contact) [m]."""
        gap = self.flanks.grid.beyond(removed.sum(axis=0))
        for part, tip in self.corners:
            least = tip.gap(removed)
            gap[..., part] += least[..., :-1] - least[..., -1:]
        return gap


Gaps = MeetingGaps | DisplacementBeyond
"""Where the gaps of worn flanks come from."""

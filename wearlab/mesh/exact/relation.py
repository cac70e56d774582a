"""The mesh relationship of worn flanks over a mesh period, exact and to first order."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wearlab.arrays import Array, Flags, Index
from wearlab.gears.gear import GearPair
from wearlab.mesh.exact import kinematics, minimum_gap
from wearlab.mesh.exact.flank import contact_angle, rotation_angle
from wearlab.mesh.exact.gaps import MeetingGaps, WornFlanks, end_of
from wearlab.mesh.stiffness import SectionVanished

SHARE_PHASES = 400
LONE_POINTS = 1849
"""Points of the driving flank at which a lone pair is sought; Y23's number."""


class MeshRelation(NamedTuple):
    """Where each pair of a mesh touches, and how far pairs are ahead.

    Parameters
    ----------
    contact_angle : (2, n_pairs, n) α of the touching points, (driving, driven); NaN
        apart [rad]
    rotation_angle : (2, n_pairs, n) φ of both gears when that pair alone touched [rad]
    gap : (n_pairs, n) gap of each pair, inf where its flanks do not meet [m]
    """

    contact_angle: Array
    rotation_angle: Array
    gap: Array

    @property
    def unloaded_error(self) -> Array:
        """Unloaded transmission error of the leading pair, up to a constant [m].

        ``r_b1 φ1 − r_b2 φ2``.
        """
        return np.asarray(self.gap.min(axis=0))

    def engaged_by_threshold(self, pair: GearPair, threshold: float) -> Flags:
        """Return which pairs are within an angle of the leading one, (n_pairs, n).

        The angle is one of the driven gear.

        Parameters
        ----------
        pair : the gears
        threshold : Δφ2 [rad]; 1e-4 in Y23
        """
        return np.asarray(
            self.gap - self.unloaded_error < threshold * pair.driven.base_radius
        )


def mesh_relation(
    gaps: MeetingGaps, wear: Array, phase: Array, numbers: Index
) -> MeshRelation:
    """Return where the pairs touch at phases, each on its own.

    Parameters
    ----------
    gaps : the pair, its nodes, and the method
    wear : (2, n) wear depth, (driving, driven) [m]
    phase : (m,) own phases of the mesh [1]
    numbers : (n_pairs,) which pairs j, touching at ``s_A + (φ + j) p_b`` when unworn;
        beyond the nodes they count as apart

    References
    ----------
    Y23, Algorithm 1; solved by roots, not by its search.
    """
    pair = gaps.flanks.pair
    reach = gaps.flanks.grid.contact_position
    x = pair.path.A + (phase + np.asarray(numbers)[:, None]) * pair.base_pitch
    near = (x >= reach[0]) & (x <= reach[-1])
    contact = gaps.contact(wear, x[near])
    touching = np.full((2, *x.shape), np.nan)
    turned = np.stack([x, np.full(x.shape, np.nan)])
    touching[:, near] = (contact.driving, contact.driven)
    turned[1, near] = contact.x_driven
    return MeshRelation(
        np.stack([contact_angle(pair, i, where) for i, where in enumerate(touching)]),
        np.stack([rotation_angle(pair, i, where) for i, where in enumerate(turned)]),
        np.where(near, x - turned[1], np.inf),
    )


def meshing_range(angles: Array, engaged: Flags) -> Array:
    """Return from where to where a quantity runs while a pair is engaged.

    Parameters
    ----------
    angles : (2, n_pairs, n) contact or rotation angles of both gears [rad]
    engaged : (n_pairs, n)

    Returns
    -------
    (2, 2) first and last value along the path, of (driving, driven) [rad]; NaN when
    nothing is engaged

    References
    ----------
    Y23, whose figures show these ranges.
    """
    if not engaged.any():
        return np.full((2, 2), np.nan)
    along = np.argwhere(engaged[::-1])
    first = along[0]
    last = along[-1]
    row = len(engaged) - 1
    return np.stack(
        [angles[:, row - pair, phase] for pair, phase in (first, last)], axis=1
    )


def lone_ranges(flanks: WornFlanks, wear: Array) -> tuple[Array, Array]:
    """Return over which angles a pair alone would touch with a common tangent.

    Parameters
    ----------
    flanks : the pair and its nodes
    wear : (2, n) wear depth, (driving, driven) [m]

    Returns
    -------
    contact angles α and rotation angles φ, each (2, 2): first and last of (driving,
    driven) [rad]

    References
    ----------
    Y23 Fig. 9: with wear α shrinks at the root, and φ grows.
    """
    pair = flanks.pair
    worn = flanks.worn(wear)
    position = np.linspace(pair.path.A, pair.path.E, LONE_POINTS)

    def has_partner(s: Array) -> Flags:
        return np.isfinite(kinematics.tangency(*worn, s).gap)

    have = np.flatnonzero(has_partner(position))
    if not len(have):
        return np.full((2, 2), np.nan), np.full((2, 2), np.nan)
    beyond = max(have[0] - 1, 0), min(have[-1] + 1, LONE_POINTS - 1)
    # how narrowly it is enclosed where a lone pair begins and ends [m]
    ends = [
        end_of(has_partner, position[inside], position[outside], 1e-12)
        for inside, outside in zip(have[[0, -1]], beyond, strict=True)
    ]
    contact = kinematics.tangency(*worn, np.array(ends))
    touched = [
        contact_angle(pair, i, s)
        for i, s in enumerate((contact.driving, contact.driven))
    ]
    turned = [
        rotation_angle(pair, i, x)
        for i, x in enumerate((contact.x_driving, contact.x_driven))
    ]
    return np.stack(touched), np.stack(turned)


def single_share(flanks: WornFlanks, wear: Array, threshold: float) -> float:
    """Return the share of the mesh period with one pair engaged, by Y23's rule [1].

    A pair is engaged while it would touch flank on flank, if need be beyond A and E,
    and lags the leading one by less than a threshold: with wear the share falls, as
    worn ends touch beyond the path, then rises.

    Parameters
    ----------
    flanks : the pair and its nodes
    wear : (2, n) wear depth, (driving, driven) [m]
    threshold : Δφ2 of the driven gear [rad]

    References
    ----------
    Y23, the multi-tooth mesh rule of 3.2.1.
    """
    pair = flanks.pair
    worn = flanks.worn(wear)
    contact = kinematics.tangency(
        *worn, np.linspace(pair.path.A, pair.path.E, LONE_POINTS)
    )
    alone = contact.x_driving[np.isfinite(contact.gap)]
    if not len(alone):
        return float("nan")
    phase = (np.arange(SHARE_PHASES) + 0.5) / SHARE_PHASES
    x = (
        pair.path.A
        + (phase + np.arange(-1, flanks.grid.max_pairs + 1)[:, None]) * pair.base_pitch
    )
    near = (x >= alone.min()) & (x <= alone.max())
    gap = np.full(x.shape, np.inf)
    gap[near] = minimum_gap.minimum_gap(*worn, x[near]).gap
    return float(
        np.mean(
            (gap - gap.min(axis=0) < threshold * pair.driven.base_radius).sum(axis=0)
            == 1
        )
    )


def contact_loss(pair: GearPair, angles: Array, engaged: Flags) -> Array:
    """Return the share of each active flank that never touches while engaged, (2,) [1].

    Parameters
    ----------
    pair : the gears
    angles : (2, n_pairs, n) contact angles [rad]
    engaged : (n_pairs, n)
    """
    ends = np.array([pair.path.A, pair.path.E])
    if not engaged.any():
        return np.ones(2)
    low, high = np.sort([contact_angle(pair, gear, ends) for gear in (0, 1)], axis=1).T
    touched = angles[:, engaged]
    covered = np.minimum(high, touched.max(axis=1)) - np.maximum(
        low, touched.min(axis=1)
    )
    return np.maximum(0.0, 1.0 - covered / (high - low))


AGREEMENT = 0.05
SHALLOWEST, DEEPEST = 1e-8, 1e-3
SAME_DEPTH = 1e-8
"""Difference of depths, over the depth, that is none [1]."""


def first_order_excess(flanks: WornFlanks, wear: Array) -> float:
    """Return the relative error of the largest unloaded error by first-order gaps [1].

    Parameters
    ----------
    flanks : the pair and its nodes
    wear : (2, n) [m]

    References
    ----------
    Y23 Eq. 62 for the exact one, there as an angle of the driven gear.
    """
    grid = flanks.grid
    displacement = grid.beyond((wear + flanks.modification).sum(axis=0))
    exact = minimum_gap.minimum_gap(*flanks.worn(wear), grid.contact_position).gap
    pairs = grid.pairs_at_phase_nodes
    first = np.where(pairs >= 0, displacement[pairs], np.inf).min(axis=1).max()
    true = np.where(pairs >= 0, exact[pairs], np.inf).min(axis=1).max()
    return float(first / true - 1.0)


def depth_of_disagreement(
    flanks: WornFlanks, shape: Array, share: float = AGREEMENT
) -> float:
    """Return the depth beyond which the first-order error is off by a share.

    Parameters
    ----------
    flanks : the pair and its nodes
    shape : (2, n) wear over its largest depth, (driving, driven) [1]
    share : of the exact error [1]

    Returns
    -------
    largest depth of the shape [m]; inf when both agree up to ``DEEPEST``, or as deep as
    flanks of this shape can be worn
    """

    def excess(depth: float) -> float:
        try:
            return abs(first_order_excess(flanks, depth * shape))
        except SectionVanished:
            return np.inf

    deepest = DEEPEST
    beyond = excess(deepest)
    if beyond < share:
        return np.inf
    shallowest = SHALLOWEST
    while not np.isfinite(beyond) and deepest > (1.0 + SAME_DEPTH) * shallowest:
        middle = float(np.sqrt(shallowest * deepest))
        found = excess(middle)
        if found < share:
            shallowest = middle
        else:
            deepest = middle
            beyond = found
    if not np.isfinite(beyond):
        return np.inf
    if excess(shallowest) >= share:
        return shallowest
    logarithm = brentq(
        lambda log_depth: excess(float(np.exp(log_depth))) - share,
        np.log(shallowest),
        np.log(deepest),
        xtol=SAME_DEPTH,
    )
    return float(np.exp(logarithm))

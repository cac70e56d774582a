"""A worn flank as a plane curve, of external and internal gears, driving and driven.

Coordinates are (n, u): u along the line of action as the driving gear pushes, n normal
to it, the origin at the pitch point. The flank point that would touch at path position
s if it were not worn lies, after its gear has turned to the position x [m along the
line of action], at

    P = O + R(κ) (t r_b, t ρ_0 + s + w(s)),   κ = t (x − s) / r_b,   O = −(t r_b, t
    ρ_0),

with R(κ) a rotation, ρ_0 = r_b tanα_w, and t = ±1 the side of its base circle on which
the gear lies: +1 for an external driving or an internal driven gear, −1 for an external
driven or an internal driving one. Wear moves the point along the healthy normal u: w =
−h on the driving flank, w = +h on the driven one.

Contact is also given in Y23's angles, α on the flank and φ of the gear. A gear's axis X
runs along the centre line of a tooth, a ring's along that of a tooth space; φ is
counted forwards from the line of centres. For an internal pair without shifts ``r_b1 φ1
= r_b2 φ2`` unworn; for others a constant lies between them, and errors are given as
differences x_driving − x_driven instead.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.gears.gear import DRIVING, GearPair
from wearlab.gears.shifts import involute
from wearlab.mesh.profile import BY_QUARTIC, ProfileGrid, slope_at
from wearlab.mesh.stiffness import SectionVanished


class OverhangingFlank(SectionVanished):
    """A flank worn too far: it overhangs, or wear reaches its base circle."""


class Flank(NamedTuple):
    """A worn flank from where its involute begins to its tip corner, piecewise cubic.

    Intervals ascend along the path; within a piece the wear is smooth, between pieces
    it may bend or jump.

    Parameters
    ----------
    base_radius, curvature : r_b and ρ_0, the radius of curvature at the pitch point [m]
    side : t, ±1
    start, width : (m,) where each interval begins on the path, and its length [m]
    shift : (m, 2) w at both ends of each interval [m]
    slope : (m, 2) dw/ds there [1]
    reached : (m, 2) s + w there [m]
    piece : (n_pieces + 1,) first interval of each piece, and m
    """

    base_radius: float
    curvature: float
    side: float
    start: Array
    width: Array
    shift: Array
    slope: Array
    reached: Array
    piece: Index


class Involute(NamedTuple):
    """A flank that is not worn.

    Parameters
    ----------
    base_radius, curvature : r_b and ρ_0, the radius of curvature at the pitch point [m]
    side : t, +1 when the radius of curvature grows along the path, −1 when it falls
    """

    base_radius: float
    curvature: float
    side: float


def involute_of(pair: GearPair, gear: int) -> Involute:
    """Return the unworn flank of a gear.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    """
    base_radius = pair.gears[gear].base_radius
    curvature = base_radius * math.tan(pair.working_pressure_angle)
    rho_pitch, rho_end = pair.curvature(np.array([0.0, pair.path.E]))[gear]
    side = 1.0 if rho_end > rho_pitch else -1.0
    return Involute(base_radius, curvature, side)


def smooth_runs(grid: ProfileGrid) -> list[slice]:
    """Return the smooth runs of nodes on A–E, from one break to the next.

    Parameters
    ----------
    grid : the nodes
    """
    begin = grid.first - grid.before
    end = begin + grid.intervals[:, None] + 1
    on_flank = (begin >= 0) & (begin < len(grid.position))
    runs = sorted(zip(begin[on_flank], end[on_flank], strict=True))
    return [slice(first, last) for first, last in runs]


def healthy_reach(pair: GearPair, gear: int) -> tuple[float, float]:
    """Return the path positions between which a flank can be touched.

    They run from below its active part to its tip. Below the active part that is a
    tenth of a base pitch, if the involute reaches so far and stays well off its base
    circle: no deeper can a worn or deflected mate's tip corner come.

    Parameters
    ----------
    pair : the pair
    gear : 0 driving, 1 driven

    Returns
    -------
    begin and end, one of them A or E, the tip [m]
    """
    body = pair.gears[gear]
    path = pair.path
    tip, start = (path.E, path.A) if gear == DRIVING else (path.A, path.E)
    rho_tip, rho_start = pair.curvature(np.array([tip, start]))[gear]
    rho_form = math.sqrt(max(body.form_radius**2 - body.base_radius**2, 0.0))

    # how far the involute is described below its active part, as radius of curvature
    if rho_start < rho_tip:
        length = rho_start - max(rho_form, 0.5 * rho_start)
    else:
        length = -(rho_start - rho_form)
    below = min(max(length, 0.0), 0.1 * pair.base_pitch)

    if gear == DRIVING:
        return path.A - below, path.E
    return path.A, path.E + below


class FlankLayout(NamedTuple):
    """What wear does not change of a flank: its intervals, and the nodes at their ends.

    Parameters
    ----------
    gear : 0 driving, 1 driven
    involute : the unworn flank
    start, width : (m,) where each interval begins on the path, and its length [m]
    node : (m, 2) nodes whose wear both ends of each interval have
    first_sloping : first interval within a run; those before and after the runs are
        shifted evenly
    runs : (n_runs, 2) first node of each smooth run, and the one after its last
    spacing : (n_runs,) of the nodes of each run [m]
    piece : (n_pieces + 1,) first interval of each piece, and m
    """

    gear: int
    involute: Involute
    start: Array
    width: Array
    node: Index
    first_sloping: int
    runs: Index
    spacing: Array
    piece: Index


def flank_layout(pair: GearPair, gear: int, grid: ProfileGrid) -> FlankLayout:
    """Return the layout of a flank: smooth runs of nodes, even beyond both ends.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    grid : the nodes, five or more in each run, equally spaced
    """
    position = grid.position
    last = len(position) - 1
    begin, end = healthy_reach(pair, gear)
    runs = np.array([(run.start, run.stop) for run in smooth_runs(grid)])

    ends = [position[first:stop] for first, stop in runs]
    nodes = [np.arange(first, stop) for first, stop in runs]
    is_longer = begin < position[0]
    if is_longer:
        ends.insert(0, np.array([begin, position[0]]))
        nodes.insert(0, np.zeros(2, np.int64))
    if end > position[last]:
        ends.append(np.array([position[last], end]))
        nodes.append(np.full(2, last))

    start = np.concatenate([piece[:-1] for piece in ends])
    return FlankLayout(
        gear=gear,
        involute=involute_of(pair, gear),
        start=start,
        width=np.concatenate([piece[1:] for piece in ends]) - start,
        node=np.concatenate(
            [np.stack([piece[:-1], piece[1:]], axis=1) for piece in nodes]
        ),
        first_sloping=int(is_longer),
        runs=runs,
        spacing=position[runs[:, 0] + 1] - position[runs[:, 0]],
        piece=np.cumsum([0, *(len(piece) - 1 for piece in ends)]),
    )


def worn_flank(layout: FlankLayout, depth: Array) -> Flank:
    """Return the flank with material removed at the nodes.

    Between the nodes it is a cubic with slopes of fourth order. Between the form circle
    and the active flank nothing touches in ideal contact; there the flank is taken to
    be as low as where the active flank begins, so that no ridge stands in the way of
    the mating tip.

    Parameters
    ----------
    layout : of the flank
    depth : (n,) material removed along the normal at the nodes, wear and modification
        [m]

    Raises
    ------
    OverhangingFlank
        Where the flank overhangs, or wear reaches the base circle.
    """
    of_nodes = np.asarray(-depth if layout.gear == DRIVING else depth, dtype=float)
    shift = of_nodes[layout.node]
    slope = np.zeros(shift.shape)
    _fill_slopes(of_nodes, layout.runs, layout.spacing, layout.first_sloping, slope)
    at_ends = np.stack([layout.start, layout.start + layout.width], axis=1)
    flank = Flank(
        base_radius=layout.involute.base_radius,
        curvature=layout.involute.curvature,
        side=layout.involute.side,
        start=layout.start,
        width=layout.width,
        shift=shift,
        slope=slope,
        reached=at_ends + shift,
        piece=layout.piece,
    )
    _check_shape(flank)
    return flank


@jit(counted=False)
def _fill_slopes(
    shift: Array, runs: Index, spacing: Array, interval: int, slope: Array
) -> None:
    """Fill dw/ds at both ends of the intervals of all runs, see `slope_at`.

    Parameters
    ----------
    shift : (n,) w at the nodes [m]
    runs, spacing : of the nodes, see `FlankLayout`
    interval : the first interval of the first run
    slope : (m, 2) filled [1]
    """
    for run in range(len(runs)):
        first = runs[run, 0]
        last = runs[run, 1] - 1
        for node in range(first, last + 1):
            rise = slope_at(shift, first, last, node, BY_QUARTIC)
            before = interval + node - first
            if node < last:
                slope[before, 0] = rise / spacing[run]
            if node > first:
                slope[before - 1, 1] = rise / spacing[run]
        interval += last - first


def _check_shape(flank: Flank) -> None:
    """Refuse a flank that overhangs, or is worn down to its base circle."""
    steepest = steepest_shift(flank.width, flank.shift, flank.slope)
    if steepest <= -1.0:
        raise OverhangingFlank(
            f"the worn flank overhangs: its wear changes by {-steepest:.3g} m per m "
            "of path; give wear "
            "that varies over a longer part of the flank"
        )
    rho = flank.curvature + flank.side * flank.reached
    if rho.min() <= 0.0:
        raise OverhangingFlank(
            f"wear reaches {-1e3 * rho.min():.3g} mm below the base circle"
        )


@jit(counted=False)
def steepest_shift(width: Array, shift: Array, slope: Array) -> float:
    """Return the smallest dw/ds over all intervals [1].

    Within an interval dw/ds is a parabola, whose vertex may lie below both ends.

    Parameters
    ----------
    width : (m,) of the intervals [m]
    shift, slope : (m, 2) w [m] and dw/ds [1] at both ends of each
    """
    lowest = math.inf
    for k in range(len(width)):
        begin = slope[k, 0]
        end = slope[k, 1]
        secant = (shift[k, 1] - shift[k, 0]) / width[k]
        rise = 3.0 * secant - 2.0 * begin - end
        bend = 3.0 * (begin + end - 2.0 * secant)
        lowest = min(lowest, begin, end)
        if bend != 0.0 and 0.0 < -rise / bend < 1.0:
            lowest = min(lowest, begin - rise * rise / bend)
    return lowest


@jit(counted=False)
def shift_at(flank: Flank, k: int, s: float) -> tuple[float, float]:
    """Return w [m] and dw/ds [1] at s in interval k, by Hermite's cubic.

    Parameters
    ----------
    flank : the worn flank
    k : number of the interval
    s : path position [m]
    """
    width = flank.width[k]
    t = (s - flank.start[k]) / width
    w0 = flank.shift[k, 0]
    w1 = flank.shift[k, 1]
    d0 = flank.slope[k, 0]
    d1 = flank.slope[k, 1]

    rise = (w1 - w0) / width
    b = 3.0 * rise - 2.0 * d0 - d1
    c = d0 + d1 - 2.0 * rise
    shift = w0 + width * t * (d0 + t * (b + t * c))
    slope = d0 + t * (2.0 * b + 3.0 * c * t)
    return shift, slope


@jit(counted=False)
def interval_of(flank: Flank, s: float) -> int:
    """Return the interval that contains s, the first or last one beyond the ends."""
    low = 0
    high = len(flank.start)
    while high - low > 1:
        middle = (low + high) // 2
        if flank.start[middle] <= s:
            low = middle
        else:
            high = middle
    return low


def contact_angle(pair: GearPair, gear: int, position: ArrayLike) -> Array:
    """Return the angle of a flank point, α = ρ/r_b − α2 [rad].

    Y23's α1 (driving) and α1′ (driven).

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    position : (n,) path position at which the point touches unworn [m]
    """
    body = pair.gears[gear]
    rho = pair.curvature(position)[gear]
    return np.asarray(rho / body.base_radius - body.base_half_angle)


def rotation_angle(pair: GearPair, gear: int, x: ArrayLike) -> Array:
    """Return the rotation φ of a gear's axis X from the line of centres [rad].

    ``φ = x / r_b + t (inv α_w − α2)`` with t as in :mod:`.flank`: for zero wear of an
    internal pair ``φ = α − α_w``.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    x : (n,) position to which the gear has turned [m along the line of action]

    References
    ----------
    Y23, for φ.
    """
    turned = np.asarray(x, float) / pair.gears[gear].base_radius
    return turned + _rotation_at_pitch_point(pair, gear)


def position_of(pair: GearPair, gear: int, angle: ArrayLike) -> Array:
    """Return the position x to which a gear with rotation φ has turned, (n,) [m].

    It is counted along the line of action.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    angle : (n,) rotation φ from the line of centres [rad]

    References
    ----------
    Y23, for φ.
    """
    turned = np.asarray(angle, float) - _rotation_at_pitch_point(pair, gear)
    return np.asarray(pair.gears[gear].base_radius * turned)


def _rotation_at_pitch_point(pair: GearPair, gear: int) -> float:
    """Return the rotation φ of a gear whose unworn flank touches at the pitch point."""
    side = involute_of(pair, gear).side
    polar_angle = involute(pair.working_pressure_angle)
    return side * (polar_angle - pair.gears[gear].base_half_angle)


def local_points(
    pair: GearPair, gear: int, flank: Flank, position: Array
) -> tuple[Array, Array, Array]:
    """Return points of a worn flank in the tooth's axes.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    flank : the gear's worn flank
    position : (n,) path positions at which the points touch unworn [m]

    Returns
    -------
    polar angle γ [rad], radius R [m] and angle of the normal λ [rad], each (n,)

    References
    ----------
    Y23 Eqs. 1–8 (γ, R) and 18–23 (λ), with wear along the flank normal.
    """
    shifts = [shift_at(flank, interval_of(flank, s), s) for s in position]
    shift, slope = np.array(shifts).T
    r_b = flank.base_radius
    rho = flank.curvature + flank.side * (position + shift)
    alpha = contact_angle(pair, gear, position)
    tilt = np.arctan(slope * r_b / rho)
    gamma = np.arctan2(rho, r_b) - alpha
    return gamma, np.hypot(r_b, rho), alpha - tilt


def wear_slope(pair: GearPair, gear: int, grid: ProfileGrid, depth: Array) -> Array:
    """Return the slope of the wear depth in the tooth's axes, ``dh_x/dx``, (…, n) [1].

    ``h_x = h/cos α`` across the tooth, over the height x along its centre line, ``dx/ds
    = t ρ cos α/r_b``; to first order in the depth over the radius of curvature.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    grid : nodes of the flanks
    depth : (…, n) wear along the flank normal [m]

    References
    ----------
    Y23 Eqs. 19–23, Fig. 8: positive where wear deepens outwards.
    """
    base_radius, curvature, side = involute_of(pair, gear)
    cosine = np.cos(contact_angle(pair, gear, grid.position))
    across = depth / cosine
    rate = np.empty(depth.shape)
    for run in smooth_runs(grid):
        position = grid.position[run]
        rate[..., run] = np.gradient(across[..., run], position, axis=-1, edge_order=2)

    rho = curvature + side * grid.position
    return np.asarray(rate * base_radius / (side * rho * cosine))

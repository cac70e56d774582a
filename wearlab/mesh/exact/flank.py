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
from wearlab.mesh.profile import BY_QUARTIC, ProfileGrid, slopes
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


class _Piece(NamedTuple):
    """Part of a flank on which its wear is smooth, at its (n,) nodes.

    Parameters
    ----------
    position : path positions [m]
    shift : w [m]
    slope : dw/ds [1]
    """

    position: Array
    shift: Array
    slope: Array


def _straight(begin: float, end: float, shift: float) -> _Piece:
    """Return a piece on which the flank is shifted evenly."""
    return _Piece(np.array([begin, end]), np.full(2, shift), np.zeros(2))


def _pieces(
    position: Array, shift: Array, runs: list[slice], reach: tuple[float, float]
) -> list[_Piece]:
    """Return the pieces of a flank, in ascending order.

    Parameters
    ----------
    position : (n,) path positions of the nodes, A to E [m]
    shift : (n,) w at the nodes [m]
    runs : smooth runs of nodes
    reach : path positions where the flank begins and ends [m]
    """
    pieces = []
    for run in runs:
        nodes = position[run]
        slope = slopes(shift[run], BY_QUARTIC) / (nodes[1] - nodes[0])
        pieces.append(_Piece(nodes, shift[run], slope))

    begin, end = reach
    if begin < position[0]:
        pieces.insert(0, _straight(begin, position[0], shift[0]))
    if end > position[-1]:
        pieces.append(_straight(position[-1], end, shift[-1]))
    return pieces


def _interval_ends(runs: list[Array]) -> Array:
    """Return the values at both ends of all intervals, (m, 2), from runs of nodes."""
    return np.concatenate([np.stack([run[:-1], run[1:]], axis=1) for run in runs])


def worn_flank(
    pair: GearPair, gear: int, position: Array, depth: Array, runs: list[slice]
) -> Flank:
    """Return the flank with material removed at the nodes.

    Between the nodes it is a cubic with slopes of fourth order. Between the form circle
    and the active flank nothing touches in ideal contact; there the flank is taken to
    be as low as where the active flank begins, so that no ridge stands in the way of
    the mating tip.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    position : (n,) path positions of the nodes, A to E [m]
    depth : (n,) material removed along the normal, wear and modification [m]
    runs : smooth runs of nodes, each of five or more, equally spaced

    Raises
    ------
    OverhangingFlank
        Where the flank overhangs, or wear reaches the base circle.
    """
    shift = np.asarray(-depth if gear == DRIVING else depth, dtype=float)
    pieces = _pieces(position, shift, runs, healthy_reach(pair, gear))

    s = _interval_ends([piece.position for piece in pieces])
    shift_at_ends = _interval_ends([piece.shift for piece in pieces])
    n_intervals = [len(piece.position) - 1 for piece in pieces]
    unworn = involute_of(pair, gear)
    flank = Flank(
        base_radius=unworn.base_radius,
        curvature=unworn.curvature,
        side=unworn.side,
        start=np.ascontiguousarray(s[:, 0]),
        width=s[:, 1] - s[:, 0],
        shift=shift_at_ends,
        slope=_interval_ends([piece.slope for piece in pieces]),
        reached=s + shift_at_ends,
        piece=np.cumsum([0, *n_intervals]),
    )
    _check_shape(flank)
    return flank


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


def steepest_shift(width: Array, shift: Array, slope: Array) -> float:
    """Return the smallest dw/ds over all intervals [1].

    Within an interval dw/ds is a parabola, whose vertex may lie below both ends.

    Parameters
    ----------
    width : (m,) of the intervals [m]
    shift, slope : (m, 2) w [m] and dw/ds [1] at both ends of each
    """
    d0, d1 = slope.T
    secant = np.diff(shift, axis=1)[:, 0] / width
    rise = 3.0 * secant - 2.0 * d0 - d1
    bend = 3.0 * (d0 + d1 - 2.0 * secant)

    t = np.divide(-rise, bend, out=np.zeros_like(bend), where=bend != 0.0)
    at_vertex = d0 + t * (2.0 * rise + bend * t)
    is_inside = (t > 0.0) & (t < 1.0)
    lowest = np.where(is_inside, at_vertex, np.inf).min()
    return float(min(slope.min(), lowest))


@jit
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


@jit
def interval_of(flank: Flank, s: float) -> int:
    """Return the interval that contains s, the first or last one beyond the ends."""
    return max(0, int(np.searchsorted(flank.start, s, side="right")) - 1)


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

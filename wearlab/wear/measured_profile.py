"""Flanks worn before the first cycle as measured: depths from profile points."""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears import helix
from wearlab.gears.gear import GearPair
from wearlab.gears.specification import GearError
from wearlab.mesh.stiffness import PiecewiseCurve
from wearlab.tables.flank_zero import zero_line

Along = Literal["diameter", "roll_angle", "roll_length", "path_position"]
Continuation = Literal["refuse", "hold", "slope", "zero"]
Zero = Literal["as-measured", "max", "pitch", "tip", "root", "line"]

SLACK = 1e-3
"""Share of the active path by which a measured profile may miss its ends."""
NOISE = 0.02
"""Share of the largest depth by which a measured profile may stand above its zero; it
counts as unworn."""
MIN_NOISE = 1e-7
MIN_POINTS = 5
GOES_ON = "or say how it goes on: continuation = 'hold', 'slope' or 'zero'"
END_SHARE = 0.1
"""Share of a measured profile whose slope goes on beyond its end."""


class MeasuredProfile(NamedTuple):
    """A worn flank as it was measured.

    Parameters
    ----------
    along : what the abscissa is
    abscissa : (n,) diameter [m], roll angle [rad] or path position [m], rising or
        falling; a value that stands twice marks a step
    depth : (n,) wear, positive where material is gone [m]
    across : whether the depth is measured across the tooth's thickness, not along the
        flank normal
    zero : what counts as unworn: the values as they are, the highest point, the pitch
        point, the tip or the root end of the active flank, or the straight line over
        the path that touches the profile from outside on both sides of the pitch point
        (which takes out a tilt, too)
    smooth : window of a local parabola along the path, None: through every point [m]
    continuation : beyond its ends, where they miss those of the active flank: refused,
        the last value, the slope of the last `END_SHARE`, or unworn
    """

    along: Along
    abscissa: Array
    depth: Array
    across: bool = False
    zero: Zero = "as-measured"
    smooth: float | None = None
    continuation: Continuation = "refuse"


def measured(
    profile: MeasuredProfile, pair: GearPair, gear: int, position: ArrayLike
) -> Array:
    """Return the wear depth of a measured flank at the nodes of its active part.

    Parameters
    ----------
    profile : the measurement
    pair, gear : the pair; 0 driving, 1 driven
    position : (n,) path positions of the nodes, A to E, twice where wear may jump [m]

    Returns
    -------
    (n,) depth along the flank normal, ≥ 0 [m]

    Raises
    ------
    GearError
        When the profile leaves the involute, does not cover the active flank, or stands
        above its zero.
    """
    s = np.asarray(position, float)
    depth = nodal(profile, pair, gear, s)
    depth = depth - zero_line(profile.zero, gear, s, depth)
    where = "profile at diameter {:.6g} mm", 2e3 * pair.radius(gear, s)
    name = pair.gears[gear].name
    return _worn(depth, name, profile.zero, where, "'max' or 'line'")


def removed_on_purpose(
    pair: GearPair,
    gear: int,
    position: ArrayLike,
    flank: helix.SlicedFlank | None = None,
    place: float = 0.0,
) -> Array:
    """Return what the drawing takes off where a profile was measured, (n,) [m].

    Normal to the flank.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    position : (n,) on the path [m]
    flank : with its relief over the face, None of gears without one
    place : across the face, from its middle [m]
    """
    of_profile = pair.modification(gear, np.asarray(position, float))
    if flank is None:
        return of_profile
    share = pair.from_root(gear, np.asarray(position, float))
    lead = flank.lead.removed([place], share, flank.width)[0]
    return np.asarray(of_profile * flank.cosine + lead)


def nodal(profile: MeasuredProfile, pair: GearPair, gear: int, s: Array) -> Array:
    """Return what was measured at the nodes, before its zero, (n,) [m].

    Without overshoot, keeping steps; or by local parabolas.
    """
    where = path_position(pair, gear, profile.along, profile.abscissa)
    rising = slice(None, None, -1 if where[-1] < where[0] else 1)
    where = where[rising]
    depth = np.asarray(profile.depth, float)[rising]
    where, depth = continued(
        where, depth, pair.path.A, pair.path.E, profile.continuation
    )
    _check_cover(where, pair, gear, profile.along)
    # by the angle between flank normal and thickness, a ring's: across the tooth space
    if profile.across:
        depth = depth * np.cos(
            pair.roll_angle(gear, where) - pair.gears[gear].base_half_angle
        )
    if profile.smooth is not None:
        return np.array([_local_parabola(where, depth, at, profile.smooth) for at in s])
    ahead = np.diff(s, append=s[-1])
    behind = np.diff(s, prepend=s[0])
    own_side = s + 0.25 * np.where(
        behind == 0.0, ahead, np.where(ahead == 0.0, -behind, 0.0)
    )  # of a step
    return PiecewiseCurve(where, depth).value(s, own_side)


def over_face(
    place: Array,
    depth: Array,
    name: str,
    flank: helix.SlicedFlank,
    how: tuple[Zero, Continuation],
) -> Array:
    """Return the depth of a flank measured over its face, at slices, (n_face, n) [m].

    Straight from one place to the next across the face.

    Parameters
    ----------
    place : (m,) from mid-face, ascending [m]
    depth : (m, n) material gone there, at each node of the profile or at one for all
        [m]
    name : of the gear
    flank : the slices
    how : zero, and continuation to the ends of the face

    Raises
    ------
    GearError
        Where it does not cover the face, or stands above its zero.
    """
    zero, continuation = how
    if zero not in ("as-measured", "max"):
        reason = (
            "is a profile's, and this flank was measured over its face: give "
            "'as-measured' or 'max'"
        )
        raise GearError(f"{name}: zero = {zero!r} {reason}")
    ends = float(flank.position[0]), float(flank.position[-1])
    slack = SLACK * flank.width
    if continuation == "refuse" and (
        place[0] > ends[0] + slack or place[-1] < ends[1] - slack
    ):
        covers = (
            f"covers face positions {1e3 * place[0]:.4g} to {1e3 * place[-1]:.4g} mm"
        )
        slices = f"the slices {1e3 * ends[0]:.4g} to {1e3 * ends[1]:.4g} mm"
        remedy = (
            "measure all of the face, check face_position, counted from mid-face, and "
            "its unit"
        )
        raise GearError(
            f"{name}: what was measured {covers}, {slices}; {remedy}, {GOES_ON}"
        )
    curves = [continued(place, along, *ends, continuation) for along in depth.T]
    worn = np.stack([np.interp(flank.position, *curve) for curve in curves], axis=1)
    worn -= worn.min() if zero == "max" else 0.0
    where = (
        "shape at face position {:.4g} mm",
        1e3 * np.repeat(flank.position, worn.shape[1]),
    )
    return _worn(worn, name, zero, where, "'max'")


def _worn(
    depth: Array, name: str, zero: Zero, where: tuple[str, Array], instead: str
) -> Array:
    """Return depths of wear, ≥ 0; what stands hardly above its zero counts as unworn.

    Parameters
    ----------
    depth : measured, less its zero [m]
    name : of the gear
    zero : what counted as zero
    where : what stands above it, in words that take a place, and the places of all
        entries of the depths
    instead : what zero might be better
    """
    lowest = int(np.argmin(depth))
    above = -float(depth.flat[lowest])
    if above > max(MIN_NOISE, NOISE * float(depth.max())):
        standing = f"the measured flank stands {1e6 * above:.3g} µm above its unworn"
        remedy = (
            f"and wear adds no material; check the sign, or choose zero = {instead}"
        )
        place = where[0].format(where[1][lowest])
        raise GearError(f"{name}: with zero = {zero!r} {standing} {place}, {remedy}")
    return np.maximum(depth, 0.0)


def path_position(
    pair: GearPair, gear: int, along: Along, abscissa: ArrayLike
) -> Array:
    """Return the path position at which points of a flank touch, (n,) [m].

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    along : what the abscissa is
    abscissa : (n,) diameter [m], roll angle [rad], length of roll [m] or path position
        [m]

    Raises
    ------
    GearError
        When a diameter lies below the base circle.

    References
    ----------
    ISO 21771: roll angle and length of roll of a diameter.
    """
    x = np.asarray(abscissa, float)
    body = pair.gears[gear]
    curvature = x  # of a length of roll [m]
    if along == "diameter":
        square = (0.5 * x) ** 2 - body.base_radius**2
        if square.min() < 0.0:
            below = f"lies below the base circle, {2e3 * body.base_radius:.6g} mm"
            reason = (
                f"{body.name}: a measured diameter of {1e3 * x.min():.6g} mm {below}"
            )
            raise GearError(f"{reason}; leave out points off the involute")
        curvature = np.sqrt(square)
    elif along == "roll_angle":
        curvature = body.base_radius * x
    elif along != "roll_length":
        return x
    at_pitch, further = pair.curvature(np.array([0.0, 1.0]))[gear]
    return np.asarray((curvature - at_pitch) / (further - at_pitch))


def continued(
    where: Array, depth: Array, begin: float, end: float, how: Continuation
) -> tuple[Array, Array]:
    """Return a profile that reaches the ends of the active flank.

    Parameters
    ----------
    where, depth : (n,) rising path positions and depths [m]
    begin, end : of the active flank [m]
    how : leave it as it is, hold the last value, go on with the straight line through
        the last `END_SHARE`, or jump to zero
    """
    profile = np.stack([where, depth])
    goes_on = how != "refuse"
    leading = (
        _beyond(where, depth, 0, begin, how)
        if goes_on and where[0] > begin
        else profile[:, :0]
    )
    trailing = (
        _beyond(where, depth, -1, end, how)
        if goes_on and where[-1] < end
        else profile[:, :0]
    )
    x, y = np.concatenate([leading[:, ::-1], profile, trailing], axis=1)
    return x, y


def _beyond(
    where: Array, depth: Array, side: int, place: float, how: Continuation
) -> Array:
    """Return the points that lead from one side of a profile beyond it [m]."""
    edge = where[side]
    level = depth[side]
    if how == "zero":
        return np.array([[edge, place], [0.0, 0.0]])
    if how == "slope":
        near = np.abs(where - edge) <= max(
            END_SHARE * np.ptp(where), np.sort(np.abs(where - edge))[1]
        )
        slope, level = np.polyfit(where[near] - edge, depth[near], 1)
        level += slope * (place - edge)
    return np.array([[place], [level]])


def _check_cover(where: Array, pair: GearPair, gear: int, along: Along) -> None:
    begin = pair.path.A
    end = pair.path.E
    slack = SLACK * (end - begin)
    name = pair.gears[gear].name
    if where[0] > begin + slack or where[-1] < end - slack:
        shown = where[[0, -1]], np.array([begin, end])
        have, need = (
            [f"{2e3 * r:.6g}" for r in np.sort(pair.radius(gear, ends))]
            for ends in shown
        )
        covers = f"the measured profile covers diameters {have[0]} to {have[1]} mm"
        needs = f"the active flank {need[0]} to {need[1]} mm"
        remedy = f"measure all of it, check {along} and its unit"
        raise GearError(f"{name}: {covers}, {needs}; {remedy}, {GOES_ON}")
    inside = np.count_nonzero((where >= begin - slack) & (where <= end + slack))
    if inside < MIN_POINTS:
        few = f"{inside} measured points lie on the active flank"
        raise GearError(f"{name}: {few}; give {MIN_POINTS} or more")


def _local_parabola(where: Array, depth: Array, s: float, window: float) -> float:
    """Return the local parabola with tricube weights at s (Cleveland 1979)."""
    half = max(
        0.5 * window, float(np.sort(np.abs(where - s))[MIN_POINTS - 1]) * (1.0 + 1e-9)
    )
    distance = (where - s) / half
    near = np.abs(distance) < 1.0
    # square root of the weight
    t = distance[near]
    weight = (1.0 - np.abs(distance[near]) ** 3) ** 1.5
    matrix = np.stack([np.ones_like(t), t, t * t], axis=1) * weight[:, None]
    return float(np.linalg.lstsq(matrix, depth[near] * weight, rcond=None)[0][0])

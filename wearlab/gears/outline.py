"""The outline of one tooth: half thickness against height on the tooth's centre line.

Heights x are measured from the gear's centre along the tooth's centre line, half
thicknesses y across it. From the root circle to the form circle runs the root curve,
from there to the tip the involute; x rises on the way from root to tip, and falls in a
ring, whose teeth point inwards.

Teeth in mesh as a drawing are made of the outlines that the stiffness is computed with.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear, GearPair

VIEW_WIDTH = 9.0  # modules
VIEW_HEIGHT = 5.6  # modules
BODY_DEPTH = 3.0  # of what is drawn below the root circle, in modules
MAX_TEETH_BESIDE = 5  # drawn on each side of the one in mesh
CURVE_POINTS = 24
ARC_POINTS = 61
BODY_POINTS = 40


def load_angle(gear: Gear, radius: ArrayLike) -> Array:
    """Return the angle λ between the flank normal and the thickness direction.

    ``λ = ρ/r_b − α2``. In a ring, with α2 half the tooth space's angle at the base
    circle, ``λ = ρ/r_b − α2 + π/z``.

    Parameters
    ----------
    gear : the gear
    radius : (n,) radii on the involute [m]

    Returns
    -------
    (n,) λ [rad]; it grows linearly along the path of contact

    References
    ----------
    Y23, whose α1 is ``ρ/r_b − α2``.
    """
    rho = np.sqrt(
        np.maximum(np.asarray(radius, dtype=float) ** 2 - gear.base_radius**2, 0.0)
    )
    return rho / gear.base_radius - _start_angle(gear)


def _start_angle(gear: Gear) -> float:
    """Return the angle of the involute's start from the centre line [rad].

    This is α2, of a ring α2 − π/z.
    """
    if gear.internal:
        return gear.base_half_angle - math.pi / gear.teeth
    return gear.base_half_angle


def involute_point(gear: Gear, angle: ArrayLike) -> tuple[Array, Array]:
    """Return the point of the involute whose flank normal has the load angle λ.

    ``x = r_b [(λ + α2) sinλ + cosλ]``, ``y = r_b [(λ + α2) cosλ − sinλ]``; in a ring α2
    − π/z takes the place of α2, and y its sign the other way: the flank is that of the
    space beside the tooth.

    Parameters
    ----------
    gear : the gear
    angle : (n,) load angle λ [rad]

    Returns
    -------
    height x and half thickness y, each (n,) [m]

    References
    ----------
    Y23 Eq. 25 for y and Eq. 27 for x, without wear: its α1 is λ, its d is x − r_b
    cosα2.
    """
    lam = np.asarray(angle, dtype=float)
    rolled = lam + _start_angle(gear)
    sin = np.sin(lam)
    cos = np.cos(lam)
    r_b = gear.base_radius
    return r_b * (rolled * sin + cos), gear.outwards * r_b * (rolled * cos - sin)


def involute_rise(gear: Gear, angle: ArrayLike) -> Array:
    """Return the height gained per load angle on the involute, (n,) [m/rad].

    ``dx/dλ = r_b (λ + α2) cosλ``.

    Parameters
    ----------
    gear : the gear
    angle : (n,) load angle λ [rad]

    References
    ----------
    Y23 Eqs. 34–36, whose integrands hold (α2 − α) cosα with α = −λ.
    """
    lam = np.asarray(angle, dtype=float)
    return gear.base_radius * (lam + _start_angle(gear)) * np.cos(lam)


def root_half_angle(gear: Gear) -> float:
    """Return half the tooth angle θ_f where the root curve meets the root circle [rad].

    Parameters
    ----------
    gear : the gear

    References
    ----------
    Sainsot, Velex & Duverger 2004, for θ_f.
    """
    if gear.root_profile == "trochoid":
        return gear.cut.offset / gear.reference_radius
    if gear.root_profile == "radial":
        return gear.half_angle(max(gear.root_radius, gear.base_radius))
    return (
        gear.half_angle(gear.root_radius - gear.fillet_radius)
        + gear.fillet_radius / gear.base_radius
    )


def root_curve(gear: Gear, fraction: ArrayLike) -> tuple[Array, Array, Array]:
    """Return the root curve, from the root circle (0) to the form circle (1).

    Trochoid: the envelope of the rack's tip rounding, whose normal passes through the
    pitch point. With γ the normal's angle to the pitch line, a the depth of the
    rounding's centre below it and b its distance from the tooth's centre line, ``φ =
    (a/tanγ + b)/r``, ``D = a/sinγ + ρ``: ``x = r cosφ − D sin(γ − φ)``, ``y = r sinφ −
    D cos(γ − φ)``, from γ = π/2 (root) to γ = α (form), or to where a slight undercut
    meets the involute. Radial: the straight line from the root circle to the base
    circle, or a point where the involute reaches the root circle. Fillet (a ring's):
    the circle of radius ρ_F that touches the root circle at the half angle θ_f and the
    involute at its form radius, where the load angle is λ_F. With the direction τ from
    its centre, from θ_f to λ_F − π/2: ``x = (r_f − ρ_F) cosθ_f + ρ_F cosτ``, ``y = (r_f
    − ρ_F) sinθ_f + ρ_F sinτ``.

    Parameters
    ----------
    gear : the gear
    fraction : (n,) parameter in [0, 1]

    Returns
    -------
    height x, half thickness y, and dx/dfraction, each (n,) [m]

    References
    ----------
    Litvin & Fuentes, Gear Geometry and Applied Theory, 2nd ed., 6.4: generation by a
    rounded rack.
    """
    t = np.asarray(fraction, dtype=float)
    half = root_half_angle(gear)
    if gear.root_profile == "trochoid":
        span = gear.cut.last_angle() - math.pi / 2
        x, y, rise = gear.cut.point(math.pi / 2 + span * t)
        return x, y, rise * span
    if gear.root_profile == "radial":
        height = gear.form_radius - gear.root_radius
        radius = gear.root_radius + height * t
        return (
            radius * math.cos(half),
            radius * math.sin(half),
            np.full_like(t, height * math.cos(half)),
        )
    rho = gear.fillet_radius
    centre = gear.root_radius - rho
    span = float(load_angle(gear, gear.form_radius)) - math.pi / 2 - half
    tau = half + span * t
    x = centre * math.cos(half) + rho * np.cos(tau)
    y = centre * math.sin(half) + rho * np.sin(tau)
    return x, y, -rho * np.sin(tau) * span


def contact_depth(gear: Gear, radius: ArrayLike) -> Array:
    """Return the distance from the contact to the tooth's centre line, y/cosλ.

    It is measured along the line of action.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii on the involute [m]

    Returns
    -------
    (n,) [m]

    References
    ----------
    Weber & Banaschek 1953, for t_i.
    """
    lam = load_angle(gear, radius)
    return involute_point(gear, lam)[1] / np.cos(lam)


class ToothDrawing(NamedTuple):
    """An SVG's parts in modules about the pitch point, y downwards.

    Parameters
    ----------
    view : its viewBox
    bodies : outline of each gear with its name
    circles : pitch circles as paths
    line : ends of the path of contact
    points : letters A to E with their places
    """

    view: str
    bodies: tuple[tuple[str, str], ...]
    circles: tuple[str, ...]
    line: tuple[str, str, str, str]
    points: tuple[tuple[str, str, str], ...]


def half_tooth(gear: Gear) -> tuple[Array, Array]:
    """Return radii and angles from the tooth's centre line, from root to tip.

    Parameters
    ----------
    gear : the gear

    Returns
    -------
    radii [m] and angles [rad], each (n,)
    """
    fraction = np.linspace(0.0, 1.0, CURVE_POINTS)
    root_x, root_y, _ = root_curve(gear, fraction)
    first, last = load_angle(gear, np.array([gear.form_radius, gear.tip_radius]))
    involute_x, involute_y = involute_point(gear, first + (last - first) * fraction)
    x = np.concatenate([root_x, involute_x[1:]])
    y = np.concatenate([root_y, involute_y[1:]])
    return np.hypot(x, y), np.arctan2(y, x)


class _Placed(NamedTuple):
    """A gear in a drawing.

    Parameters
    ----------
    gear : the gear
    pitch_radius : of its working pitch circle [m]
    centre : place of its centre on the centre line, downwards [m]
    pitch_point : direction of the pitch point as seen from the centre [rad]
    side : 1 where the flank in contact is the one that `involute_point` describes
    """

    gear: Gear
    pitch_radius: float
    centre: float
    pitch_point: float
    side: float


def drawing(pair: GearPair) -> ToothDrawing:
    """Return the drawing of a pair whose flanks touch at the pitch point.

    The centre line runs downwards, the pinion's centre above the pitch point; its right
    flank drives.

    Parameters
    ----------
    pair : the gears in mesh
    """
    placed = _placed(pair)
    module = pair.driving.module
    points = _contact_points(pair)
    view = f"{-VIEW_WIDTH / 2:g} {-VIEW_HEIGHT / 2:g} {VIEW_WIDTH:g} {VIEW_HEIGHT:g}"
    return ToothDrawing(
        view=view,
        bodies=tuple((gear.gear.name, _body(gear, module)) for gear in placed),
        circles=tuple(_pitch_circle(gear, module) for gear in placed),
        line=(*points["A"], *points["E"]),
        points=tuple((name, *place) for name, place in points.items()),
    )


def _placed(pair: GearPair) -> tuple[_Placed, _Placed]:
    """Return the gears of a pair in a drawing, a ring last."""
    first, second = sorted(pair.gears, key=lambda gear: gear.internal)
    cos = math.cos(pair.working_pressure_angle)
    r1 = first.base_radius / cos
    r2 = second.base_radius / cos
    upwards = 0.0 if second.internal else math.pi
    return (
        _Placed(first, r1, centre=-r1, pitch_point=0.0, side=1.0),
        _Placed(
            second,
            r2,
            centre=second.outwards * r2,
            pitch_point=upwards,
            side=second.outwards,
        ),
    )


def _body(placed: _Placed, module: float) -> str:
    """Return the outline of a gear as a closed path through the pitch point."""
    gear = placed.gear
    x, y = involute_point(gear, load_angle(gear, placed.pitch_radius))
    turn = placed.pitch_point + placed.side * math.atan2(y, x)
    return _path(_outline(gear, turn), placed.centre, module) + " Z"


def _pitch_circle(placed: _Placed, module: float) -> str:
    """Return the part of a pitch circle that is seen, as a path."""
    radius = placed.pitch_radius
    sweep = min(math.pi, 2.0 * VIEW_WIDTH * module / radius)
    angle = placed.pitch_point + np.linspace(-0.5, 0.5, ARC_POINTS) * sweep
    return _path((np.full_like(angle, radius), angle), placed.centre, module)


def _contact_points(pair: GearPair) -> dict[str, tuple[str, str]]:
    """Return the points A to E of the path of contact: across and down, in modules."""
    sin = math.sin(pair.working_pressure_angle)
    cos = math.cos(pair.working_pressure_angle)
    points = {}
    for name, position in pair.path._asdict().items():
        s = pair.driving.outwards * position / pair.driving.module
        points[name] = (f"{-s * cos:.4f}", f"{s * sin:.4f}")
    return points


def _outline(gear: Gear, turn: float) -> tuple[Array, Array]:
    """Return radius and angle of teeth about the direction ``turn``, with the body.

    Radii are in [m], angles in [rad].
    """
    radius, angle = half_tooth(gear)
    pitch = 2.0 * math.pi / gear.teeth
    beside = min(MAX_TEETH_BESIDE, (gear.teeth - 1) // 2)
    centre_lines = turn + pitch * np.arange(-beside, beside + 1)[:, None]
    tooth_angle = np.concatenate([-angle, angle[::-1]])
    tooth_radius = np.concatenate([radius, radius[::-1]])
    teeth_angle = (centre_lines + tooth_angle).ravel()
    teeth_radius = np.tile(tooth_radius, len(centre_lines))

    half_span = (beside + 0.5) * pitch
    body_angle = turn + half_span * np.linspace(1.0, -1.0, BODY_POINTS)
    depth = gear.outwards * BODY_DEPTH * gear.module
    body_radius = np.full_like(body_angle, max(radius[0] - depth, 0.0))
    return (
        np.concatenate([teeth_radius, body_radius]),
        np.concatenate([teeth_angle, body_angle]),
    )


def _path(points: tuple[Array, Array], centre: float, module: float) -> str:
    """Return an SVG path of radii and angles about a centre, in modules.

    The centre line runs downwards.
    """
    radius, angle = points
    down = (centre + radius * np.cos(angle)) / module
    across = radius * np.sin(angle) / module
    return "M" + " L".join(
        f"{x:.4f} {y:.4f}" for x, y in zip(across, down, strict=True)
    )

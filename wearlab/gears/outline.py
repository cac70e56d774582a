"""The outline of one tooth: half thickness against height, on the tooth's own centre line.

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


def load_angle(gear: Gear, radius: ArrayLike) -> Array:
    """Return the angle between the flank normal and the thickness direction, λ = ρ/r_b − α2.

    In a ring, with α2 half the tooth space's angle at the base circle, λ = ρ/r_b − α2 +
    π/z.

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
    """Return α2, and α2 − π/z of a ring: how far the involute's start stands from the centre line [rad]."""
    return (
        gear.base_half_angle - math.pi / gear.teeth
        if gear.internal
        else gear.base_half_angle
    )


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
    """Return the height gained per load angle on the involute, dx/dλ = r_b (λ + α2) cosλ, (n,) [m/rad].

    References
    ----------
    Y23 Eqs. 34–36, whose integrands hold (α2 − α) cosα with α = −λ.
    """
    lam = np.asarray(angle, dtype=float)
    return gear.base_radius * (lam + _start_angle(gear)) * np.cos(lam)


def root_half_angle(gear: Gear) -> float:
    """Return half the tooth angle where the root curve meets the root circle, θ_f [rad].

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
    """Return the distance along the line of action from the contact to the tooth's centre line, y/cosλ.

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


WIDE, HIGH = 9.0, 5.6  # of what is seen, in modules


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
    """Return radius and angle from the tooth's centre line, from root to tip, each (n,) [m], [rad]."""
    t = np.linspace(0.0, 1.0, 24)
    x, y, _ = root_curve(gear, t)
    ends = load_angle(gear, np.array([gear.form_radius, gear.tip_radius]))
    along = involute_point(gear, ends[0] + (ends[1] - ends[0]) * t)
    x = np.concatenate([x, along[0][1:]])
    y = np.concatenate([y, along[1][1:]])
    return np.hypot(x, y), np.arctan2(y, x)


def drawing(pair: GearPair) -> ToothDrawing:
    """Return the drawing of a pair whose flanks touch at the pitch point.

    The centre line runs downwards, the pinion's centre above the pitch point; its right
    flank drives.
    """
    first, second = sorted(pair.gears, key=lambda gear: gear.internal)
    module = first.module
    angle = pair.working_pressure_angle
    r1 = first.base_radius / math.cos(angle)
    r2 = second.base_radius / math.cos(angle)
    bodies = []
    circles = []
    sweep = np.linspace(-0.5, 0.5, 61)
    for gear, radius, middle, towards, side in (
        (first, r1, -r1, 0.0, 1.0),
        (
            second,
            r2,
            second.outwards * r2,
            0.0 if second.internal else math.pi,
            second.outwards,
        ),
    ):
        x, y = involute_point(gear, load_angle(gear, radius))
        teeth = _outline(gear, towards + side * math.atan2(y, x))
        bodies.append((gear.name, _path(teeth, middle, module) + " Z"))
        arc = towards + sweep * min(math.pi, 2.0 * WIDE * module / radius)
        circles.append(_path((np.full_like(arc, radius), arc), middle, module))
    places = {
        name: pair.driving.outwards * s / module
        for name, s in pair.path._asdict().items()
    }
    place = {
        name: (f"{-s * math.cos(angle):.4f}", f"{s * math.sin(angle):.4f}")
        for name, s in places.items()
    }
    view = f"{-WIDE / 2:g} {-HIGH / 2:g} {WIDE:g} {HIGH:g}"
    points = tuple((name, *where) for name, where in place.items())
    return ToothDrawing(
        view, tuple(bodies), tuple(circles), (*place["A"], *place["E"]), points
    )


def _outline(gear: Gear, turn: float) -> tuple[Array, Array]:
    """Return radius [m] and angle [rad] of some teeth about the direction ``turn``, closed by the body."""
    radius, angle = half_tooth(gear)
    pitch = 2.0 * math.pi / gear.teeth
    # drawn on each side
    count = min(5, (gear.teeth - 1) // 2)
    middles = turn + pitch * np.arange(-count, count + 1)[:, None]
    teeth = (middles + np.concatenate([-angle, angle[::-1]])).ravel()
    back = turn + (count + 0.5) * pitch * np.linspace(1.0, -1.0, 40)
    # of the body below the teeth, in modules
    inner = np.full_like(back, max(radius[0] - gear.outwards * 3.0 * gear.module, 0.0))
    each = np.concatenate([radius, radius[::-1]])
    return np.concatenate([*(each,) * len(middles), inner]), np.concatenate(
        [teeth, back]
    )


def _path(points: tuple[Array, Array], middle: float, module: float) -> str:
    """Return an SVG path of radii and angles about a centre: the centre line downwards, in modules."""
    radius, angle = points
    x = (middle + radius * np.cos(angle)) / module
    y = radius * np.sin(angle) / module
    return "M" + " L".join(
        f"{across:.4f} {down:.4f}" for across, down in zip(y, x, strict=True)
    )

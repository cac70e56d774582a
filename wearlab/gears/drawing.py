"""Teeth in mesh as a drawing, from the outlines that the stiffness is computed with."""

import math
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.outline import involute_point, load_angle, root_curve

POINTS = 24
WIDE, HIGH = 9.0, 5.6  # of what is seen, in modules
TEETH = 5  # drawn on each side
BODY = 3.0  # of the body below the teeth, in modules


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
    t = np.linspace(0.0, 1.0, POINTS)
    x, y, _ = root_curve(gear, t)
    ends = load_angle(gear, np.array([gear.form_radius, gear.tip_radius]))
    along = involute_point(gear, ends[0] + (ends[1] - ends[0]) * t)
    x, y = np.concatenate([x, along[0][1:]]), np.concatenate([y, along[1][1:]])
    return np.hypot(x, y), np.arctan2(y, x)


def drawing(pair: GearPair) -> ToothDrawing:
    """Return the drawing of a pair whose flanks touch at the pitch point.

    The centre line runs downwards, the pinion's centre above the pitch point; its right flank drives.
    """
    first, second = sorted(pair.gears, key=lambda gear: gear.internal)
    module, angle = first.module, pair.working_pressure_angle
    r1, r2 = first.base_radius / math.cos(angle), second.base_radius / math.cos(angle)
    bodies, circles = [], []
    sweep, outwards = np.linspace(-0.5, 0.5, 61), -1.0 if second.internal else 1.0
    for gear, radius, middle, towards, side in (
        (first, r1, -r1, 0.0, 1.0),
        (second, r2, outwards * r2, 0.0 if second.internal else math.pi, outwards),
    ):
        x, y = involute_point(gear, load_angle(gear, radius))
        teeth = _outline(gear, towards + side * math.atan2(y, x))
        bodies.append((gear.name, _path(teeth, middle, module) + " Z"))
        arc = towards + sweep * min(math.pi, 2.0 * WIDE * module / radius)
        circles.append(_path((np.full_like(arc, radius), arc), middle, module))
    sign = -1.0 if pair.gears[0].internal else 1.0
    places = {name: sign * s / module for name, s in pair.path._asdict().items()}
    place = {
        name: (f"{-s * math.cos(angle):.4f}", f"{s * math.sin(angle):.4f}") for name, s in places.items()
    }
    return ToothDrawing(
        f"{-WIDE / 2:g} {-HIGH / 2:g} {WIDE:g} {HIGH:g}",
        tuple(bodies),
        tuple(circles),
        (*place["A"], *place["E"]),
        tuple((name, *where) for name, where in place.items()),
    )


def _outline(gear: Gear, turn: float) -> tuple[Array, Array]:
    """Return radius [m] and angle [rad] of some teeth about the direction ``turn``, closed by the body."""
    radius, angle = half_tooth(gear)
    pitch = 2.0 * math.pi / gear.teeth
    count = min(TEETH, (gear.teeth - 1) // 2)
    middles = turn + pitch * np.arange(-count, count + 1)[:, None]
    teeth = (middles + np.concatenate([-angle, angle[::-1]])).ravel()
    depth = (1.0 if gear.internal else -1.0) * BODY * gear.module
    back = turn + (count + 0.5) * pitch * np.linspace(1.0, -1.0, 40)
    inner = np.full_like(back, max(radius[0] + depth, 0.0))
    each = np.concatenate([radius, radius[::-1]])
    return np.concatenate([*(each,) * len(middles), inner]), np.concatenate([teeth, back])


def _path(points: tuple[Array, Array], middle: float, module: float) -> str:
    """Return an SVG path of radii and angles about a centre: the centre line downwards, in modules."""
    radius, angle = points
    x, y = (middle + radius * np.cos(angle)) / module, radius * np.sin(angle) / module
    return "M" + " L".join(f"{across:.4f} {down:.4f}" for across, down in zip(y, x, strict=True))

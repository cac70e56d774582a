"""Teeth in mesh as a drawing, from the outlines that the stiffness is computed with."""

import math
from collections.abc import Iterator
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


def working_half_angle(gear: Gear, radius: float) -> float:
    """Return half the tooth's angle at a radius on the involute [rad].

    References
    ----------
    ISO 21771, the tooth thickness half angle.
    """
    x, y = involute_point(gear, load_angle(gear, np.array([radius])))
    return float(np.arctan2(y, x)[0])


def drawing(pair: GearPair) -> ToothDrawing:
    """Return the drawing of a pair whose flanks touch at the pitch point.

    The centre line runs downwards, the pinion's centre above the pitch point; its right flank drives.
    """
    first, second = sorted(pair.gears, key=lambda gear: gear.internal)
    module = first.module
    r1 = first.base_radius / math.cos(pair.working_pressure_angle)
    r2 = second.base_radius / math.cos(pair.working_pressure_angle)
    centre = r1 - r2 if second.internal else r1 + r2
    bodies = []
    for gear, at, towards, turn in (
        (first, 0.0, 0.0, working_half_angle(first, r1)),
        (second, centre, 0.0 if second.internal else math.pi,
         (-1.0 if second.internal else 1.0) * working_half_angle(second, r2)),
    ):  # fmt: skip
        points = np.array(list(_outline(gear, towards + turn)))
        bodies.append((gear.name, _path(points + np.array([at - r1, 0.0]), module) + " Z"))
    sign = -1.0 if pair.gears[0].internal else 1.0
    angle = pair.working_pressure_angle
    places = {name: sign * s / module for name, s in pair.path._asdict().items()}
    place = {
        name: (f"{-s * math.cos(angle):.4f}", f"{s * math.sin(angle):.4f}") for name, s in places.items()
    }
    sweep = np.linspace(-0.5, 0.5, 61)
    circles = []
    for radius, middle, base in ((r1, -r1, 0.0), (r2, centre - r1, 0.0 if second.internal else math.pi)):
        angles = base + sweep * min(math.pi, 2.0 * WIDE * module / radius)
        arc = np.stack([middle + radius * np.cos(angles), radius * np.sin(angles)], axis=1)
        circles.append(_path(arc, module))
    return ToothDrawing(
        f"{-WIDE / 2:g} {-HIGH / 2:g} {WIDE:g} {HIGH:g}",
        tuple(bodies),
        tuple(circles),
        (*place["A"], *place["E"]),
        tuple((name, *where) for name, where in place.items()),
    )


def _outline(gear: Gear, turn: float) -> Iterator[tuple[float, float]]:
    """Yield the outline of some teeth about the direction ``turn``, closed through the body [m]."""
    radius, angle = half_tooth(gear)
    pitch = 2.0 * math.pi / gear.teeth
    count = min(TEETH, (gear.teeth - 1) // 2)
    for tooth in range(-count, count + 1):
        middle = turn + tooth * pitch
        for r, a in zip(radius, angle, strict=True):
            yield r * math.cos(middle - a), r * math.sin(middle - a)
        for r, a in zip(radius[::-1], angle[::-1], strict=True):
            yield r * math.cos(middle + a), r * math.sin(middle + a)
    depth = (1.0 if gear.internal else -1.0) * BODY * gear.module
    inner = max(radius[0] + depth, 0.0)
    ends = turn + (count + 0.5) * pitch, turn - (count + 0.5) * pitch
    for step in np.linspace(0.0, 1.0, 40):
        a = ends[0] + step * (ends[1] - ends[0])
        yield inner * math.cos(a), inner * math.sin(a)


def _path(points: Array, module: float) -> str:
    """Return an SVG path: the centre line downwards, in modules."""
    return "M" + " L".join(f"{y / module:.4f} {x / module:.4f}" for x, y in points)

"""The outline of one tooth, and its share of the body, as a chart from plain squares.

The tooth stands on its own centre line, x from the gear's centre, y towards the loaded
flank. One parameter runs along the flank: 0 at the root circle, 1 where the involute
begins, 2 at the tip edge. In the chart, a T of squares, u runs across (0 on the centre
line, ±1 on the flanks, ±2 half a pitch away) and v from where the body is clamped (0)
through the root (1) to the tip (2). The tooth proper begins on its fillet where the
flank is inclined by 45°, so that no element has a flat corner.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import involute_point, load_angle, root_curve

DEEP = 0.5  # v where that ends


class Wear(NamedTuple):
    """Wear of a flank, linear between contact radii.

    Parameters
    ----------
    radius : (n,) contact radii, ascending [m]
    depth : (n,) along the flank normal [m]
    """

    radius: Array
    depth: Array


class LoadedFlank(NamedTuple):
    """The loaded flank of a gear's tooth.

    Parameters
    ----------
    gear : the gear
    wear : what is gone of the involute, or None
    """

    gear: Gear
    wear: Wear | None = None

    def point(self, parameter: ArrayLike) -> Array:
        """Return points of the flank for parameters in [0, 2], (2, n) [m]."""
        q = np.asarray(parameter, dtype=float)
        x, y, _ = root_curve(self.gear, np.minimum(q, 1.0))
        beyond = np.maximum(q, 1.0)
        involute = np.stack(involute_point(self.gear, self._angle(beyond)))
        if self.wear is not None:
            depth = np.interp(np.hypot(*involute), self.wear.radius, self.wear.depth)
            involute = involute - depth * self.normal(beyond)
        return np.where(q < 1.0, np.stack([x, y]), involute)

    def normal(self, parameter: ArrayLike) -> Array:
        """Return the outward unit normal of the unworn involute, (2, n) [1].

        Parameters
        ----------
        parameter : (n,) in [1, 2]
        """
        lam = self._angle(np.asarray(parameter, dtype=float))
        return np.stack([self.gear.outwards * np.sin(lam), np.cos(lam)])

    def parameter(self, radius: ArrayLike) -> Array:
        """Return the parameter of contact radii on the unworn involute, (n,) [1]."""
        start, end = self._angles
        return 1.0 + (load_angle(self.gear, radius) - start) / (end - start)

    def depth(self, parameter: ArrayLike) -> Array:
        """Return the distance along the flank normal to the centre line, (n,) [m]."""
        return self.point(parameter)[1] / self.normal(parameter)[1]

    @property
    def _angles(self) -> tuple[float, float]:
        """Load angles where the involute begins and ends [rad]."""
        start, end = load_angle(
            self.gear, [self.gear.form_radius, self.gear.tip_radius]
        )
        return float(start), float(end)

    def _angle(self, parameter: Array) -> Array:
        start, end = self._angles
        return start + (end - start) * (parameter - 1.0)


class Chart(NamedTuple):
    """The sector of one tooth.

    Parameters
    ----------
    flank : the loaded flank; the other is its mirror image
    parameter, length : (n,) from 0 to 2, and the length along it from the foot of the
        root curve [m]
    foot : parameter of the flank where the tooth begins
    crown : (2,) x on the centre line where the tooth begins and ends [m]
    deep : radius below which the body knows nothing of the teeth [m]
    """

    flank: LoadedFlank
    parameter: Array
    length: Array
    foot: float
    crown: tuple[float, float]
    deep: float

    @property
    def half_pitch(self) -> float:
        """Half the angle of a sector, π/z [rad]."""
        return math.pi / self.flank.gear.teeth

    def length_of(self, parameter: ArrayLike) -> Array:
        """Return the lengths along the flank up to parameters, (n,) [m]."""
        return np.interp(np.asarray(parameter, float), self.parameter, self.length)

    def at_length(self, length: ArrayLike) -> Array:
        """Return the parameters at lengths along the flank, (n,) [1]."""
        return np.interp(np.asarray(length, float), self.length, self.parameter)

    def map(self, u: Array, v: Array) -> Array:
        """Return the points of the sector, (2, n) [m].

        Parameters
        ----------
        u, v : (n,) in [−2, 2] and [0, 2] [1]
        """
        side = np.where(u < 0.0, -1.0, 1.0)
        across = np.abs(u)
        inside = np.where(v > 1.0, self._tooth(across, v - 1.0), self._body(across, v))
        return np.stack([inside[0], side * inside[1]])

    def height(self, parameter: Array) -> Array:
        """Return v of parameters on the flank above the foot, (n,) [1]."""
        start, end = self.length_of([self.foot, 2.0])
        return 1.0 + (self.length_of(parameter) - start) / (end - start)

    def _tooth(self, u: Array, t: Array) -> Array:
        """Rows are parabolas, square to the centre line."""
        start, end = self.length_of([self.foot, 2.0])
        edge = self.flank.point(
            self.at_length(start + (end - start) * np.clip(t, 0.0, 1.0))
        )
        middle = self.crown[0] + (self.crown[1] - self.crown[0]) * t
        return np.stack([middle + (edge[0] - middle) * u**2, edge[1] * u])

    def _root(self, u: Array) -> Array:
        """Return the top of the body: below the tooth, fillet and root circle."""
        down = np.clip(u - 1.0, 0.0, 1.0)
        fillet = float(self.length_of(self.foot))
        root = self.flank.gear.root_radius
        bottom = self.flank.point(0.0)
        half = math.atan2(bottom[1], bottom[0])
        travelled = down * (fillet + root * (self.half_pitch - half))
        angle = half + np.maximum(travelled - fillet, 0.0) / root
        on_circle = root * np.stack([np.cos(angle), np.sin(angle)])
        on_fillet = self.flank.point(
            self.at_length(np.maximum(fillet - travelled, 0.0))
        )
        beside = np.where(travelled < fillet, on_fillet, on_circle)
        return np.where(
            u <= 1.0, self._tooth(np.minimum(u, 1.0), np.zeros_like(u)), beside
        )

    def _body(self, u: Array, v: Array) -> Array:
        corner = self.flank.point(self.foot)
        under = math.atan2(corner[1], corner[0])
        angle = np.where(
            u <= 1.0, u * under, under + (u - 1.0) * (self.half_pitch - under)
        )
        ray = np.stack([np.cos(angle), np.sin(angle)])
        clamp = self.flank.gear.bore_radius
        radius = clamp + (self.deep - clamp) * np.minimum(v / DEEP, 1.0)
        return radius * ray + np.clip((v - DEEP) / (1.0 - DEEP), 0.0, 1.0) * (
            self._root(u) - self.deep * ray
        )


def chart(flank: LoadedFlank) -> Chart:
    """Lay the sector of a flank out."""
    # points from which lengths along the flank are read
    gear = flank.gear
    q = np.linspace(0.0, 2.0, 4001)
    step = np.diff(flank.point(q), axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*step))])
    # the angle between the flank's tangent and the tooth's centre line, 0 along it
    slope = np.arctan2(-step[1], gear.outwards * step[0])
    slope = np.concatenate([slope[:1], slope])
    foot = float(q[(slope > math.radians(45.0)) & (q < 1.0)].max(initial=0.0))
    x, y = flank.point(foot)
    begin = float(x - 0.5 * gear.outwards * y * math.tan(np.interp(foot, q, slope)))
    top = (
        max(begin, gear.root_radius) if gear.internal else min(begin, gear.root_radius)
    )
    room = gear.bore_radius - top
    # how far the root's shape reaches into the body, in modules
    share = min(0.5, 0.6 * gear.module / abs(room))
    return Chart(flank, q, length, foot, (begin, gear.tip_radius), top + share * room)

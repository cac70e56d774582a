"""The loaded flank of one tooth, from the foot of its root curve to its tip, as the elements see it.

The tooth stands on its own centre line, x from the gear's centre, y towards the loaded flank. One parameter
runs along it: 0 at the root circle, 1 where the involute begins, 2 at the tip edge.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import involute_point, load_angle, root_curve

TABLE = 4001  # points from which lengths along the flank are read


@dataclass(frozen=True)
class Wear:
    """Wear of a flank, linear between contact radii.

    Parameters
    ----------
    radius : (n,) contact radii, ascending [m]
    depth : (n,) along the flank normal [m]
    """

    radius: Array
    depth: Array


@dataclass(frozen=True)
class LoadedFlank:
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
        involute = self._involute(np.maximum(q, 1.0))
        return np.where(q < 1.0, np.stack([x, y]), involute)

    def normal(self, parameter: ArrayLike) -> Array:
        """Return the outward unit normal of the unworn involute for parameters in [1, 2], (2, n) [1]."""
        lam = self._angle(np.asarray(parameter, dtype=float))
        towards_tip = -1.0 if self.gear.internal else 1.0
        return np.stack([towards_tip * np.sin(lam), np.cos(lam)])

    def parameter(self, radius: ArrayLike) -> Array:
        """Return the parameter of contact radii on the unworn involute, (n,) [1]."""
        start, end = self._angles
        return 1.0 + (load_angle(self.gear, radius) - start) / (end - start)

    def depth(self, parameter: ArrayLike) -> Array:
        """Return the distance along the flank normal to the tooth's centre line, (n,) [m]."""
        return self.point(parameter)[1] / self.normal(parameter)[1]

    @property
    def _angles(self) -> tuple[float, float]:
        """Load angles where the involute begins and ends [rad]."""
        start, end = load_angle(self.gear, [self.gear.form_radius, self.gear.tip_radius])
        return float(start), float(end)

    def _angle(self, parameter: Array) -> Array:
        start, end = self._angles
        return start + (end - start) * (parameter - 1.0)

    def _involute(self, parameter: Array) -> Array:
        point = np.stack(involute_point(self.gear, self._angle(parameter)))
        if self.wear is None:
            return point
        depth = np.interp(np.hypot(*point), self.wear.radius, self.wear.depth)
        return point - depth * self.normal(parameter)


@dataclass(frozen=True)
class Lengths:
    """Length along the flank over its parameter, as a table.

    Parameters
    ----------
    parameter : (n,) from 0 to 2
    length : (n,) from the foot of the root curve [m]
    slope : (n,) angle between the flank's tangent and the tooth's centre line, 0 along it [rad]
    """

    parameter: Array
    length: Array
    slope: Array

    def of(self, parameter: ArrayLike) -> Array:
        """Return the lengths up to parameters, (n,) [m]."""
        return np.interp(np.asarray(parameter, dtype=float), self.parameter, self.length)

    def at(self, length: ArrayLike) -> Array:
        """Return the parameters at lengths, (n,) [1]."""
        return np.interp(np.asarray(length, dtype=float), self.length, self.parameter)


def lengths(flank: LoadedFlank) -> Lengths:
    """Measure a flank."""
    q = np.linspace(0.0, 2.0, TABLE)
    points = flank.point(q)
    step = np.diff(points, axis=1)
    towards_tip = -1.0 if flank.gear.internal else 1.0
    slope = np.arctan2(-step[1], towards_tip * step[0])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*step))])
    return Lengths(q, length, np.concatenate([slope[:1], slope]))

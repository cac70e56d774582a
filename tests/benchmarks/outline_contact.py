"""Where two teeth meet first, from their outlines alone: points rotated, distances on
circles.

A second way to what :mod:`wearlab.mesh.exact` computes, for comparison with it. Both
flanks are polygons of many points of the drawn outline, root curve and tip corner
included. The driving one is turned; each of its points and the driven corner are seen
from the driven gear's centre, and the driven polygon is looked up at the same radius:
the angle between the two is how far the driven gear must turn back to touch there. No
path of contact and no tangency comes in.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.gears.gear import GearPair
from wearlab.mesh.finite_element.outline import LoadedFlank, Wear

Array = NDArray[np.float64]

ROOT_POINTS, INVOLUTE_POINTS = 800, 8001


class Touch(NamedTuple):
    """Where a pair of teeth would meet first.

    Parameters
    ----------
    angle : by which the driven gear must turn back until they meet [rad]
    parameter : of the flank points, (driving, driven); 1 where the involute begins, 2
        at the tip corner [1]
    arm : of the common normal about both centres, (driving, driven) [m]
    inward : (2, 2) gear × (x, y), the push on each tooth, in its own frame [1]
    """

    angle: float
    parameter: tuple[float, float]
    arm: tuple[float, float]
    inward: Array

    @property
    def normal_gap(self) -> float:
        """Distance along the common normal [m]."""
        return self.angle * self.arm[1]


class Polygon(NamedTuple):
    """A flank as points: parameter, radius and angle from its tooth's
    centre line, each (n,).
    """

    parameter: Array
    radius: Array
    angle: Array


@dataclass(frozen=True)
class Outlines:
    """The two gears in their places, the driving one in the origin, the pitch point on
    the x axis.

    Parameters
    ----------
    pair : the gears
    wear : of their flanks, (driving, driven); None: unworn. It moves points and
        distances, not the normals
    """

    pair: GearPair
    wear: tuple[Wear | None, Wear | None] = (None, None)

    @cached_property
    def flanks(self) -> tuple[LoadedFlank, LoadedFlank]:
        """The flanks, (driving, driven)."""
        return LoadedFlank(self.pair.driving, self.wear[0]), LoadedFlank(
            self.pair.driven, self.wear[1]
        )

    @cached_property
    def polygons(self) -> tuple[Polygon, Polygon]:
        """Their points, (driving, driven)."""
        q = np.concatenate(
            [
                np.linspace(0.0, 1.0, ROOT_POINTS)[:-1],
                np.linspace(1.0, 2.0, INVOLUTE_POINTS),
            ]
        )
        first, second = (
            Polygon(q, np.hypot(*points), np.arctan2(points[1], points[0]))
            for points in (flank.point(q) for flank in self.flanks)
        )
        return first, second

    @cached_property
    def pitch_radius(self) -> tuple[float, float]:
        """Radii at which the flanks pass the pitch point, (driving, driven) [m]."""
        cosine = math.cos(self.pair.working_pressure_angle)
        return (
            self.pair.driving.base_radius / cosine,
            self.pair.driven.base_radius / cosine,
        )

    @cached_property
    def centre(self) -> float:
        """Place of the driven gear's centre on the x axis [m]."""
        first, second = self.pitch_radius
        return first + second if not self.pair.internal else first - second

    @property
    def mirror(self) -> float:
        """Sign by which x is turned so that the pitch point lies at
        +x from the driven gear's centre.
        """
        return 1.0 if self.pair.internal else -1.0

    def touch(self, position: float) -> Touch | None:
        """Return where the teeth meet first when they would be conjugate at a path
        position [m].

        None where no circle about the driven gear's centre meets both teeth.
        """
        first, second = self.polygons
        turned = self._turned(position)
        place = first.radius * np.exp(1j * (first.angle + turned[0]))
        seen = self.mirror * (place.real - self.centre) + 1j * place.imag
        corner = second.radius[-1]
        crossed = np.flatnonzero(np.diff(np.sign(np.abs(seen) - corner)))
        share = (corner - np.abs(seen[crossed])) / (
            np.abs(seen[crossed + 1]) - np.abs(seen[crossed])
        )
        extra = seen[crossed] + share * (seen[crossed + 1] - seen[crossed])
        parameter = np.append(
            first.parameter,
            first.parameter[crossed] + share * np.diff(first.parameter)[crossed],
        )
        seen, on_corner = (
            np.append(seen, extra),
            np.append(np.zeros(len(seen), bool), np.ones(len(extra), bool)),
        )
        order = np.argsort(second.radius)
        radius = np.where(on_corner, corner, np.abs(seen))
        outwards = (
            second.radius[order],
            turned[1] - second.angle[order],
            second.parameter[order],
        )
        angle = np.interp(radius, *outwards[:2], left=np.inf, right=np.inf) - np.angle(
            seen
        )
        nearest = int(np.argmin(angle))
        if not np.isfinite(angle[nearest]):
            return None
        partner = float(np.interp(radius[nearest], outwards[0], outwards[2]))
        return self._found(
            turned,
            float(angle[nearest]),
            (float(parameter[nearest]), partner),
            seen[nearest],
        )

    def _turned(self, position: float) -> tuple[float, float]:
        """Return the angles of both centre lines, the driven one's in
        the mirrored frame [rad].
        """
        at_pitch = []
        for gear, radius in zip(self.pair.gears, self.pitch_radius, strict=True):
            flank = LoadedFlank(gear)
            x, y = flank.point(flank.parameter([radius]))
            at_pitch.append(float(np.arctan2(y[0], x[0])))
        return (
            position / self.pair.driving.base_radius - at_pitch[0],
            position / self.pair.driven.base_radius + at_pitch[1],
        )

    def _found(
        self,
        turned: tuple[float, float],
        angle: float,
        parameter: tuple[float, float],
        seen: complex,
    ) -> Touch:
        """Lay the common normal: the flank's own, also where the mate
        touches it with its corner.
        """
        driven_line = turned[1] - angle
        at_driving_corner = parameter[0] == 2.0
        if at_driving_corner:
            outward = complex(*self.flanks[1].normal([parameter[1]])[:, 0])
            mirrored = -outward.conjugate() * np.exp(1j * driven_line)
            normal = self.mirror * mirrored.real + 1j * mirrored.imag
        else:
            normal = complex(*self.flanks[0].normal([parameter[0]])[:, 0]) * np.exp(
                1j * turned[0]
            )
            mirrored = self.mirror * normal.real + 1j * normal.imag
        place = self.mirror * seen.real + self.centre + 1j * seen.imag
        arm = (place.conjugate() * normal).imag, (seen.conjugate() * mirrored).imag
        first = -normal * np.exp(-1j * turned[0])
        second = (mirrored * np.exp(-1j * driven_line)).conjugate()
        inward = np.array([[first.real, first.imag], [second.real, second.imag]])
        return Touch(angle, parameter, (float(arm[0]), float(arm[1])), inward)

"""The root curve that a rack's rounded tip leaves, and where it meets the involute.

With γ the angle of the rounding's normal to the pitch line, a the depth of the rounding's centre below it, b
its distance from the tooth's centre line and ρ its radius: ``φ = (a/tanγ + b)/r``, ``D = a/sinγ + ρ``,
``x = r cosφ − D sin(γ − φ)``, ``y = r sinφ − D cos(γ − φ)`` (Litvin & Fuentes, 2nd ed., 6.4).
"""

import math
from typing import NamedTuple

from wearlab.gears.involute import involute


class Rounding(NamedTuple):
    """The generating rack's tip beside the gear that it cuts.

    Parameters
    ----------
    radius, base_radius : r and r_b of the gear [m]
    pressure_angle : α [rad]
    rounding : ρ [m]
    depth : a, of the rounding's centre below the pitch line [m]
    offset : b, of the rounding's centre from the tooth's centre line [m]
    base_half_angle : half the tooth angle at the base circle [rad]
    """

    radius: float
    base_radius: float
    pressure_angle: float
    rounding: float
    depth: float
    offset: float
    base_half_angle: float

    @property
    def end_curvature(self) -> float:
        """Radius of curvature where the rack's straight edge ends, negative when it undercuts [m]."""
        sin = math.sin(self.pressure_angle)
        return self.radius * sin - (self.depth + self.rounding * sin) / sin

    def point(self, gamma: float) -> tuple[float, float]:
        """Return radius [m] and half tooth angle [rad] of the root curve at γ."""
        phi = (self.depth / math.tan(gamma) + self.offset) / self.radius
        reach = self.depth / math.sin(gamma) + self.rounding
        x = self.radius * math.cos(phi) - reach * math.sin(gamma - phi)
        y = self.radius * math.sin(phi) - reach * math.cos(gamma - phi)
        return math.hypot(x, y), math.atan2(y, x)

    def last_angle(self) -> float:
        """Return the γ with which the root curve ends: α, or where an undercut meets the involute [rad].

        The curve of an undercut gear lies within the tooth up to that point, and beyond it in the space.
        """
        if self.end_curvature >= 0.0:
            return self.pressure_angle
        outside, within = self.pressure_angle, 0.5 * math.pi
        for _ in range(80):
            middle = 0.5 * (outside + within)
            if self._beyond(*self.point(middle)):
                outside = middle
            else:
                within = middle
        return 0.5 * (outside + within)

    def _beyond(self, radius: float, half: float) -> bool:
        if radius <= self.base_radius:
            return False
        return half > self.base_half_angle - involute(math.acos(self.base_radius / radius))

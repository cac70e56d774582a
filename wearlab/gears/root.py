"""The root of a tooth, and where its involute begins.

A rack's rounded tip leaves a trochoid. With γ the angle of the rounding's normal to the pitch line, a the
depth of the rounding's centre below it, b its distance from the tooth's centre line and ρ its radius:
``φ = (a/tanγ + b)/r``, ``D = a/sinγ + ρ``,
``x = r cosφ − D sin(γ − φ)``, ``y = r sinφ − D cos(γ − φ)`` (Litvin & Fuentes, 2nd ed., 6.4).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.shifts import involute
from wearlab.gears.specification import GearError, RootProfile


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

    def point(self, gamma: Any) -> tuple[Array, Array, Array]:
        """Return height x, half thickness y and dx/dγ of the root curve at angles γ, (n,) [m]."""
        r, sin, tan_inverse = self.radius, np.sin(gamma), np.cos(gamma) / np.sin(gamma)
        phi, phi_rate = (self.depth * tan_inverse + self.offset) / r, -self.depth / (r * sin**2)
        D, D_rate = self.depth / sin + self.rounding, -self.depth * tan_inverse / sin
        along, across = np.sin(gamma - phi), np.cos(gamma - phi)
        rise = -r * np.sin(phi) * phi_rate - D_rate * along - D * across * (1.0 - phi_rate)
        return r * np.cos(phi) - D * along, r * np.sin(phi) - D * across, rise

    def last_angle(self) -> float:
        """Return the γ with which the root curve ends: α, or where an undercut meets the involute [rad].

        The curve of an undercut gear lies within the tooth up to that point, and beyond it in the space.
        """
        if self.end_curvature >= 0.0:
            return self.pressure_angle
        outside, within = self.pressure_angle, 0.5 * math.pi
        for _ in range(80):
            middle = 0.5 * (outside + within)
            x, y, _ = self.point(middle)
            if self._beyond(math.hypot(x, y), math.atan2(y, x)):
                outside = middle
            else:
                within = middle
        return 0.5 * (outside + within)

    def _beyond(self, radius: float, half: float) -> bool:
        if radius <= self.base_radius:
            return False
        return half > self.base_half_angle - involute(math.acos(self.base_radius / radius))


PRACTICAL = 17.1 / 14.0
"""Rack depth over the depth free of undercut that practice accepts: 14 teeth where theory asks for 17."""


def rounding_centre(dedendum: float, fillet: float, pressure_angle: float) -> float:
    """Return how far the rounding's centre lies from the rack tooth's centre line, in modules.

    ``x_c = π/4 − (h − ρ) tanα − ρ/cosα``; negative when the rounding does not fit on the rack tooth.

    Parameters
    ----------
    dedendum, fillet : depth h of the rack tooth and its tip rounding ρ, in modules [1]
    pressure_angle : α [rad]

    References
    ----------
    ISO 6336-3, where it is the auxiliary value E; ISO 53 for the rack.
    """
    return math.pi / 4 - (dedendum - fillet) * math.tan(pressure_angle) - fillet / math.cos(pressure_angle)


class RackCut(NamedTuple):
    """A tooth as its generating rack cuts it.

    Parameters
    ----------
    teeth : z [1]
    module, pressure_angle : m [m], α [rad]
    profile_shift : x [1]
    root_radius : r_f [m]
    fillet : tip rounding ρ of the rack, in modules [1]
    """

    teeth: int
    module: float
    pressure_angle: float
    profile_shift: float
    root_radius: float
    fillet: float

    @property
    def reference_radius(self) -> float:
        """R = m z / 2 [m]."""
        return 0.5 * self.module * self.teeth

    @property
    def depth(self) -> float:
        """How far the rack reaches below the reference circle, h − x, in modules [1]."""
        return (self.reference_radius - self.root_radius) / self.module

    @property
    def rounding(self) -> Rounding:
        """The rack's tip beside the gear."""
        r, alpha, rho, z = self.reference_radius, self.pressure_angle, self.fillet * self.module, self.teeth
        dedendum = r + self.profile_shift * self.module - self.root_radius
        offset = math.pi * self.module / 4 + (dedendum - rho) * math.tan(alpha) + rho / math.cos(alpha)
        half = math.pi / (2 * z) + 2.0 * self.profile_shift * math.tan(alpha) / z + involute(alpha)
        return Rounding(r, r * math.cos(alpha), alpha, rho, r - self.root_radius - rho, offset, half)

    @property
    def edge(self) -> float:
        """Depth at which the rack's straight edge ends, h_e = h − ρ (1 − sinα) − x, in modules [1]."""
        return self.depth - self.fillet * (1.0 - math.sin(self.pressure_angle))

    @property
    def free_of_undercut(self) -> float:
        """Depth of the edge from which it cuts into the involute, z sin²α / 2, in modules [1]."""
        return 0.5 * self.teeth * math.sin(self.pressure_angle) ** 2


class ToothRoot(NamedTuple):
    """The root of a tooth.

    Parameters
    ----------
    profile : which
    form_radius : where the involute begins [m]
    fillet_radius : of the rounding [m]
    assumed : what nobody chose
    """

    profile: RootProfile
    form_radius: float
    fillet_radius: float
    assumed: tuple[str, ...]


def root_of(wanted: RootProfile | None, name: str, cut: RackCut) -> ToothRoot:
    """Return the root of a tooth: a trochoid wherever a rack of that depth and rounding can exist.

    Parameters
    ----------
    wanted : the profile asked for, or None
    name : the gear's name, for messages
    cut : the tooth

    Raises
    ------
    GearError : a trochoid was asked for and its rack cannot exist, or it undercuts too far

    References
    ----------
    ISO 53, for the rack and its rounding.
    """
    dedendum, fillet, alpha = cut.depth + cut.profile_shift, cut.fillet, cut.pressure_angle
    fits = rounding_centre(dedendum, fillet, alpha) >= 0.0 and fillet >= 0.0
    if fits and wanted != "radial":
        return ToothRoot("trochoid", form_radius(name, cut), fillet * cut.module, undercut_flag(cut))
    slack = math.pi / 4 - dedendum * math.tan(alpha)
    largest = slack * math.cos(alpha) / (1.0 - math.sin(alpha))
    if wanted == "trochoid":
        raise GearError(
            f"{name}: no rack generates a root {dedendum:.4g} modules deep with a tip rounding of "
            f"{fillet:.3g} modules; give fillet_radius_coefficient <= {max(largest, 0.0):.3f}, a larger "
            'root_diameter, or root_profile = "radial"'
        )
    flag = f"root profile radial: a rounding of {fillet:.3g} modules exceeds the rack tip"
    begins = max(cut.reference_radius * math.cos(alpha), cut.root_radius)
    return ToothRoot("radial", begins, fillet * cut.module, () if wanted else (flag,))


def undercut_flag(cut: RackCut) -> tuple[str, ...]:
    """Return the flag of a gear whose rack undercuts slightly.

    References
    ----------
    Litvin & Fuentes: least number of teeth that a rack does not undercut.
    """
    excess = cut.edge - cut.free_of_undercut
    if excess <= 0.0:
        return ()
    return (f"undercut by a rack edge {excess:.3g} modules too deep, within the practical limit",)


def form_radius(name: str, cut: RackCut) -> float:
    """Return the radius where the involute begins above a trochoid [m].

    A rack's straight edge ends at depth ``h_e = h − ρ (1 − sinα) − x`` below the pitch line and leaves
    ``ρ_form = r sinα − h_e m / sinα``.
    A rack that reaches slightly deeper undercuts: the involute then begins where the root curve meets it,
    and the gear runs as long as its mate touches it above (checked with the pair).

    Raises
    ------
    GearError : undercut beyond the practical limit, 1.22 times the depth free of it

    References
    ----------
    DIN 3960: practical limit of the profile shift (14 − z)/17 instead of (17 − z)/17 at 20°.
    """
    rounding, edge, limit = cut.rounding, cut.edge, cut.free_of_undercut
    if rounding.end_curvature >= 0.0:
        return math.hypot(rounding.base_radius, rounding.end_curvature)
    if edge > PRACTICAL * limit:
        raise GearError(
            f"{name}: undercut: {cut.teeth} teeth allow a rack edge {limit:.4g} modules below the pitch "
            f"circle, it needs {edge:.4g}; raise profile_shift_coefficient to "
            f"{cut.profile_shift + edge - limit:.4g}, "
            'use more teeth, or set root_profile = "radial"'
        )
    x, y, _ = rounding.point(rounding.last_angle())
    return math.hypot(x, y)

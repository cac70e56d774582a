"""The root of a tooth, and where its involute begins.

A rack's rounded tip leaves a trochoid. With γ the angle of the rounding's normal to the
pitch line, a the depth of the rounding's centre below it, b its distance from the
tooth's centre line and ρ its radius: ``φ = (a/tanγ + b)/r``, ``D = a/sinγ + ρ``, ``x =
r cosφ − D sin(γ − φ)``, ``y = r sinφ − D cos(γ − φ)`` (Litvin & Fuentes, 2nd ed., 6.4).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.shifts import involute
from wearlab.gears.specification import GearError, RootProfile

PRACTICAL_LIMIT = 17.1 / 14.0
"""Rack depth over the depth free of undercut that practice accepts: 14 teeth where
theory asks for 17 (DIN 3960: profile shift (14 − z)/17 instead of (17 − z)/17 at 20°).
"""
MIN_NECK = 0.1
"""Least thickness of a tooth above its root, in modules."""
NECK_POINTS = 200
"""Points of the root curve among which the thinnest place is looked for."""


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
        """Depth of the rack below the reference circle, h − x, in modules [1]."""
        return (self.reference_radius - self.root_radius) / self.module

    @property
    def base_radius(self) -> float:
        """R_b = r cosα [m]."""
        return self.reference_radius * math.cos(self.pressure_angle)

    @property
    def base_half_angle(self) -> float:
        """Half the tooth (ring: space) angle at the base circle [rad].

        ``π/2z + 2x tanα/z + inv α``.
        """
        z = self.teeth
        x = self.profile_shift
        alpha = self.pressure_angle
        return math.pi / (2 * z) + 2.0 * x * math.tan(alpha) / z + involute(alpha)

    @property
    def offset(self) -> float:
        """Distance b of the rack's rounding, its centre, from the centre line [m]."""
        alpha = self.pressure_angle
        fillet = self.fillet
        dedendum = self.depth + self.profile_shift
        return self.module * (
            math.pi / 4
            + (dedendum - fillet) * math.tan(alpha)
            + fillet / math.cos(alpha)
        )

    @property
    def edge(self) -> float:
        """Depth of the edge's end, h_e = h − ρ (1 − sinα) − x, in modules [1]."""
        return self.depth - self.fillet * (1.0 - math.sin(self.pressure_angle))

    @property
    def free_of_undercut(self) -> float:
        """Depth from which the edge undercuts, z sin²α / 2, in modules [1]."""
        return 0.5 * self.teeth * math.sin(self.pressure_angle) ** 2

    @property
    def end_curvature(self) -> float:
        """Radius of curvature where the edge ends, negative of an undercut [m]."""
        sin = math.sin(self.pressure_angle)
        return self.reference_radius * sin - self.module * self.edge / sin

    def point(self, gamma: Any) -> tuple[Array, Array, Array]:
        """Return height x, half thickness y and dx/dγ of the root curve, (n,) [m].

        The rounding's centre is a below the pitch line and b from the tooth's centre
        line.

        Parameters
        ----------
        gamma : (n,) angles γ of the normal to the pitch line [rad]
        """
        r = self.reference_radius
        rho = self.module * self.fillet
        a = self.module * (self.depth - self.fillet)
        sin = np.sin(gamma)
        tan_inverse = np.cos(gamma) / np.sin(gamma)
        phi = (a * tan_inverse + self.offset) / r
        phi_rate = -a / (r * sin**2)
        D = a / sin + rho
        D_rate = -a * tan_inverse / sin
        along = np.sin(gamma - phi)
        across = np.cos(gamma - phi)
        rise = (
            -r * np.sin(phi) * phi_rate - D_rate * along - D * across * (1.0 - phi_rate)
        )
        return r * np.cos(phi) - D * along, r * np.sin(phi) - D * across, rise

    def last_angle(self) -> float:
        """Return the γ with which the root curve ends [rad].

        This is α, or where an undercut meets the involute. The curve of an undercut
        gear lies within the tooth up to that point, and beyond it in the space.
        """
        if self.end_curvature >= 0.0:
            return self.pressure_angle
        outside = self.pressure_angle
        within = 0.5 * math.pi
        for _ in range(80):
            middle = 0.5 * (outside + within)
            x, y, _ = self.point(middle)
            radius = math.hypot(x, y)
            pressure_angle = math.acos(min(1.0, self.base_radius / radius))
            flank = self.base_half_angle - involute(pressure_angle)
            if radius > self.base_radius and math.atan2(y, x) > flank:
                outside = middle
            else:
                within = middle
        return 0.5 * (outside + within)


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


def root_of(profile: RootProfile | None, name: str, cut: RackCut) -> ToothRoot:
    """Return the root of a tooth, a trochoid wherever such a rack can exist.

    Its rounding's centre lies ``x_c = π/4 − (h − ρ) tanα − ρ/cosα`` modules from the
    rack tooth's centre line, negative when it does not fit.

    Parameters
    ----------
    profile : as the file gives it, or None
    name : the gear's name, for messages
    cut : the tooth

    Raises
    ------
    GearError : a trochoid was asked for and its rack cannot exist, or it cuts the tooth
        off

    References
    ----------
    ISO 53, for the rack and its rounding; ISO 6336-3, where x_c is the auxiliary value
    E; Litvin & Fuentes: least number of teeth that a rack does not undercut.
    """
    dedendum = cut.depth + cut.profile_shift
    fillet = cut.fillet
    alpha = cut.pressure_angle
    centre = (
        math.pi / 4 - (dedendum - fillet) * math.tan(alpha) - fillet / math.cos(alpha)
    )
    if centre >= 0.0 and fillet >= 0.0 and profile != "radial":
        form = form_radius(name, cut)
        return ToothRoot("trochoid", form, fillet * cut.module, _undercut(cut, form))
    slack = math.pi / 4 - dedendum * math.tan(alpha)
    largest = slack * math.cos(alpha) / (1.0 - math.sin(alpha))
    if profile == "trochoid":
        sharper = ""
        if largest >= 0.0:
            rounded_down = math.floor(1e3 * largest) / 1e3
            sharper = f"fillet_radius_coefficient <= {rounded_down:.3f} or "
        raise GearError(
            f"{name}: no rack generates a root {dedendum:.4g} modules deep with a tip "
            f"rounding of {fillet:.3g} modules; give {sharper}root_profile = "
            '"radial"'
        )
    flag = (
        f"root profile radial: a rounding of {fillet:.3g} modules exceeds the rack tip"
    )
    begins = max(cut.reference_radius * math.cos(alpha), cut.root_radius)
    return ToothRoot("radial", begins, fillet * cut.module, () if profile else (flag,))


def _undercut(cut: RackCut, form_radius: float) -> tuple[str, ...]:
    """Return what is to be known of an undercut tooth, nothing of any other."""
    excess = cut.edge - cut.free_of_undercut
    if excess <= 0.0:
        return ()
    flag = f"undercut by a rack edge {excess:.3g} modules too deep"
    if cut.edge <= PRACTICAL_LIMIT * cut.free_of_undercut:
        return (f"{flag}, within the practical limit",)
    return (
        f"{flag}: the involute begins at diameter {2e3 * form_radius:.6g} mm, with a "
        "sharp edge",
    )


def form_radius(name: str, cut: RackCut) -> float:
    """Return the radius where the involute begins above a trochoid [m].

    A rack's straight edge ends at depth ``h_e = h − ρ (1 − sinα) − x`` below the pitch
    line and leaves ``ρ_form = r sinα − h_e m / sinα``. A rack that reaches deeper
    undercuts: the involute then begins where the root curve meets it, and the gear runs
    on what is left above (checked with the pair).

    Raises
    ------
    GearError : the rack cuts the tooth off, or nearly so, at its root

    References
    ----------
    Litvin & Fuentes, Gear Geometry and Applied Theory, 2nd ed., 6.4: where trochoid and
    involute of an undercut tooth meet.
    """
    if cut.end_curvature >= 0.0:
        return math.hypot(cut.base_radius, cut.end_curvature)

    last = cut.last_angle()
    _, half_thickness, _ = cut.point(np.linspace(0.5 * math.pi, last, NECK_POINTS))
    thickness = 2.0 * float(half_thickness.min())
    if thickness < MIN_NECK * cut.module:
        raise GearError(
            f"{name}: undercut: the rack's edge leaves {1e3 * max(thickness, 0.0):.3g} "
            f"mm of the {cut.teeth} teeth at their necks, less than {MIN_NECK:g} "
            "modules; give it 10 teeth or more with a profile_shift_coefficient of 0 "
            "or more"
        )
    x, y, _ = cut.point(last)
    return math.hypot(x, y)


def ring_root(
    profile: RootProfile | None, name: str, cut: RackCut, tip_radius: float
) -> ToothRoot:
    """Return the root of a ring: the fillet asked for, or the largest in a tooth space.

    The cutter that made a ring is rarely known, so its root is the simple one: the
    involute ends on a circular fillet that touches it and the root circle. With ``r_c =
    r_f − ρ_F`` and ``ρ_c = √(r_c² − r_b²)`` of the fillet's centre, the involute ends
    at ``√(r_b² + (ρ_c + ρ_F)²)`` (both on one normal), and the centre stands ``ψ_c =
    π/2z + 2x tanα/z + inv α − ρ_F/r_b − inv α_c`` from the space's centre line.

    Parameters
    ----------
    profile : "radial", or a fillet
    name : the ring's name, for messages
    cut : its tooth space, with the radius of the wanted fillet
    tip_radius : r_a [m]

    Raises
    ------
    GearError : the tooth space ends in a point
    """
    space = cut.base_half_angle
    r_b = cut.base_radius
    r_f = cut.root_radius

    def centre(fillet: float) -> float:
        """Return ψ_c, the angle of a fillet's centre from the space's centre line."""
        return space - fillet / r_b - involute(math.acos(r_b / (r_f - fillet)))

    if centre(0.0) <= 0.0:
        raise GearError(
            f"{name}: the tooth space ends in a point below the root diameter "
            f"{2e3 * r_f:.5g} mm; give it a smaller dedendum_coefficient or "
            "root_diameter"
        )
    fillet = 0.0 if profile == "radial" else cut.fillet * cut.module
    flags: tuple[str, ...] = ()
    limit = min(r_f - tip_radius, 0.999 * (r_f - r_b))
    if fillet > limit or centre(fillet) < 0.0:
        low = 0.0
        high = min(fillet, limit)
        for _ in range(60):
            middle = 0.5 * (low + high)
            if centre(middle) >= 0.0:
                low = middle
            else:
                high = middle
        flags = (
            f"root fillet reduced from {fillet / cut.module:.3g} to "
            f"{low / cut.module:.3g} modules: the largest in its tooth space",
        )
        fillet = low
    form = math.hypot(r_b, math.sqrt((r_f - fillet) ** 2 - r_b**2) + fillet)
    return ToothRoot("fillet" if fillet > 0.0 else "radial", form, fillet, flags)

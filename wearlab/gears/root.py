"""Which root a tooth gets, and where its involute begins."""

import math

from wearlab.gears.errors import GearError
from wearlab.gears.involute import involute
from wearlab.gears.specification import RootProfile
from wearlab.gears.trochoid import Rounding

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


def resolve_root(
    wanted: RootProfile | None, *, name: str, dedendum: float, fillet: float, pressure_angle: float
) -> tuple[RootProfile, tuple[str, ...]]:
    """Return the root profile of a tooth: a trochoid wherever a rack of that depth and rounding can exist.

    Parameters
    ----------
    wanted : the profile asked for, or None
    name : the gear's name, for messages
    dedendum, fillet : depth and tip rounding of the generating rack, in modules [1]
    pressure_angle : α [rad]

    Returns
    -------
    the profile, and the flag of a choice nobody made

    Raises
    ------
    GearError : a trochoid was asked for and its rack cannot exist

    References
    ----------
    ISO 53, for the rack and its rounding.
    """
    fits = rounding_centre(dedendum, fillet, pressure_angle) >= 0.0 and fillet >= 0.0
    if wanted == "radial" or (wanted is None and fits):
        return wanted or "trochoid", ()
    if fits:
        return "trochoid", ()
    slack = math.pi / 4 - dedendum * math.tan(pressure_angle)
    largest = slack * math.cos(pressure_angle) / (1.0 - math.sin(pressure_angle))
    if wanted == "trochoid":
        raise GearError(
            f"{name}: no rack generates a root {dedendum:.4g} modules deep with a tip rounding of "
            f"{fillet:.3g} modules; give fillet_radius_coefficient <= {max(largest, 0.0):.3f}, a larger "
            'root_diameter, or root_profile = "radial"'
        )
    flag = f"root profile radial: a rounding of {fillet:.3g} modules exceeds the rack tip"
    return "radial", (flag,)


def undercut_flag(
    root_profile: RootProfile, teeth: int, pressure_angle: float, depth: float, fillet: float
) -> tuple[str, ...]:
    """Return the flag of a gear whose rack, ``depth`` modules below the pitch circle, undercuts slightly.

    References
    ----------
    Litvin & Fuentes: least number of teeth that a rack does not undercut.
    """
    sin = math.sin(pressure_angle)
    excess = depth - fillet * (1.0 - sin) - 0.5 * teeth * sin**2
    if root_profile == "radial" or excess <= 0.0:
        return ()
    return (f"undercut by a rack edge {excess:.3g} modules too deep, within the practical limit",)


def form_radius(
    *,
    name: str,
    teeth: int,
    module: float,
    pressure_angle: float,
    profile_shift: float,
    root_radius: float,
    fillet: float,
    root_profile: RootProfile,
) -> float:
    """Return the radius where the involute begins [m].

    A rack's straight edge ends at depth ``h_e = h − ρ (1 − sinα) − x`` below the pitch line and leaves
    ``ρ_form = r sinα − h_e m / sinα``; a radial root begins at the base circle (or at the root circle).
    A rack that reaches slightly deeper undercuts: the involute then begins where the root curve meets it,
    and the gear runs as long as its mate touches it above (checked with the pair).

    Raises
    ------
    GearError : undercut beyond the practical limit, 1.22 times the depth free of it

    References
    ----------
    DIN 3960: practical limit of the profile shift (14 − z)/17 instead of (17 − z)/17 at 20°.
    """
    r, alpha = 0.5 * module * teeth, pressure_angle
    r_b = r * math.cos(alpha)
    if root_profile == "radial":
        return max(r_b, root_radius)
    depth = (r - root_radius) / module - fillet * (1.0 - math.sin(alpha))
    curvature = r * math.sin(alpha) - depth * module / math.sin(alpha)
    if curvature >= 0.0:
        return math.hypot(r_b, curvature)
    limit = 0.5 * teeth * math.sin(alpha) ** 2
    if depth > PRACTICAL * limit:
        raise GearError(
            f"{name}: undercut: {teeth} teeth allow a rack edge {limit:.4g} modules below the pitch circle, "
            f"it needs {depth:.4g}; raise profile_shift_coefficient to {profile_shift + depth - limit:.4g}, "
            'use more teeth, or set root_profile = "radial"'
        )
    rho = fillet * module
    dedendum = r + profile_shift * module - root_radius
    offset = math.pi * module / 4 + (dedendum - rho) * math.tan(alpha) + rho / math.cos(alpha)
    half = math.pi / (2 * teeth) + 2.0 * profile_shift * math.tan(alpha) / teeth + involute(alpha)
    cut = Rounding(r, r_b, alpha, rho, r - root_radius - rho, offset, half)
    return cut.point(cut.last_angle())[0]

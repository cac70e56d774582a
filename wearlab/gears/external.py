"""External pairs: from two specifications to a pair that can run, or a refusal with its reason."""

import math

from wearlab.gears.build import build_gear
from wearlab.gears.errors import GearError
from wearlab.gears.gear import Gear
from wearlab.gears.modification import check_reliefs
from wearlab.gears.pair import GearPair, PathOfContact
from wearlab.gears.shifts import operating_position
from wearlab.gears.specification import Basics, GearSpec

CONTACT_TOLERANCE = 1e-9  # relative slack of a comparison of two lengths


def external_pair(
    first: GearSpec,
    second: GearSpec,
    basics: Basics,
    *,
    centre_distance: float | None = None,
    driving: str | None = None,
) -> GearPair:
    """Return the external pair of two gears, or refuse it.

    Parameters
    ----------
    first, second : the gears as specified
    basics : what they share
    centre_distance : operating centre distance [m]; absent: from the profile shifts
    driving : name of the driving gear; absent: the first

    Returns
    -------
    GearPair

    Raises
    ------
    GearError : no involute contact, contact ratio below 1, undercut, pointed tip, tip or fillet
        interference, impossible circles, contradicting shifts; with numbers and a remedy

    References
    ----------
    ISO 21771:2007, clauses 4 and 5.
    """
    check_basics(first, second, basics)
    if driving not in (None, first.name, second.name):
        raise GearError(f"driving gear {driving!r} is neither {first.name!r} nor {second.name!r}")
    operating = operating_position(
        (first.teeth, second.teeth),
        (first.profile_shift_coefficient, second.profile_shift_coefficient),
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        centre_distance=centre_distance,
    )
    gears = [
        build_gear(
            spec,
            basics,
            profile_shift=x,
            tip_alteration=operating.tip_alteration,
            assumed=operating.assumed,
        )
        for spec, x in zip((first, second), operating.shifts, strict=True)
    ]
    if driving == second.name:
        gears.reverse()
    pair = assemble_external(gears[0], gears[1], operating.centre_distance, operating.working_pressure_angle)
    check_pair(pair)
    return pair


def check_basics(first: GearSpec, second: GearSpec, basics: Basics) -> None:
    """Refuse a module or a pressure angle that no gear has, and two gears of one name.

    Raises
    ------
    GearError : naming the value
    """
    module, pressure_angle = basics[:2]
    if not module > 0.0:
        raise GearError(f"the module must be positive, not {module:g} m")
    if not 0.0 < pressure_angle < math.pi / 4:
        raise GearError(
            f"the pressure angle must lie between 0 and 45 deg, not {math.degrees(pressure_angle):.4g} deg"
        )
    if first.name == second.name:
        raise GearError(f"both gears are called {first.name!r}; give them two names")


def assemble_external(driving: Gear, driven: Gear, centre_distance: float, alpha_w: float) -> GearPair:
    """Return the pair with its path of contact cut off by the two tip circles, not yet checked.

    References
    ----------
    ISO 21771:2007, clause 5.
    """
    s_A = driven.base_radius * math.tan(alpha_w) - tip_curvature(driven)
    s_E = tip_curvature(driving) - driving.base_radius * math.tan(alpha_w)
    p_b = math.pi * driving.module * math.cos(driving.pressure_angle)
    whole = math.floor((s_E - s_A) / p_b)
    return GearPair(
        driving=driving,
        driven=driven,
        centre_distance=centre_distance,
        working_pressure_angle=alpha_w,
        base_pitch=p_b,
        path=PathOfContact(s_A, s_E - whole * p_b, 0.0, s_A + whole * p_b, s_E),
        face_width=min(driving.face_width, driven.face_width),
    )


def tip_curvature(gear: Gear) -> float:
    """Return the radius of curvature of the involute at the tip, √(r_a² − r_b²) [m].

    References
    ----------
    ISO 21771:2007, clause 4.
    """
    return math.sqrt(gear.tip_radius**2 - gear.base_radius**2)


def check_pair(pair: GearPair) -> None:
    """Refuse a pair that cannot run together.

    Raises
    ------
    GearError : contact ratio below 1, tip interference, fillet interference, tip into root
    """
    if not pair.contact_ratio >= 1.0:
        raise GearError(
            f"contact ratio {pair.contact_ratio:.4f} is below 1: the path of contact is "
            f"{(pair.path.E - pair.path.A) * 1e3:.4g} mm and the base pitch {pair.base_pitch * 1e3:.4g} mm; "
            "enlarge the tips or reduce the centre distance"
        )
    for gear, mate, s_root in (
        (pair.driving, pair.driven, pair.path.A),
        (pair.driven, pair.driving, -pair.path.E),
    ):
        start = gear.base_radius * math.tan(pair.working_pressure_angle) + s_root
        check_start(gear, mate, start)
        check_clearance(mate, gear, pair.centre_distance - mate.tip_radius - gear.root_radius)
        if gear.modification is not None:
            check_reliefs(gear.modification, pair.path.E - pair.path.A, gear.name)


def check_clearance(gear: Gear, mate: Gear, clearance: float) -> None:
    """Refuse a tip that runs into the mate's root."""
    if clearance <= 0.0:
        raise GearError(
            f"{gear.name}: its tip runs {-clearance * 1e3:.4g} mm into the root of {mate.name}; shorten "
            f"the tip of {gear.name} or deepen the root of {mate.name}"
        )


def check_start(gear: Gear, mate: Gear, curvature: float) -> None:
    """Refuse contact that begins beyond the base circle's tangent point, or below the form circle."""
    word, remedy = ("involute", ' (tip_alteration = "wang-2023")') if mate.internal else ("tip", "")
    if curvature <= 0.0:
        raise GearError(
            f"{word} interference: the tip of {mate.name} reaches {-curvature * 1e3:.4g} mm beyond the "
            f"tangent point of the base circle of {gear.name}; shorten the tip of {mate.name}{remedy} or "
            f"raise the profile shift of {gear.name}"
        )
    start = math.hypot(gear.base_radius, curvature)
    if start < gear.form_radius * (1.0 - CONTACT_TOLERANCE):
        raise GearError(
            f"fillet interference: {mate.name} would touch {gear.name} at diameter {2e3 * start:.5g} mm, "
            f"below its form diameter {2e3 * gear.form_radius:.5g} mm; shorten the tip of {mate.name}{remedy}"
            f", deepen the root of {gear.name} or reduce its fillet_radius_coefficient"
        )

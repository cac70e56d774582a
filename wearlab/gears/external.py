"""External gears and pairs: from specifications to a pair that can run, or a refusal with its reason."""

import math
from typing import NamedTuple

from wearlab.gears.gear import Gear, GearPair, PathOfContact
from wearlab.gears.root import RackCut, ToothRoot, root_of
from wearlab.gears.shifts import operating_position
from wearlab.gears.specification import Basics, GearError, GearSpec, check_material, check_reliefs

FEWEST_TEETH = 5


def build_gear(
    spec: GearSpec,
    basics: Basics,
    *,
    profile_shift: float,
    tip_alteration: float,
    assumed: tuple[str, ...] = (),
) -> Gear:
    """Resolve every dimension of one external gear.

    ``r_a = m (z/2 + x + h_a + k)``, ``r_f = m (z/2 + x − h_f)``, or the given diameters.

    Parameters
    ----------
    spec : what is given
    basics : of the set
    profile_shift, tip_alteration : x, and the k to use when the gear has none of its own [1]
    assumed : flags to carry along

    Returns
    -------
    Gear

    Raises
    ------
    GearError : with the reason, its numbers and a remedy

    References
    ----------
    ISO 21771:2007, 4: tip and root circle from profile shift and tip alteration.
    """
    check_specification(spec, basics.face_width)
    _check_external(spec)
    module, pressure_angle = basics[:2]
    r = 0.5 * module * spec.teeth
    r_b = r * math.cos(pressure_angle)
    k = tip_alteration if spec.tip_alteration_coefficient is None else spec.tip_alteration_coefficient
    r_a = spec.tip_radius(module, profile_shift, k, 1.0)
    generated = profile_shift + spec.thinning(module, pressure_angle)
    r_f = spec.root_radius(module, generated, 1.0)
    bore = 0.5 * (r_f if spec.bore_diameter is None else spec.bore_diameter)
    flags = ("bore_diameter assumed 0.5 root diameter",) if spec.bore_diameter is None else ()
    _check_circles(spec.name, r_b, r_a, r_f, bore)
    fillet = spec.fillet_radius_coefficient
    cut = RackCut(spec.teeth, module, pressure_angle, generated, r_f, fillet)
    root = root_of(spec.root_profile, spec.name, cut)
    circles = Circles(r_b, r_a, r_f, bore)
    gear = gear_of(spec, basics, generated, circles, root, (*assumed, *root.assumed, *flags))
    _check_tip(gear)
    return gear


class Circles(NamedTuple):
    """Radii of a gear's circles; the bore of a ring, outside its teeth, is that of its rim [m]."""

    base: float
    tip: float
    root: float
    bore: float


def gear_of(
    spec: GearSpec,
    basics: Basics,
    profile_shift: float,
    circles: Circles,
    root: ToothRoot,
    assumed: tuple[str, ...],
) -> Gear:
    """Return the gear of these circles and this root; what else is absent comes from the set or a solid."""
    r, internal = 0.5 * basics.module * spec.teeth, circles.bore > circles.tip
    material, width = spec.material or basics.material, spec.face_width or basics.face_width
    check_material(material, spec.name)
    assert width is not None  # check_specification
    mass, inertia, flags = solid(spec, material.density, width, max(r, circles.bore), min(r, circles.bore))
    return Gear(
        name=spec.name,
        teeth=spec.teeth,
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        profile_shift=profile_shift,
        base_radius=circles.base,
        reference_radius=r,
        tip_radius=circles.tip,
        root_radius=circles.root,
        form_radius=root.form_radius,
        fillet_radius=root.fillet_radius,
        root_profile=root.profile,
        bore_radius=circles.bore,
        face_width=width,
        material=material,
        mass=mass,
        inertia=inertia,
        assumed=(*assumed, *flags),
        modification=spec.modification(circles.base, circles.tip, internal=internal),
        internal=internal,
    )


def check_specification(spec: GearSpec, face_width: float | None) -> None:
    """Refuse what no gear can be: too few teeth, two answers to one question, sizes that are not positive.

    Raises
    ------
    GearError : naming the key and its remedy
    """
    name = spec.name
    if spec.teeth < FEWEST_TEETH:
        raise GearError(f"{name}: {spec.teeth} teeth cannot carry an involute; give at least {FEWEST_TEETH}")
    if spec.tip_diameter is not None and (
        spec.addendum_coefficient is not None or spec.tip_alteration_coefficient is not None
    ):
        raise GearError(f"{name}: give tip_diameter, or addendum and tip alteration coefficients, not both")
    if spec.root_diameter is not None and spec.dedendum_coefficient is not None:
        raise GearError(f"{name}: give root_diameter or dedendum_coefficient, not both")
    width = spec.face_width or face_width
    if width is None or not width > 0.0:
        raise GearError(
            f"{name}: face_width is missing or not positive; give it for the gear or for the pair"
        )
    if spec.tip_alteration is not None and (
        spec.tip_diameter is not None or spec.tip_alteration_coefficient is not None
    ):
        raise GearError(
            f"{name}: give tip_alteration, tip_alteration_coefficient or tip_diameter, not two of them"
        )
    for word in ("mass", "inertia", "bore_diameter"):
        value = getattr(spec, word)
        if value is not None and not value > 0.0:
            raise GearError(f"{name}: {word} must be positive, not {value:g}")


def _check_external(spec: GearSpec) -> None:
    if spec.rim_diameter is not None or spec.tip_alteration is not None:
        key = "rim_diameter" if spec.rim_diameter is not None else "tip_alteration"
        raise GearError(
            f"{spec.name}: {key} belongs to a ring, and this gear has external teeth; leave it out"
        )
    if spec.root_profile == "fillet":
        raise GearError(f'{spec.name}: root_profile "fillet" belongs to a ring; give "trochoid" or "radial"')


def _check_circles(name: str, r_b: float, r_a: float, r_f: float, bore: float) -> None:
    if not r_a > r_f:
        raise GearError(
            f"{name}: the tip diameter {2e3 * r_a:.5g} mm is not above the root diameter {2e3 * r_f:.5g} mm"
        )
    if not r_a > r_b:
        raise GearError(
            f"{name}: no involute: the tip diameter {2e3 * r_a:.5g} mm is not above the base diameter "
            f"{2e3 * r_b:.5g} mm; enlarge the tip or the profile shift"
        )
    if not 0.0 < bore < r_f:
        raise GearError(
            f"{name}: the bore diameter {2e3 * bore:.5g} mm must lie below the root diameter "
            f"{2e3 * r_f:.5g} mm, and both above 0"
        )


def solid(
    spec: GearSpec, density: float, width: float, outer: float, inner: float
) -> tuple[float, float, tuple[str, ...]]:
    """Return mass and inertia of the solid between two radii, where they are not given, and flags of it."""
    between = "rim" if spec.rim_diameter is not None else "bore"
    mass, flags = spec.mass, []
    if mass is None:
        mass = density * math.pi * width * (outer**2 - inner**2)
        flags.append(f"mass of the solid between {between} and reference circle")
    inertia = spec.inertia
    if inertia is None:
        inertia = 0.5 * mass * (outer**2 + inner**2)
        flags.append(f"inertia of the solid between {between} and reference circle")
    return mass, inertia, tuple(flags)


def _check_tip(gear: Gear) -> None:
    if not gear.tip_radius > gear.form_radius:
        raise GearError(
            f"{gear.name}: no involute is left between the form diameter {2e3 * gear.form_radius:.5g} mm "
            f"and the tip diameter {2e3 * gear.tip_radius:.5g} mm; reduce the rounding or the profile shift"
        )
    refuse_pointed(gear)


def refuse_pointed(gear: Gear) -> None:
    """Refuse a gear whose teeth have no thickness left at the tip.

    Raises
    ------
    GearError : it is pointed
    """
    half = gear.half_angle(gear.tip_radius)
    if half <= 0.0:
        raise GearError(
            f"{gear.name}: pointed tip: at the tip diameter {2e3 * gear.tip_radius:.5g} mm the tooth is "
            f"{2e3 * gear.tip_radius * half:.3g} mm thick; shorten it or reduce profile_shift_coefficient"
        )


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
    check_pair(pair, -sum(spec.tooth_thickness_allowance for spec in (first, second)))
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
    return paired(driving, driven, centre_distance, alpha_w, (s_A, s_E))


def paired(
    driving: Gear, driven: Gear, centre_distance: float, alpha_w: float, ends: tuple[float, float]
) -> GearPair:
    """Return the pair whose path of contact has these ends, s_A and s_E [m]."""
    (s_A, s_E), p_b = ends, math.pi * driving.module * math.cos(driving.pressure_angle)
    whole = math.floor((s_E - s_A) / p_b)
    path = PathOfContact(s_A, s_E - whole * p_b, 0.0, s_A + whole * p_b, s_E)
    width = min(driving.face_width, driven.face_width)
    return GearPair(driving, driven, centre_distance, alpha_w, p_b, path, width)


def tip_curvature(gear: Gear) -> float:
    """Return the radius of curvature of the involute at the tip, √(r_a² − r_b²) [m].

    References
    ----------
    ISO 21771:2007, clause 4.
    """
    return math.sqrt(gear.tip_radius**2 - gear.base_radius**2)


def check_pair(pair: GearPair, thinned: float = 0.0) -> None:
    """Refuse a pair that cannot run together.

    Parameters
    ----------
    pair : the gears in mesh
    thinned : by how much allowances thin both teeth at the reference circles [m]

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
    check_backlash(pair, thinned)


def check_backlash(pair: GearPair, thinned: float = 0.0) -> None:
    """Refuse teeth that are thicker than the spaces at the centre distance given.

    Parameters
    ----------
    pair : the gears in mesh
    thinned : by how much allowances thin both teeth at the reference circles, ``ΔJ_bn = thinned cos α`` [m]

    Raises
    ------
    GearError : the backlash is negative by more than printed numbers are rounded
    """
    if pair.backlash < -pair.rounding:
        names = " and ".join(gear.name for gear in pair.gears)
        farther = "reduce" if pair.internal else "raise"
        added = thinned * math.cos(pair.driving.pressure_angle)
        left = f"{pair.backlash * 1e6:.4g} µm"
        if added:
            without = f"{(pair.backlash - added) * 1e6:.4g} µm"
            left = f"{without}, allowances of the tooth thickness add {added * 1e6:.4g} µm: together {left}"
        by = -pair.backlash / (2.0 * math.sin(pair.working_pressure_angle))
        raise GearError(
            f"the teeth of {names} jam: the backlash that profile shifts and centre distance leave is "
            f"{left} along the line of action; {farther} the centre distance by {by * 1e3:.3g} mm, give "
            f"{'more' if added else 'a'} tooth_thickness_allowance below 0, or leave out one of shifts and "
            "centre distance"
        )


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

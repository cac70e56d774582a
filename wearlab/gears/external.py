"""Gears, rings among them, and external pairs: from specifications to a pair that can run, or a refusal."""

import math

from wearlab.gears.gear import Gear, GearPair, in_mesh
from wearlab.gears.root import RackCut, ring_root, root_of
from wearlab.gears.shifts import operating_position
from wearlab.gears.specification import Basics, GearError, GearSpec, check_reliefs, refuse

FEWEST_TEETH = 5


def build_gear(
    spec: GearSpec,
    basics: Basics,
    profile_shift: float,
    tip_alteration: float = 0.0,
    assumed: tuple[str, ...] = (),
    *,
    internal: bool = False,
) -> Gear:
    """Resolve every dimension of one gear.

    ``r_a = m (z/2 + x ± (h_a + k))``, ``r_f = m (z/2 + x ∓ h_f)``, or the given diameters; lower signs of a
    ring. A ring without a tip alteration of its own has k = 0: profile shifts leave its tip clearances at the
    standard ones or above, and the pair may shorten it further (:mod:`wearlab.gears.internal`). Its
    ``tip_alteration = "wang-2023"`` puts the tip at ``r − m h_a + m/(z tan²α)``, about where an unshifted
    pinion's involute begins.

    Parameters
    ----------
    spec : what is given; of a ring ``rim_diameter`` is required
    basics : of the set
    profile_shift, tip_alteration : x, and the k to use when the gear has none of its own [1]
    assumed : flags to carry along
    internal : whether it is a ring; positive shifts give it larger tooth spaces, farther out

    Returns
    -------
    Gear : the ``bore_radius`` of a ring is the outside radius of its rim; mass and inertia that are absent
        are those of the solid between bore or rim and reference circle

    Raises
    ------
    GearError : with the reason, its numbers and a remedy

    References
    ----------
    ISO 21771:2007, 4: tip and root circle from profile shift and tip alteration; Wang et al., Appl. Sci. 13
    (2023) 2022, Table 1, for that of a ring.
    """
    _check_specification(spec, basics.face_width, internal=internal)
    module, pressure_angle = basics[:2]
    r, outwards = 0.5 * module * spec.teeth, -1.0 if internal else 1.0
    r_b = r * math.cos(pressure_angle)
    k = tip_alteration if spec.tip_alteration_coefficient is None else spec.tip_alteration_coefficient
    if spec.tip_alteration == "wang-2023":
        k = -1.0 / (spec.teeth * math.tan(pressure_angle) ** 2)
    r_a = spec.tip_radius(module, profile_shift, k, outwards)
    generated = profile_shift + outwards * spec.thinning(module, pressure_angle)
    r_f = spec.root_radius(module, generated, outwards)
    held = spec.rim_diameter if internal else spec.bore_diameter
    bore = 0.5 * (r_f if held is None else held)
    _check_circles(spec.name, r_b, r_a, r_f, bore, internal=internal)
    cut = RackCut(spec.teeth, module, pressure_angle, generated, r_f, spec.fillet_radius_coefficient)
    root = (
        ring_root(spec.root_profile, spec.name, cut, r_a)
        if internal
        else root_of(spec.root_profile, spec.name, cut)
    )
    material, width = spec.material or basics.material, spec.face_width or basics.face_width
    E, nu, density = material
    lacks = "a material needs youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and density > 0, not"
    exists = E > 0.0 and 0.0 <= nu < 0.5 and density > 0.0
    refuse(spec.name, {f"{lacks} {E:g} Pa, {nu:g} and {density:g} kg/m³": not exists})
    assert width is not None  # _check_specification
    inner, outer = sorted((r, bore))
    mass, inertia, flags = spec.mass, spec.inertia, [*assumed, *root.assumed]
    if held is None:
        flags.append("bore_diameter assumed 0.5 root diameter")
    between = f"of the solid between {'rim' if internal else 'bore'} and reference circle"
    if mass is None:
        mass = density * math.pi * width * (outer**2 - inner**2)
        flags.append(f"mass {between}")
    if inertia is None:
        inertia = 0.5 * mass * (outer**2 + inner**2)
        flags.append(f"inertia {between}")
    gear = Gear(
        name=spec.name,
        teeth=spec.teeth,
        module=module,
        pressure_angle=pressure_angle,
        profile_shift=generated,
        base_radius=r_b,
        reference_radius=r,
        tip_radius=r_a,
        root_radius=r_f,
        form_radius=root.form_radius,
        fillet_radius=root.fillet_radius,
        root_profile=root.profile,
        bore_radius=bore,
        face_width=width,
        material=material,
        mass=mass,
        inertia=inertia,
        assumed=tuple(flags),
        modification=spec.modification(r_b, r_a, internal=internal),
        internal=internal,
    )
    _check_tip(gear)
    return gear


def _check_specification(spec: GearSpec, face_width: float | None, *, internal: bool) -> None:
    """Refuse what no gear can be: too few teeth, two answers to one question, sizes that are not positive."""
    width, fillet = spec.face_width or face_width, spec.fillet_radius_coefficient
    tip, rim, wang = spec.tip_diameter is not None, spec.rim_diameter, spec.tip_alteration is not None
    tips = spec.addendum_coefficient, spec.tip_alteration_coefficient
    sizes = {word: getattr(spec, word) for word in ("mass", "inertia", "bore_diameter")}
    roots = spec.root_diameter, spec.dedendum_coefficient
    key = "tip_alteration" if rim is None else "rim_diameter"
    of_ring = {
        "rim_diameter is missing: a ring needs the outside diameter of its rim, above its root diameter": (
            rim is None or not rim > 0.0
        ),
        "a ring has no bore_diameter; give rim_diameter, outside its teeth": spec.bore_diameter is not None,
        'root_profile "trochoid" needs the cutter that made the ring; give "fillet" (a circle between '
        'involute and root circle) or "radial" (the involute up to the root circle)': (
            spec.root_profile == "trochoid"
        ),
        f"fillet_radius_coefficient must not be negative, not {fillet:g}": fillet < 0.0,
    }
    of_external = {
        f"{key} belongs to a ring, and this gear has external teeth; leave it out": wang or rim is not None,
        'root_profile "fillet" belongs to a ring; give "trochoid" or "radial"': spec.root_profile == "fillet",
    }
    reasons = {
        f"{spec.teeth} teeth cannot carry an involute; give at least {FEWEST_TEETH}": (
            spec.teeth < FEWEST_TEETH
        ),
        "give tip_diameter, or addendum and tip alteration coefficients, not both": (
            tip and tips != (None, None)
        ),
        "give root_diameter or dedendum_coefficient, not both": None not in roots,
        "face_width is missing or not positive; give it for the gear or for the pair": (
            width is None or not width > 0.0
        ),
        "give tip_alteration, tip_alteration_coefficient or tip_diameter, not two of them": (
            wang and (tip or tips[1] is not None)
        ),
        **{f"{word} must be positive, not {v:g}": not v > 0.0 for word, v in sizes.items() if v is not None},
        **(of_ring if internal else of_external),
    }
    refuse(spec.name, reasons)


def _check_circles(name: str, r_b: float, r_a: float, r_f: float, bore: float, *, internal: bool) -> None:
    base, tip, root, held = (f"{2e3 * radius:.5g} mm" for radius in (r_b, r_a, r_f, bore))
    of_ring = {
        f"involute interference: the ring's tip diameter {tip} is not above its base diameter {base}, "
        'where the involute ends; shorten the tip with tip_alteration = "wang-2023", a larger '
        "tip_diameter or a smaller addendum_coefficient": not r_a > r_b,
        f"the root diameter {root} of a ring must lie above its tip diameter {tip}": not r_f > r_a,
        f"rim_diameter {held} must lie above the root diameter {root}": not bore > r_f,
    }
    of_external = {
        f"the tip diameter {tip} is not above the root diameter {root}": not r_a > r_f,
        f"no involute: the tip diameter {tip} is not above the base diameter {base}; enlarge the tip or "
        "the profile shift": not r_a > r_b,
        f"the bore diameter {held} must lie below the root diameter {root}, and both above 0": (
            not 0.0 < bore < r_f
        ),
    }
    refuse(name, of_ring if internal else of_external)


def _check_tip(gear: Gear) -> None:
    """Refuse a gear without an involute, or whose teeth have no thickness left at the tip."""
    half = gear.half_angle(gear.tip_radius)
    tip, form = (f"{2e3 * radius:.5g} mm" for radius in (gear.tip_radius, gear.form_radius))
    of_ring = f"the tip diameter {tip} and the form diameter {form}; reduce fillet_radius_coefficient"
    of_external = (
        f"the form diameter {form} and the tip diameter {tip}; reduce the rounding or the profile shift"
    )
    height = (gear.form_radius - gear.tip_radius) * (1.0 if gear.internal else -1.0)
    reasons = {
        f"no involute is left between {of_ring if gear.internal else of_external}": not height > 0.0,
        f"pointed tip: at the tip diameter {tip} the tooth is {2e3 * gear.tip_radius * half:.3g} mm thick; "
        "shorten it or reduce profile_shift_coefficient": half <= 0.0,
    }
    refuse(gear.name, reasons)


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
    specs = first, second
    shifts = first.profile_shift_coefficient, second.profile_shift_coefficient
    operating = operating_position((first.teeth, second.teeth), shifts, basics, centre_distance)
    gears = [
        build_gear(spec, basics, x, operating.tip_alteration, operating.assumed)
        for spec, x in zip(specs, operating.shifts, strict=True)
    ]
    if driving == second.name:
        gears.reverse()
    pair = in_mesh(gears[0], gears[1], operating.centre_distance, operating.working_pressure_angle)
    check_pair(pair, -sum(spec.tooth_thickness_allowance for spec in specs))
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
    check_contact_ratio(pair, "enlarge the tips or reduce the centre distance")
    for gear, mate, s_root in (
        (pair.driving, pair.driven, pair.path.A),
        (pair.driven, pair.driving, -pair.path.E),
    ):
        start = gear.base_radius * math.tan(pair.working_pressure_angle) + s_root
        check_start(gear, mate, start)
        check_clearance(mate, gear, pair.centre_distance - mate.tip_radius - gear.root_radius)
        check_reliefs(gear.modification, pair.path.E - pair.path.A, gear.name)
    check_backlash(pair, thinned)


def check_contact_ratio(pair: GearPair, remedy: str) -> None:
    """Refuse a pair of which at times no teeth touch, and say what helps."""
    if not pair.contact_ratio >= 1.0:
        raise GearError(
            f"contact ratio {pair.contact_ratio:.4f} is below 1: the path of contact is "
            f"{(pair.path.E - pair.path.A) * 1e3:.4g} mm and the base pitch {pair.base_pitch * 1e3:.4g} mm; "
            f"{remedy}"
        )


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

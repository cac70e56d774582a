"""Gears, rings among them: from a specification to every dimension, or a refusal with its reason."""

import math

from wearlab.gears.gear import Gear
from wearlab.gears.root import RackCut, ring_root, root_of
from wearlab.gears.specification import Basics, GearSpec, refuse


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

    ``r_a = m (z/2 + x ± (h_a + k))``, ``r_f = m (z/2 + x ∓ h_f)``, or the given
    diameters; lower signs of a ring. A ring without a tip alteration of its own has k =
    0: profile shifts leave its tip clearances at the standard ones or above, and the
    pair may shorten it further (:mod:`wearlab.gears.pairs`). Its ``tip_alteration =
    "wang-2023"`` puts the tip at ``r − m h_a + m/(z tan²α)``, about where an unshifted
    pinion's involute begins.

    Parameters
    ----------
    spec : what is given; of a ring ``rim_diameter`` is required
    basics : of the set
    profile_shift, tip_alteration : x, and the k to use when the gear has none of its
        own [1]
    assumed : flags to carry along
    internal : whether it is a ring; positive shifts give it larger tooth spaces,
        farther out

    Returns
    -------
    Gear : the ``bore_radius`` of a ring is the outside radius of its rim; mass and
        inertia that are absent are those of the solid between bore or rim and reference
        circle

    Raises
    ------
    GearError : with the reason, its numbers and a remedy

    References
    ----------
    ISO 21771:2007, 4: tip and root circle from profile shift and tip alteration; Wang
    et al., Appl. Sci. 13 (2023) 2022, Table 1, for that of a ring.
    """
    width = _check_specification(spec, basics.face_width, internal=internal)
    module, pressure_angle = basics[:2]
    r = 0.5 * module * spec.teeth
    outwards = -1.0 if internal else 1.0
    r_b = r * math.cos(pressure_angle)
    k = (
        tip_alteration
        if spec.tip_alteration_coefficient is None
        else spec.tip_alteration_coefficient
    )
    if spec.tip_alteration == "wang-2023":
        k = -1.0 / (spec.teeth * math.tan(pressure_angle) ** 2)
    r_a = spec.tip_radius(module, profile_shift, k, outwards)
    generated = profile_shift + outwards * spec.thinning(module, pressure_angle)
    r_f = spec.root_radius(module, generated, outwards)
    held = spec.rim_diameter if internal else spec.bore_diameter
    bore = 0.5 * (r_f if held is None else held)
    _check_circles(spec.name, r_b, r_a, r_f, bore, internal=internal)
    cut = RackCut(
        spec.teeth,
        module,
        pressure_angle,
        generated,
        r_f,
        spec.fillet_radius_coefficient,
    )
    asked = spec.root_profile, spec.name, cut
    root = ring_root(*asked, r_a) if internal else root_of(*asked)
    E, nu, density = material = spec.material or basics.material
    lacks = (
        "a material needs youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and density > "
        "0, not"
    )
    exists = E > 0.0 and 0.0 <= nu < 0.5 and density > 0.0
    refuse(spec.name, {f"{lacks} {E:g} Pa, {nu:g} and {density:g} kg/m³": not exists})
    mass = spec.mass
    inertia = spec.inertia
    flags = [*assumed, *root.assumed]
    if held is None:
        flags.append("bore_diameter assumed 0.5 root diameter")
    between = (
        f"of the solid between {'rim' if internal else 'bore'} and reference circle"
    )
    if mass is None:
        mass = density * math.pi * width * abs(r**2 - bore**2)
        flags.append(f"mass {between}")
    if inertia is None:
        inertia = 0.5 * mass * (r**2 + bore**2)
        flags.append(f"inertia {between}")
    sizes = (
        r_b,
        r,
        r_a,
        r_f,
        root.form_radius,
        root.fillet_radius,
        root.profile,
        bore,
        width,
    )
    body = (
        material,
        mass,
        inertia,
        tuple(flags),
        spec.modification(r_b, r_a, internal=internal),
        internal,
    )
    gear = Gear(spec.name, spec.teeth, module, pressure_angle, generated, *sizes, *body)
    _check_tip(gear)
    return gear


def _check_specification(
    spec: GearSpec, face_width: float | None, *, internal: bool
) -> float:
    """Refuse what no gear can be: too few teeth, two answers to one question, sizes that are not positive.

    Return its face width [m].
    """
    width = spec.face_width or face_width or 0.0
    fillet = spec.fillet_radius_coefficient
    tip = spec.tip_diameter is not None
    rim = spec.rim_diameter
    wang = spec.tip_alteration is not None
    height = spec.addendum_coefficient is not None
    alteration = spec.tip_alteration_coefficient is not None
    sizes = {word: getattr(spec, word) for word in ("mass", "inertia", "bore_diameter")}
    twice = None not in (spec.root_diameter, spec.dedendum_coefficient)
    two = wang and (tip or alteration)
    key = "tip_alteration" if rim is None else "rim_diameter"
    racked = spec.root_profile == "trochoid"
    of_ring = {
        "rim_diameter is missing: a ring needs the outside diameter of its rim, above "
        "its root "
        "diameter": not (rim or 0.0) > 0.0,
        "a ring has no bore_diameter; give rim_diameter, outside its teeth": spec.bore_diameter
        is not None,
        'root_profile "trochoid" needs the cutter that made the ring; give "fillet" '
        "(a circle between "
        'involute and root circle) or "radial" (the involute up to the root circle)': racked,
        f"fillet_radius_coefficient must not be negative, not {fillet:g}": fillet < 0.0,
    }
    of_external = {
        f"{key} belongs to a ring, and this gear has external teeth; leave it out": wang
        or rim is not None,
        'root_profile "fillet" belongs to a ring; give "trochoid" or "radial"': spec.root_profile
        == "fillet",
    }
    both_tips = (
        "give tip_diameter, or addendum and tip alteration coefficients, not both"
    )
    reasons = {
        f"{spec.teeth} teeth cannot carry an involute; give at least 5": spec.teeth < 5,
        both_tips: tip and (height or alteration),
        "give root_diameter or dedendum_coefficient, not both": twice,
        "face_width is missing or not positive; give it for the gear or for the pair": not width
        > 0.0,
        "give tip_alteration, tip_alteration_coefficient or tip_diameter, not two of "
        "them": two,
        **{
            f"{word} must be positive, not {v:g}": not v > 0.0
            for word, v in sizes.items()
            if v is not None
        },
        **(of_ring if internal else of_external),
    }
    refuse(spec.name, reasons)
    return width


def _check_circles(
    name: str, r_b: float, r_a: float, r_f: float, bore: float, *, internal: bool
) -> None:
    base, tip, root, held = (
        f"{2e3 * radius:.5g} mm" for radius in (r_b, r_a, r_f, bore)
    )
    beyond = not 0.0 < bore < r_f
    of_ring = {
        f"involute interference: the ring's tip diameter {tip} is not above its base "
        f"diameter {base}, "
        'where the involute ends; shorten the tip with tip_alteration = "wang-2023", '
        "a larger "
        "tip_diameter or a smaller addendum_coefficient": not r_a > r_b,
        f"the root diameter {root} of a ring must lie above its tip diameter {tip}": not r_f
        > r_a,
        f"rim_diameter {held} must lie above the root diameter {root}": not bore > r_f,
    }
    of_external = {
        f"the tip diameter {tip} is not above the root diameter {root}": not r_a > r_f,
        f"no involute: the tip diameter {tip} is not above the base diameter {base}; "
        "enlarge the tip or "
        "the profile shift": not r_a > r_b,
        f"the bore diameter {held} must lie below the root diameter {root}, and both "
        "above 0": beyond,
    }
    refuse(name, of_ring if internal else of_external)


def _check_tip(gear: Gear) -> None:
    """Refuse a gear without an involute, or whose teeth have no thickness left at the tip."""
    half = gear.half_angle(gear.tip_radius)
    tip, form = (
        f"{2e3 * radius:.5g} mm" for radius in (gear.tip_radius, gear.form_radius)
    )
    ends = f"form diameter {form} and the tip diameter {tip}"
    less = "the rounding or the profile shift"
    if gear.internal:
        ends = f"tip diameter {tip} and the form diameter {form}"
        less = "fillet_radius_coefficient"
    height = gear.outwards * (gear.tip_radius - gear.form_radius)
    reasons = {
        f"no involute is left between the {ends}; reduce {less}": not height > 0.0,
        f"pointed tip: at the tip diameter {tip} the tooth is "
        f"{2e3 * gear.tip_radius * half:.3g} mm thick; "
        "shorten it or reduce profile_shift_coefficient": half <= 0.0,
    }
    refuse(gear.name, reasons)

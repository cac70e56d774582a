"""Gears, rings among them: every dimension of a specification, or why there is none."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from wearlab.gears.gear import Gear
from wearlab.gears.root import RackCut, ToothRoot, ring_root, root_of
from wearlab.gears.specification import (
    Basics,
    GearSpec,
    Material,
    refuse_first,
)

MIN_TEETH = 5
BISECTIONS = 60


class _Circles(NamedTuple):
    """Radii of a gear: base, reference, tip and root circle, and bore or rim [m].

    ``usable_tip`` is where a chamfer ends the active flank, None without one.
    """

    base: float
    reference: float
    tip: float
    root: float
    bore: float
    usable_tip: float | None

    @property
    def active_tip(self) -> float:
        """Radius at which the active flank ends [m]."""
        return self.tip if self.usable_tip is None else self.usable_tip


class _Body(NamedTuple):
    """Mass [kg] and inertia [kg·m²] of a gear, and what is assumed of its body."""

    mass: float
    inertia: float
    assumed: tuple[str, ...]


def build_gear(
    spec: GearSpec,
    basics: Basics,
    profile_shift: float,
    tip_alteration: float = 0.0,
    assumed: tuple[str, ...] = (),
    *,
    internal: bool = False,
    least_tip: float | None = None,
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
    least_tip : tip diameter of a ring that its mate's involute just reaches, where that
        is known [m]

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
    width = spec.face_width or basics.face_width or 0.0
    refuse_first(spec.name, _specification_problems(spec, width, internal=internal))

    outwards = -1.0 if internal else 1.0
    thinning = spec.thinning(basics.module, basics.pressure_angle)
    generated_shift = profile_shift + outwards * thinning
    circles = _circles(
        spec,
        basics,
        profile_shift=profile_shift,
        generated_shift=generated_shift,
        tip_alteration=tip_alteration,
        outwards=outwards,
    )
    if internal:
        refuse_first(spec.name, _ring_circle_problems(circles, least_tip))
    else:
        refuse_first(spec.name, _circle_problems(circles))

    cut = RackCut(
        teeth=spec.teeth,
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        profile_shift=generated_shift,
        root_radius=circles.root,
        fillet=spec.fillet_radius_coefficient,
    )
    tooth_root = _tooth_root(spec, cut, circles.tip, internal=internal)
    material = spec.material or basics.material
    refuse_first(spec.name, _material_problems(material))
    body = _body(spec, material, circles, width, internal=internal)

    gear = Gear(
        name=spec.name,
        teeth=spec.teeth,
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        profile_shift=generated_shift,
        base_radius=circles.base,
        reference_radius=circles.reference,
        tip_radius=circles.tip,
        root_radius=circles.root,
        form_radius=tooth_root.form_radius,
        fillet_radius=tooth_root.fillet_radius,
        root_profile=tooth_root.profile,
        bore_radius=circles.bore,
        face_width=width,
        material=material,
        mass=body.mass,
        inertia=body.inertia,
        assumed=(*assumed, *tooth_root.assumed, *body.assumed),
        modification=spec.modification(
            circles.base, circles.active_tip, internal=internal
        ),
        internal=internal,
        usable_tip_radius=circles.usable_tip,
    )
    refuse_first(gear.name, _tip_problems(gear))
    return gear


def _circles(
    spec: GearSpec,
    basics: Basics,
    *,
    profile_shift: float,
    generated_shift: float,
    tip_alteration: float,
    outwards: float,
) -> _Circles:
    """Return the circles of a gear, not yet checked."""
    module = basics.module
    k = _tip_alteration(spec, basics.pressure_angle, tip_alteration)
    reference_radius = 0.5 * module * spec.teeth
    root_radius = spec.root_radius(module, generated_shift, outwards)
    bore_diameter = _bore_diameter(spec, internal=outwards < 0.0)
    tip_radius = spec.tip_radius(module, profile_shift, k, outwards)
    return _Circles(
        base=reference_radius * math.cos(basics.pressure_angle),
        reference=reference_radius,
        tip=tip_radius,
        root=root_radius,
        bore=0.5 * (root_radius if bore_diameter is None else bore_diameter),
        usable_tip=spec.usable_tip_radius(tip_radius, outwards),
    )


def _bore_diameter(spec: GearSpec, *, internal: bool) -> float | None:
    """Return the diameter at which the body is held, as given: bore or rim [m]."""
    return spec.rim_diameter if internal else spec.bore_diameter


def _tip_alteration(spec: GearSpec, pressure_angle: float, default: float) -> float:
    """Return k of a gear [1]."""
    if spec.tip_alteration == "wang-2023":
        return -1.0 / (spec.teeth * math.tan(pressure_angle) ** 2)
    if spec.tip_alteration_coefficient is None:
        return default
    return spec.tip_alteration_coefficient


def _tooth_root(
    spec: GearSpec, cut: RackCut, tip_radius: float, *, internal: bool
) -> ToothRoot:
    """Return the root of a tooth, external or of a ring."""
    if internal:
        return ring_root(spec.root_profile, spec.name, cut, tip_radius)
    return root_of(spec.root_profile, spec.name, cut)


def _body(
    spec: GearSpec,
    material: Material,
    circles: _Circles,
    width: float,
    *,
    internal: bool,
) -> _Body:
    """Return mass and inertia as given, or of the solid up to the reference circle.

    ``m = ρ π b |r² − r_bore²|``, ``J = ½ m (r² + r_bore²)``.
    """
    r = circles.reference
    bore = circles.bore
    solid = f"of the solid between {'rim' if internal else 'bore'} and reference circle"
    assumed = []
    if _bore_diameter(spec, internal=internal) is None:
        assumed.append("bore_diameter assumed 0.5 root diameter")
    mass = spec.mass
    if mass is None:
        mass = material.density * math.pi * width * abs(r**2 - bore**2)
        assumed.append(f"mass {solid}")
    inertia = spec.inertia
    if inertia is None:
        inertia = 0.5 * mass * (r**2 + bore**2)
        assumed.append(f"inertia {solid}")
    return _Body(mass, inertia, tuple(assumed))


def _specification_problems(
    spec: GearSpec, width: float, *, internal: bool
) -> Iterator[str]:
    """Yield what no gear can be: few teeth, two answers to one question, no size."""
    has_tip_diameter = spec.tip_diameter is not None
    has_addendum = spec.addendum_coefficient is not None
    has_tip_alteration = spec.tip_alteration is not None
    has_tip_coefficient = spec.tip_alteration_coefficient is not None
    if spec.teeth < MIN_TEETH:
        yield f"{spec.teeth} teeth cannot carry an involute; give at least {MIN_TEETH}"
    if has_tip_diameter and (has_addendum or has_tip_coefficient):
        yield "give tip_diameter, or addendum and tip alteration coefficients, not both"
    if spec.root_diameter is not None and spec.dedendum_coefficient is not None:
        yield "give root_diameter or dedendum_coefficient, not both"
    if not width > 0.0:
        yield (
            "face_width is missing or not positive; give it for the gear or for the "
            "pair"
        )
    if spec.tip_chamfer is not None and spec.usable_tip_diameter is not None:
        yield "give tip_chamfer or usable_tip_diameter, not both"
    if has_tip_alteration and (has_tip_diameter or has_tip_coefficient):
        yield (
            "give tip_alteration, tip_alteration_coefficient or tip_diameter, not two "
            "of them"
        )
    for key in ("mass", "inertia", "bore_diameter"):
        value = getattr(spec, key)
        if value is not None and not value > 0.0:
            yield f"{key} must be positive, not {value:g}"
    yield from _ring_problems(spec) if internal else _external_problems(spec)


def _ring_problems(spec: GearSpec) -> Iterator[str]:
    """Yield what no ring can be."""
    fillet = spec.fillet_radius_coefficient
    if not (spec.rim_diameter or 0.0) > 0.0:
        yield (
            "rim_diameter is missing: a ring needs the outside diameter of its rim, "
            "above its root diameter"
        )
    if spec.bore_diameter is not None:
        yield "a ring has no bore_diameter; give rim_diameter, outside its teeth"
    if spec.root_profile == "trochoid":
        yield (
            'root_profile "trochoid" needs the cutter that made the ring; give '
            '"fillet" (a circle between involute and root circle) or "radial" (the '
            "involute up to the root circle)"
        )
    if fillet < 0.0:
        yield f"fillet_radius_coefficient must not be negative, not {fillet:g}"


def _external_problems(spec: GearSpec) -> Iterator[str]:
    """Yield what no gear with external teeth can be."""
    if spec.tip_alteration is not None or spec.rim_diameter is not None:
        key = "tip_alteration" if spec.rim_diameter is None else "rim_diameter"
        yield f"{key} belongs to a ring, and this gear has external teeth; leave it out"
    if spec.root_profile == "fillet":
        yield 'root_profile "fillet" belongs to a ring; give "trochoid" or "radial"'


def _ring_circle_problems(circles: _Circles, least_tip: float | None) -> Iterator[str]:
    """Yield what is wrong with the order of the circles of a ring."""
    tip = _diameter(circles.tip)
    root = _diameter(circles.root)
    if not circles.tip > circles.base:
        larger = "a larger tip_diameter"
        if least_tip is not None:
            larger = f"a tip_diameter of {rounded_up(least_tip):.3f} mm at least"
        yield (
            f"involute interference: the ring's tip diameter {tip} is not above its "
            f"base diameter {_diameter(circles.base)}, where the involute ends; give "
            f"it {larger}"
        )
    if not circles.root > circles.tip:
        yield (
            f"the root diameter {root} of a ring must lie above its tip diameter "
            f"{tip}; {_moved('smaller', 'larger', circles.tip > circles.reference)}"
        )
    if not circles.bore > circles.root:
        bore = _diameter(circles.bore)
        yield f"rim_diameter {bore} must lie above the root diameter {root}"


def _moved(tip: str, root: str, is_tip: bool) -> str:
    """Return which of tip and root circle to move, and how, as advice."""
    if is_tip:
        return f"give it a {tip} tip_diameter"
    return f"give it a {root} root_diameter"


def _circle_problems(circles: _Circles) -> Iterator[str]:
    """Yield what is wrong with the order of the circles of an external gear."""
    base = _diameter(circles.base)
    tip = _diameter(circles.tip)
    root = _diameter(circles.root)
    bore = _diameter(circles.bore)
    if not circles.tip > circles.root:
        yield (
            f"the tip diameter {tip} is not above the root diameter {root}; "
            f"{_moved('larger', 'smaller', circles.tip < circles.reference)}"
        )
    if not circles.active_tip > circles.base:
        active_tip = _diameter(circles.active_tip)
        enlarge = "enlarge the tip or the profile shift"
        if circles.tip > circles.base:
            enlarge = "reduce the chamfer of the tip"
        yield (
            f"no involute: the tip diameter {active_tip} is not above the base "
            f"diameter {base}; {enlarge}"
        )
    if not 0.0 < circles.bore < circles.root:
        yield (
            f"the bore diameter {bore} must lie below the root diameter {root}, and "
            "both above 0"
        )


def _material_problems(material: Material) -> Iterator[str]:
    """Yield what is wrong with the numbers of a material."""
    E, nu, density, _ = material
    if not (E > 0.0 and 0.0 <= nu < 0.5 and density > 0.0):
        yield (
            "a material needs youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and density "
            f"> 0, not {E:g} Pa, {nu:g} and {density:g} kg/m³"
        )


def _tip_problems(gear: Gear) -> Iterator[str]:
    """Yield that a gear has no involute, or that its teeth are pointed at the tip."""
    tip = _diameter(gear.active_tip_radius)
    form = _diameter(gear.form_radius)
    if not gear.outwards * (gear.tip_radius - gear.active_tip_radius) >= 0.0:
        yield (
            f"usable_tip_diameter {tip} lies beyond the tip diameter "
            f"{_diameter(gear.tip_radius)}; the chamfer of the tip lies within it"
        )
    if not gear.outwards * (gear.active_tip_radius - gear.form_radius) > 0.0:
        remedy = "enlarge the tip or reduce fillet_radius_coefficient"
        if gear.outwards * (gear.tip_radius - gear.form_radius) > 0.0:
            remedy = "reduce the chamfer of the tip"
        yield (
            f"no involute is left between the tip diameter {tip} and the form diameter "
            f"{form}; {remedy}"
        )
    tip = _diameter(gear.tip_radius)
    half_angle = gear.half_angle(gear.tip_radius)
    if half_angle <= 0.0:
        thickness = 2e3 * gear.tip_radius * half_angle
        yield (
            f"pointed tip: at the tip diameter {tip} the tooth is {thickness:.3g} mm "
            f"thick; give it a tip_diameter of {_blunt_tip(gear)}, or reduce "
            "profile_shift_coefficient"
        )


def _blunt_tip(gear: Gear) -> str:
    """Return up to which diameter the teeth of a gear with pointed tips have a top."""
    pointed = gear.tip_radius
    thick = gear.form_radius
    for _ in range(BISECTIONS):
        middle = 0.5 * (pointed + thick)
        if gear.half_angle(middle) > 0.0:
            thick = middle
        else:
            pointed = middle
    if gear.internal:
        return f"{rounded_up(2.0 * thick):.3f} mm at least"
    return f"{math.floor(2e6 * thick) / 1e3:.3f} mm at most"


def rounded_up(diameter: float) -> float:
    """Return a diameter [m] in mm, rounded up to micrometres."""
    return math.ceil(1e6 * diameter) / 1e3


def _diameter(radius: float) -> str:
    """Return the diameter of a circle in mm."""
    return f"{2e3 * radius:.5g} mm"

"""Rings and internal pairs: a pinion within a ring, from two specifications, or a refusal with its reason.

A ring's tooth *space* has the shape of an external tooth of the same numbers: half its angle at a radius is
``ψ(r) = π/2z + 2x tanα/z + inv α − inv α_r``, and half the tooth's is ``π/z − ψ(r)``, wider towards the root
outside. A positive profile shift moves the space outwards and widens it.

The cutter that made a ring is rarely known, so its root is the simple one: the involute ends on a circular
fillet that touches it and the root circle. With ``r_c = r_f − ρ_F`` and ``ρ_c = √(r_c² − r_b²)`` of the
fillet's centre, the involute ends at ``√(r_b² + (ρ_c + ρ_F)²)`` (centre and end lie on one normal), and the
centre stands ``ψ_c = π/2z + 2x tanα/z + inv α − ρ_F/r_b − inv α_c`` from the space's centre line.

Contact of a pinion's involute begins where the ring's tip touches it. Where that lies below the pinion's form
circle, but still on its involute, practice shortens the ring's teeth, or rounds the cutter a little less.
"""

import math
from dataclasses import replace
from typing import Literal

from wearlab.gears import external
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.root import ToothRoot, form_radius
from wearlab.gears.shifts import internal_position, involute
from wearlab.gears.specification import Basics, GearError, GearSpec, RootProfile, check_reliefs

BISECTIONS = 60


def build_ring(
    spec: GearSpec, basics: Basics, *, profile_shift: float, assumed: tuple[str, ...] = ()
) -> Gear:
    """Resolve every dimension of one ring gear.

    ``r_a = m (z/2 + x − h_a − k)``, ``r_f = m (z/2 + x + h_f)``, or the given diameters. Without a tip
    alteration of its own k = 0: profile shifts leave a ring's tip clearances at the standard ones or above,
    and the pair may shorten it further (:mod:`wearlab.gears.internal`). ``tip_alteration = "wang-2023"`` puts
    the tip at ``r − m h_a + m/(z tan²α)``, about where an unshifted pinion's involute begins.

    Parameters
    ----------
    spec : what is given; ``rim_diameter`` is required
    basics : of the set
    profile_shift : x [1]; positive: larger tooth spaces, farther out
    assumed : flags to carry along

    Returns
    -------
    Gear : with ``internal``; its ``bore_radius`` is the outside radius of the rim

    Raises
    ------
    GearError : with the reason, its numbers and a remedy

    References
    ----------
    ISO 21771:2007, 4; Wang et al., Appl. Sci. 13 (2023) 2022, Table 1, for the tip alteration.
    """
    _check_ring_specification(spec, basics.face_width)
    module, pressure_angle = basics[:2]
    r = 0.5 * module * spec.teeth
    r_b = r * math.cos(pressure_angle)
    k = spec.tip_alteration_coefficient or 0.0
    if spec.tip_alteration == "wang-2023":
        k = -1.0 / (spec.teeth * math.tan(pressure_angle) ** 2)
    r_a = spec.tip_radius(module, profile_shift, k, -1.0)
    generated = profile_shift - spec.thinning(module, pressure_angle)
    r_f = spec.root_radius(module, generated, -1.0)
    assert spec.rim_diameter is not None  # _check_ring_specification
    rim = 0.5 * spec.rim_diameter
    _check_circles(spec.name, r_b, r_a, r_f, rim)
    space = math.pi / (2 * spec.teeth) + 2.0 * generated * math.tan(pressure_angle) / spec.teeth
    space += involute(pressure_angle)
    wanted = 0.0 if spec.root_profile == "radial" else spec.fillet_radius_coefficient * module
    fillet, fillet_flag = _fitting_fillet(spec.name, wanted, (r_b, r_a, r_f), space, module)
    profile: RootProfile = "fillet" if fillet > 0.0 else "radial"
    root = ToothRoot(profile, _form_radius(r_b, r_f, fillet), fillet, fillet_flag)
    circles = external.Circles(r_b, r_a, r_f, rim)
    ring = external.gear_of(spec, basics, generated, circles, root, (*assumed, *root.assumed))
    _check_tooth(ring)
    return ring


def _check_ring_specification(spec: GearSpec, face_width: float | None) -> None:
    external.check_specification(spec, face_width)
    if spec.rim_diameter is None or not spec.rim_diameter > 0.0:
        raise GearError(
            f"{spec.name}: rim_diameter is missing: a ring needs the outside diameter of its rim, above its "
            "root diameter"
        )
    if spec.bore_diameter is not None:
        raise GearError(f"{spec.name}: a ring has no bore_diameter; give rim_diameter, outside its teeth")
    if spec.root_profile == "trochoid":
        raise GearError(
            f'{spec.name}: root_profile "trochoid" needs the cutter that made the ring; give "fillet" (a '
            'circle between involute and root circle) or "radial" (the involute up to the root circle)'
        )
    if spec.fillet_radius_coefficient < 0.0:
        raise GearError(
            f"{spec.name}: fillet_radius_coefficient must not be negative, not "
            f"{spec.fillet_radius_coefficient:g}"
        )


def _check_circles(name: str, r_b: float, r_a: float, r_f: float, rim: float) -> None:
    if not r_a > r_b:
        raise GearError(
            f"{name}: involute interference: the ring's tip diameter {2e3 * r_a:.5g} mm is not above its "
            f"base diameter {2e3 * r_b:.5g} mm, where the involute ends; shorten the tip with "
            'tip_alteration = "wang-2023", a larger tip_diameter or a smaller addendum_coefficient'
        )
    if not r_f > r_a:
        raise GearError(
            f"{name}: the root diameter {2e3 * r_f:.5g} mm of a ring must lie above its tip diameter "
            f"{2e3 * r_a:.5g} mm"
        )
    if not rim > r_f:
        raise GearError(
            f"{name}: rim_diameter {2e3 * rim:.5g} mm must lie above the root diameter {2e3 * r_f:.5g} mm"
        )


def _centre_half_angle(fillet: float, r_b: float, r_f: float, space: float) -> float:
    """Return ψ_c, how far a fillet's centre stands from the centre line of the tooth space [rad]."""
    return space - fillet / r_b - involute(math.acos(r_b / (r_f - fillet)))


def _form_radius(r_b: float, r_f: float, fillet: float) -> float:
    return math.hypot(r_b, math.sqrt((r_f - fillet) ** 2 - r_b**2) + fillet)


def _fitting_fillet(
    name: str, wanted: float, radii: tuple[float, float, float], space: float, module: float
) -> tuple[float, tuple[str, ...]]:
    """Return the wanted fillet radius, or the largest that two flanks of one tooth space leave room for.

    Parameters
    ----------
    name : of the ring
    wanted : fillet radius [m]
    radii : of the base, tip and root circle [m]
    space : half the angle of a tooth space on the base circle [rad]
    module : m [m]
    """
    r_b, r_a, r_f = radii
    width = _centre_half_angle(0.0, r_b, r_f, space)
    if width <= 0.0:
        raise GearError(
            f"{name}: the tooth space ends in a point below the root diameter {2e3 * r_f:.5g} mm; reduce the "
            "dedendum or raise profile_shift_coefficient"
        )
    limit = min(r_f - r_a, 0.999 * (r_f - r_b))
    if wanted <= limit and _centre_half_angle(wanted, r_b, r_f, space) >= 0.0:
        return wanted, ()
    low, high = 0.0, min(wanted, limit)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _centre_half_angle(middle, r_b, r_f, space) >= 0.0 else (low, middle)
    flag = (
        f"root fillet reduced from {wanted / module:.3g} to {low / module:.3g} modules: "
        "the largest in its tooth space"
    )
    return low, (flag,)


def _check_tooth(ring: Gear) -> None:
    if not ring.tip_radius < ring.form_radius:
        raise GearError(
            f"{ring.name}: no involute is left between the tip diameter {2e3 * ring.tip_radius:.5g} mm and "
            f"the form diameter {2e3 * ring.form_radius:.5g} mm; reduce fillet_radius_coefficient"
        )
    external.refuse_pointed(ring)


LEAST_ROUNDING = 0.95
"""Part of its tip rounding that a generating rack keeps when a ring's tip needs a little more involute."""


def make_room(pinion: Gear, ring: Gear, centre_distance: float, *, shorten: bool) -> tuple[Gear, Gear]:
    """Return both gears so that contact begins on the pinion's involute, where a small change does that.

    Where nobody said where the ring's tip lies, it is shortened to
    ``r_a = √(r_b² + (ρ_form + a sinα_w)²)``; otherwise the rounding of the pinion's rack is reduced by at
    most 5 per cent. A ring's tip that would touch beyond the end of the pinion's involute stays as it is.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]
    shorten : whether the ring's tip may be shortened

    Returns
    -------
    (pinion, ring), the changed one with a flag of what was changed
    """
    lead = math.sqrt(centre_distance**2 - (ring.base_radius - pinion.base_radius) ** 2)
    start = math.sqrt(ring.tip_radius**2 - ring.base_radius**2) - lead
    end = math.sqrt(pinion.form_radius**2 - pinion.base_radius**2)
    if not 0.0 < start < end:
        return pinion, ring
    if shorten:
        tip = math.hypot(ring.base_radius, end + lead)
        flag = (
            f"tip shortened by {(tip - ring.tip_radius) / ring.module:.3g} modules: it touches the "
            f"{pinion.name} where its involute begins"
        )
        return pinion, replace(ring, tip_radius=tip, assumed=(*ring.assumed, flag))
    return _less_rounded(pinion, ring, start), ring


def _less_rounded(pinion: Gear, ring: Gear, start: float) -> Gear:
    """Return the pinion with the rounding whose edge ends where contact starts, if that is large enough.

    ``ρ_form = r sinα − h_e / sinα`` with ``h_e = h − ρ (1 − sinα)``, as in :mod:`wearlab.gears.root`.
    """
    sin = math.sin(pinion.pressure_angle)
    edge = (pinion.reference_radius * sin - start) * sin
    rounding = (pinion.reference_radius - pinion.root_radius - edge) / (1.0 - sin)
    if pinion.root_profile != "trochoid" or not rounding >= LEAST_ROUNDING * pinion.fillet_radius:
        return pinion
    cut = pinion.cut._replace(fillet=rounding / pinion.module)
    form = form_radius(pinion.name, cut)
    flag = (
        f"rounding of the rack reduced from {pinion.fillet_radius / pinion.module:.3g} to "
        f"{rounding / pinion.module:.3g} modules: the tip of {ring.name} reaches below the form circle"
    )
    return replace(pinion, fillet_radius=rounding, form_radius=form, assumed=(*pinion.assumed, flag))


def internal_pair(
    pinion: GearSpec,
    ring: GearSpec,
    basics: Basics,
    *,
    centre_distance: float | None = None,
    driving: Literal["pinion", "ring"] = "pinion",
) -> GearPair:
    """Return the internal pair of a pinion and a ring, or refuse it.

    ``inv α_w = inv α + 2 (x_r − x_p) tanα / (z_r − z_p)``, ``a = ½ m (z_r − z_p) cosα / cosα_w``.

    Parameters
    ----------
    pinion, ring : the gears as specified; a ring needs ``rim_diameter``
    basics : what they share
    centre_distance : operating centre distance [m]; absent: from the profile shifts
    driving : which of the two drives, whatever their names

    Returns
    -------
    GearPair

    Raises
    ------
    GearError : no involute contact, contact ratio below 1, undercut, pointed tip; involute, tip or fillet
        interference; impossible circles, contradicting shifts; with numbers and a remedy

    References
    ----------
    ISO 21771:2007, clauses 4 and 5; a positive shift of a ring enlarges its tooth spaces here.
    """
    external.check_basics(pinion, ring, basics)
    if not ring.teeth > pinion.teeth:
        raise GearError(
            f"{ring.name}: {ring.teeth} teeth cannot surround a {pinion.name} of {pinion.teeth}: give the "
            "ring more teeth than the gear within it"
        )
    operating = internal_position(
        (pinion.teeth, ring.teeth),
        (pinion.profile_shift_coefficient, ring.profile_shift_coefficient),
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        centre_distance=centre_distance,
    )
    inner = external.build_gear(
        pinion,
        basics,
        profile_shift=operating.shifts[0],
        tip_alteration=operating.tip_alteration,
        assumed=operating.assumed,
    )
    outer = build_ring(ring, basics, profile_shift=operating.shifts[1], assumed=operating.assumed)
    a = operating.centre_distance
    inner, outer = make_room(inner, outer, a, shorten=ring.tip_is_derived)
    return assemble_internal(inner, outer, a, ring_drives=driving == ring.name)


def assemble_internal(pinion: Gear, ring: Gear, centre_distance: float, *, ring_drives: bool) -> GearPair:
    """Return the pair of two gears that are already built, or refuse it.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]
    ring_drives : whether the ring drives the pinion

    Returns
    -------
    GearPair : its path cut off by the two tip circles

    Raises
    ------
    GearError : contact ratio below 1; involute, tip or fillet interference; tip into root

    References
    ----------
    ISO 21771:2007, clause 5.
    """
    alpha_w = math.acos((ring.base_radius - pinion.base_radius) / centre_distance)
    _check_interference(pinion, ring, centre_distance, alpha_w)
    pinion_end = external.tip_curvature(pinion) - pinion.base_radius * math.tan(alpha_w)
    ring_end = ring.base_radius * math.tan(alpha_w) - external.tip_curvature(ring)
    s_A, s_E = (-pinion_end, ring_end) if ring_drives else (-ring_end, pinion_end)
    driving, driven = (ring, pinion) if ring_drives else (pinion, ring)
    pair = external.paired(driving, driven, centre_distance, alpha_w, (s_A, s_E))
    if not pair.contact_ratio >= 1.0:
        raise GearError(
            f"contact ratio {pair.contact_ratio:.4f} is below 1: the path of contact is "
            f"{(s_E - s_A) * 1e3:.4g} mm and the base pitch {pair.base_pitch * 1e3:.4g} mm; enlarge the "
            f"teeth of {pinion.name} or {ring.name}, or change the centre distance"
        )
    for gear in (pinion, ring):
        if gear.modification is not None:
            check_reliefs(gear.modification, s_E - s_A, gear.name)
    external.check_backlash(pair)
    return pair


def _check_interference(pinion: Gear, ring: Gear, a: float, alpha_w: float) -> None:
    """Refuse contact off either involute, tips in roots, and tips that meet outside the path."""
    lead = (ring.base_radius - pinion.base_radius) * math.tan(alpha_w)
    external.check_start(pinion, ring, external.tip_curvature(ring) - lead)
    end = math.hypot(ring.base_radius, external.tip_curvature(pinion) + lead)
    if end > ring.form_radius * (1.0 + external.CONTACT_TOLERANCE):
        raise GearError(
            f"fillet interference: {pinion.name} would touch {ring.name} at diameter {2e3 * end:.5g} mm, "
            f"above its form diameter {2e3 * ring.form_radius:.5g} mm; shorten the tip of {pinion.name}, "
            f"deepen the root of {ring.name} or reduce its fillet_radius_coefficient"
        )
    for gear, mate, clearance in (
        (pinion, ring, ring.root_radius - a - pinion.tip_radius),
        (ring, pinion, ring.tip_radius - a - pinion.root_radius),
    ):
        external.check_clearance(gear, mate, clearance)
    clearance = tip_clearance(pinion, ring, a)
    if clearance < 0.0:
        raise GearError(
            f"tip interference: with {ring.teeth} − {pinion.teeth} = {ring.teeth - pinion.teeth} teeth of "
            f"difference the tips of {pinion.name} and {ring.name} overlap by {-clearance * 1e3:.4g} mm "
            "where their tip circles cross; shorten a tip, or use a larger difference or centre distance"
        )


def tip_clearance(pinion: Gear, ring: Gear, centre_distance: float) -> float:
    """Return how far the tip corners pass each other where the tip circles cross.

    ``[z_p (inv α_ap + δ_p) − z_r (inv α_ar + δ_r) + (z_r − z_p) inv α_w] r_ar / z_r`` with δ the angles of
    that crossing from the line of centres: ``cosδ_p = (r_ar² − r_ap² − a²) / (2 a r_ap)``,
    ``cosδ_r = (r_ar² − r_ap² + a²) / (2 a r_ar)``.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]

    Returns
    -------
    along the ring's tip circle [m]; negative: the tips overlap. Infinite where the circles do not cross

    References
    ----------
    Colbourne, The Geometry of Involute Gears, Springer 1987, chapter 9: tip interference.
    """
    a, r_p, r_r = centre_distance, pinion.tip_radius, ring.tip_radius
    cos_p = (r_r**2 - r_p**2 - a**2) / (2.0 * a * r_p)
    if not -1.0 < cos_p < 1.0:
        return math.inf
    alpha_w = math.acos((ring.base_radius - pinion.base_radius) / a)
    delta_r = math.acos((r_r**2 - r_p**2 + a**2) / (2.0 * a * r_r))
    total = pinion.teeth * (involute(math.acos(pinion.base_radius / r_p)) + math.acos(cos_p))
    total -= ring.teeth * (involute(math.acos(ring.base_radius / r_r)) + delta_r)
    total += (ring.teeth - pinion.teeth) * involute(alpha_w)
    return total * r_r / ring.teeth

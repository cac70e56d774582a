"""Internal pairs: a pinion within a ring, from two specifications, or a refusal with its reason.

A ring's tooth *space* has the shape of an external tooth of the same numbers: half its angle at a radius is
``ψ(r) = π/2z + 2x tanα/z + inv α − inv α_r``, and half the tooth's is ``π/z − ψ(r)``, wider towards the root
outside. A positive profile shift moves the space outwards and widens it.

Contact of a pinion's involute begins where the ring's tip touches it. Where that lies below the pinion's form
circle, but still on its involute, practice shortens the ring's teeth, or rounds the cutter a little less.
"""

import math
from dataclasses import replace
from typing import Literal

from wearlab.gears import external
from wearlab.gears.gear import Gear, GearPair, in_mesh
from wearlab.gears.root import form_radius
from wearlab.gears.shifts import internal_position, involute
from wearlab.gears.specification import Basics, GearError, GearSpec, check_reliefs

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
    start = ring.tip_curvature - lead
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
    shifts = pinion.profile_shift_coefficient, ring.profile_shift_coefficient
    operating = internal_position((pinion.teeth, ring.teeth), shifts, basics, centre_distance)
    x_p, x_r = operating.shifts
    inner = external.build_gear(pinion, basics, x_p, operating.tip_alteration, operating.assumed)
    outer = external.build_gear(ring, basics, x_r, assumed=operating.assumed, internal=True)
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
    driving, driven = (ring, pinion) if ring_drives else (pinion, ring)
    pair = in_mesh(driving, driven, centre_distance, alpha_w)
    enlarge = f"enlarge the teeth of {pinion.name} or {ring.name}, or change the centre distance"
    external.check_contact_ratio(pair, enlarge)
    for gear in (pinion, ring):
        check_reliefs(gear.modification, pair.path.E - pair.path.A, gear.name)
    external.check_backlash(pair)
    return pair


def _check_interference(pinion: Gear, ring: Gear, a: float, alpha_w: float) -> None:
    """Refuse contact off either involute, tips in roots, and tips that meet outside the path."""
    lead = (ring.base_radius - pinion.base_radius) * math.tan(alpha_w)
    external.check_start(pinion, ring, ring.tip_curvature - lead)
    end = math.hypot(ring.base_radius, pinion.tip_curvature + lead)
    if end > ring.form_radius * (1.0 + external.CONTACT_TOLERANCE):
        raise GearError(
            f"fillet interference: {pinion.name} would touch {ring.name} at diameter {2e3 * end:.5g} mm, "
            f"above its form diameter {2e3 * ring.form_radius:.5g} mm; shorten the tip of {pinion.name}, "
            f"deepen the root of {ring.name} or reduce its fillet_radius_coefficient"
        )
    external.check_clearance(pinion, ring, ring.root_radius - a - pinion.tip_radius)
    external.check_clearance(ring, pinion, ring.tip_radius - a - pinion.root_radius)
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

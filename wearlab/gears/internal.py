"""Internal pairs: a pinion within a ring, from two specifications to a pair that can run, or a refusal."""

import math
from typing import Literal

from wearlab.gears.build import build_gear
from wearlab.gears.errors import GearError
from wearlab.gears.external import (
    CONTACT_TOLERANCE,
    check_basics,
    check_clearance,
    check_start,
    tip_curvature,
)
from wearlab.gears.gear import Gear
from wearlab.gears.involute import involute
from wearlab.gears.modification import check_reliefs
from wearlab.gears.pair import GearPair, PathOfContact
from wearlab.gears.ring import build_ring
from wearlab.gears.room import make_room
from wearlab.gears.shifts import internal_position
from wearlab.gears.specification import Basics, GearSpec


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
    check_basics(pinion, ring, basics)
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
    inner = build_gear(
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
    pinion_end = tip_curvature(pinion) - pinion.base_radius * math.tan(alpha_w)
    ring_end = ring.base_radius * math.tan(alpha_w) - tip_curvature(ring)
    s_A, s_E = (-pinion_end, ring_end) if ring_drives else (-ring_end, pinion_end)
    p_b = math.pi * pinion.module * math.cos(pinion.pressure_angle)
    if not s_E - s_A >= p_b:
        raise GearError(
            f"contact ratio {(s_E - s_A) / p_b:.4f} is below 1: the path of contact is "
            f"{(s_E - s_A) * 1e3:.4g} mm and the base pitch {p_b * 1e3:.4g} mm; enlarge the teeth of "
            f"{pinion.name} or {ring.name}, or change the centre distance"
        )
    whole = math.floor((s_E - s_A) / p_b)
    for gear in (pinion, ring):
        if gear.modification is not None:
            check_reliefs(gear.modification, s_E - s_A, gear.name)
    return GearPair(
        driving=ring if ring_drives else pinion,
        driven=pinion if ring_drives else ring,
        centre_distance=centre_distance,
        working_pressure_angle=alpha_w,
        base_pitch=p_b,
        path=PathOfContact(s_A, s_E - whole * p_b, 0.0, s_A + whole * p_b, s_E),
        face_width=min(pinion.face_width, ring.face_width),
    )


def _check_interference(pinion: Gear, ring: Gear, a: float, alpha_w: float) -> None:
    """Refuse contact off either involute, tips in roots, and tips that meet outside the path."""
    lead = (ring.base_radius - pinion.base_radius) * math.tan(alpha_w)
    check_start(pinion, ring, tip_curvature(ring) - lead)
    end = math.hypot(ring.base_radius, tip_curvature(pinion) + lead)
    if end > ring.form_radius * (1.0 + CONTACT_TOLERANCE):
        raise GearError(
            f"fillet interference: {pinion.name} would touch {ring.name} at diameter {2e3 * end:.5g} mm, "
            f"above its form diameter {2e3 * ring.form_radius:.5g} mm; shorten the tip of {pinion.name}, "
            f"deepen the root of {ring.name} or reduce its fillet_radius_coefficient"
        )
    for gear, mate, clearance in (
        (pinion, ring, ring.root_radius - a - pinion.tip_radius),
        (ring, pinion, ring.tip_radius - a - pinion.root_radius),
    ):
        check_clearance(gear, mate, clearance)
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

"""Pairs of gears in mesh: from two specifications to a pair that can run, or a refusal with its reason.

A ring's tooth *space* has the shape of an external tooth of the same numbers: half its
angle at a radius is ``ψ(r) = π/2z + 2x tanα/z + inv α − inv α_r``, and half the tooth's
is ``π/z − ψ(r)``, wider towards the root outside. A positive profile shift moves the
space outwards and widens it.

Contact of a pinion's involute begins where a ring's tip touches it. Where that lies
below the pinion's form circle, but still on its involute, practice shortens the ring's
teeth, or rounds the cutter a little less.
"""

import math

from wearlab.gears import making, root
from wearlab.gears.gear import DRIVEN, DRIVING, Gear, GearPair, in_mesh
from wearlab.gears.shifts import internal_position, involute, operating_position
from wearlab.gears.specification import (
    Basics,
    GearError,
    GearSpec,
    check_reliefs,
    refuse,
)


def gear_pair(
    first: GearSpec,
    second: GearSpec,
    basics: Basics,
    *,
    centre_distance: float | None = None,
    driving: str | None = None,
    internal: bool = False,
) -> GearPair:
    """Return the pair of two gears, or refuse it.

    ``inv α_w = inv α + 2 (x_2 ± x_1) tanα / (z_2 ± z_1)``, ``a = ½ m (z_2 ± z_1) cosα /
    cosα_w``; lower signs of an internal pair.

    Parameters
    ----------
    first, second : the gears as specified
    basics : what they share
    centre_distance : operating centre distance [m]; absent: from the profile shifts
    driving : name of the driving gear; absent: the first
    internal : whether the second is a ring, which needs ``rim_diameter``

    Returns
    -------
    GearPair

    Raises
    ------
    GearError : no involute contact, contact ratio below 1, undercut, pointed tip;
        involute, tip or fillet interference; impossible circles, contradicting shifts;
        with numbers and a remedy

    References
    ----------
    ISO 21771:2007, clauses 4 and 5; a positive shift of a ring enlarges its tooth
    spaces here.
    """
    check_basics(first, second, basics)
    if driving not in (None, first.name, second.name):
        raise GearError(
            f"driving gear {driving!r} is neither {first.name!r} nor {second.name!r}"
        )
    if internal and not second.teeth > first.teeth:
        raise GearError(
            f"{second.name}: {second.teeth} teeth cannot surround a {first.name} of "
            f"{first.teeth}: give the "
            "ring more teeth than the gear within it"
        )
    position = internal_position if internal else operating_position
    shifts = first.profile_shift_coefficient, second.profile_shift_coefficient
    a, _, (x_1, x_2), k, assumed = position(
        (first.teeth, second.teeth), shifts, basics, centre_distance
    )
    one = making.build_gear(first, basics, x_1, k, assumed)
    other = making.build_gear(second, basics, x_2, k, assumed, internal=internal)
    if internal:
        one, other = make_room(one, other, a, shorten=second.tip_is_derived)
    pair = in_mesh(*((other, one) if driving == second.name else (one, other)), a)
    check_pair(
        pair,
        0.0
        if internal
        else -first.tooth_thickness_allowance - second.tooth_thickness_allowance,
    )
    return pair


def check_basics(first: GearSpec, second: GearSpec, basics: Basics) -> None:
    """Refuse a module or a pressure angle that no gear has, and two gears of one name.

    Raises
    ------
    GearError : naming the value
    """
    module, pressure_angle = basics[:2]
    degrees = math.degrees(pressure_angle)
    sharp = not 0.0 < pressure_angle < math.pi / 4
    reasons = {
        f"the module must be positive, not {module:g} m": not module > 0.0,
        f"the pressure angle must lie between 0 and 45 deg, not {degrees:.4g} deg": sharp,
        f"both gears are called {first.name!r}; give them two names": first.name
        == second.name,
    }
    refuse("", reasons)


def check_pair(pair: GearPair, thinned: float = 0.0) -> None:
    """Refuse a pair that cannot run together.

    Parameters
    ----------
    pair : the gears in mesh
    thinned : by how much allowances thin both teeth at the reference circles [m]

    Raises
    ------
    GearError : contact ratio below 1; involute, tip or fillet interference; tip into
        root; teeth that jam

    References
    ----------
    ISO 21771:2007, clause 5.
    """
    order = sorted((DRIVING, DRIVEN), key=lambda number: pair.gears[number].internal)
    first, second = (pair.gears[number] for number in order)
    path = pair.path.E - pair.path.A
    outside = second.outwards * pair.centre_distance
    enlarge = "enlarge the tips or reduce the centre distance"
    if pair.internal:
        enlarge = (
            f"enlarge the teeth of {first.name} or {second.name}, or change the centre "
            "distance"
        )
    apart = {
        f"contact ratio {pair.contact_ratio:.4f} is below 1: the path of contact is "
        f"{path * 1e3:.4g} mm and "
        f"the base pitch {pair.base_pitch * 1e3:.4g} mm; {enlarge}": not pair.contact_ratio
        >= 1.0
    }
    meet: dict[str, bool] = {}
    for number in order:
        begins = pair.curvature(pair.path.E if number else pair.path.A)[number]
        meet |= _off_involute(pair.gears[number], pair.gears[1 - number], float(begins))
    for gear, mate in ((first, second), (second, first)):
        room = (
            outside - gear.outwards * gear.tip_radius - mate.outwards * mate.root_radius
        )
        meet[
            f"{gear.name}: its tip runs {-room * 1e3:.4g} mm into the root of "
            f"{mate.name}; shorten the tip "
            f"of {gear.name} or deepen the root of {mate.name}"
        ] = room <= 0.0
    if pair.internal:
        clearance = tip_clearance(first, second, pair.centre_distance)
        more = second.teeth - first.teeth
        meet[
            f"tip interference: with {second.teeth} − {first.teeth} = {more} teeth of "
            "difference the tips of "
            f"{first.name} and {second.name} overlap by {-clearance * 1e3:.4g} mm "
            "where their tip circles "
            "cross; shorten a tip, or use a larger difference or centre distance"
        ] = clearance < 0.0
    refuse("", meet | apart if pair.internal else apart | meet)
    for gear in (first, second):
        check_reliefs(gear.modification, path, gear.name)
    check_backlash(pair, thinned)


def _off_involute(gear: Gear, mate: Gear, curvature: float) -> dict[str, bool]:
    """Say whether contact begins beyond the base circle's tangent point, or beyond the form circle."""
    word, remedy = (
        ("involute", ' (tip_alteration = "wang-2023")')
        if mate.internal
        else ("tip", "")
    )
    start = math.hypot(gear.base_radius, curvature)
    form = gear.form_radius
    side = "above" if gear.internal else "below"
    beyond = gear.outwards * (form - start) > 1e-9 * form
    # relative slack of a comparison of two lengths
    return {
        f"{word} interference: the tip of {mate.name} reaches {-curvature * 1e3:.4g} "
        "mm beyond the tangent "
        f"point of the base circle of {gear.name}; shorten the tip of "
        f"{mate.name}{remedy} or raise the "
        f"profile shift of {gear.name}": curvature <= 0.0,
        f"fillet interference: {mate.name} would touch {gear.name} at diameter "
        f"{2e3 * start:.5g} mm, {side} "
        f"its form diameter {2e3 * form:.5g} mm; shorten the tip of "
        f"{mate.name}{remedy}, deepen the root of "
        f"{gear.name} or reduce its fillet_radius_coefficient": beyond,
    }


def check_backlash(pair: GearPair, thinned: float = 0.0) -> None:
    """Refuse teeth that are thicker than the spaces at the centre distance given.

    Parameters
    ----------
    pair : the gears in mesh
    thinned : by how much allowances thin both teeth at the reference circles, ``ΔJ_bn =
        thinned cos α`` [m]

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
            left = (
                f"{without}, allowances of the tooth thickness add {added * 1e6:.4g} "
                f"µm: together {left}"
            )
        by = -pair.backlash / (2.0 * math.sin(pair.working_pressure_angle))
        raise GearError(
            f"the teeth of {names} jam: the backlash that profile shifts and centre "
            "distance leave is "
            f"{left} along the line of action; {farther} the centre distance by "
            f"{by * 1e3:.3g} mm, give "
            f"{'more' if added else 'a'} tooth_thickness_allowance below 0, or leave "
            "out one of shifts and "
            "centre distance"
        )


def make_room(
    pinion: Gear, ring: Gear, centre_distance: float, *, shorten: bool
) -> tuple[Gear, Gear]:
    """Return both gears so that contact begins on the pinion's involute, where a small change does that.

    Where nobody said where the ring's tip lies, it is shortened to ``r_a = √(r_b² +
    (ρ_form + a sinα_w)²)``; otherwise the rounding of the pinion's rack is reduced by
    at most 5 per cent. A ring's tip that would touch beyond the end of the pinion's
    involute stays as it is.

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
            f"tip shortened by {(tip - ring.tip_radius) / ring.module:.3g} modules: "
            "it touches the "
            f"{pinion.name} where its involute begins"
        )
        return pinion, ring._replace(tip_radius=tip, assumed=(*ring.assumed, flag))
    return _less_rounded(pinion, ring, start), ring


def _less_rounded(pinion: Gear, ring: Gear, start: float) -> Gear:
    """Return the pinion with the rounding whose edge ends where contact starts, if that is large enough.

    ``ρ_form = r sinα − h_e / sinα`` with ``h_e = h − ρ (1 − sinα)``, as in
    :mod:`wearlab.gears.root`.
    """
    sin = math.sin(pinion.pressure_angle)
    edge = (pinion.reference_radius * sin - start) * sin
    rounding = (pinion.reference_radius - pinion.root_radius - edge) / (1.0 - sin)
    # part of its tip rounding that a generating rack keeps when a ring's tip needs a
    # little more involute
    if pinion.root_profile != "trochoid" or not rounding >= 0.95 * pinion.fillet_radius:
        return pinion
    form = root.form_radius(
        pinion.name, pinion.cut._replace(fillet=rounding / pinion.module)
    )
    flag = (
        "rounding of the rack reduced from "
        f"{pinion.fillet_radius / pinion.module:.3g} to "
        f"{rounding / pinion.module:.3g} modules: the tip of {ring.name} reaches "
        "below the form circle"
    )
    return pinion._replace(
        fillet_radius=rounding, form_radius=form, assumed=(*pinion.assumed, flag)
    )


def tip_clearance(pinion: Gear, ring: Gear, centre_distance: float) -> float:
    """Return how far the tip corners pass each other where the tip circles cross.

    ``[z_p (inv α_ap + δ_p) − z_r (inv α_ar + δ_r) + (z_r − z_p) inv α_w] r_ar / z_r``
    with δ the angles of that crossing from the line of centres: ``cosδ_p = (r_ar² −
    r_ap² − a²) / (2 a r_ap)``, ``cosδ_r = (r_ar² − r_ap² + a²) / (2 a r_ar)``.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]

    Returns
    -------
    along the ring's tip circle [m]; negative: the tips overlap. Infinite where the
    circles do not cross

    References
    ----------
    Colbourne, The Geometry of Involute Gears, Springer 1987, chapter 9: tip
    interference.
    """
    a = centre_distance
    r_p = pinion.tip_radius
    r_r = ring.tip_radius
    cos_p = (r_r**2 - r_p**2 - a**2) / (2.0 * a * r_p)
    if not -1.0 < cos_p < 1.0:
        return math.inf
    alpha_w = math.acos((ring.base_radius - pinion.base_radius) / a)
    delta_r = math.acos((r_r**2 - r_p**2 + a**2) / (2.0 * a * r_r))
    total = pinion.teeth * (
        involute(math.acos(pinion.base_radius / r_p)) + math.acos(cos_p)
    )
    total -= ring.teeth * (involute(math.acos(ring.base_radius / r_r)) + delta_r)
    total += (ring.teeth - pinion.teeth) * involute(alpha_w)
    return total * r_r / ring.teeth

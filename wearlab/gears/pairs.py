"""Pairs of gears in mesh: from two specifications to a pair that can run.

A ring's tooth *space* has the shape of an external tooth of the same numbers: half its
angle at a radius is ``ψ(r) = π/2z + 2x tanα/z + inv α − inv α_r``, and half the tooth's
is ``π/z − ψ(r)``, wider towards the root outside. A positive profile shift moves the
space outwards and widens it.

Contact of a pinion's involute begins where a ring's tip touches it. Where that lies
below the pinion's form circle, but still on its involute, practice shortens the ring's
teeth, or rounds the cutter a little less.
"""

import math
from collections.abc import Iterator
from itertools import chain

from wearlab.gears import making, root
from wearlab.gears.corner import corner_clearance
from wearlab.gears.gear import (
    DRIVEN,
    DRIVING,
    FORM_SLACK,
    Gear,
    GearPair,
    in_mesh,
)
from wearlab.gears.helix import SPUR, Helix
from wearlab.gears.shifts import internal_position, involute, operating_position
from wearlab.gears.specification import (
    Basics,
    GearError,
    GearSpec,
    check_reliefs,
    refuse_first,
)

BISECTIONS = 60
MIN_ROUNDING = 0.95
"""Share of its tip rounding that a rack keeps when a ring needs more involute."""


def gear_pair(
    first: GearSpec,
    second: GearSpec,
    basics: Basics,
    *,
    centre_distance: float | None = None,
    driving: str | None = None,
    internal: bool = False,
    turned: Helix = SPUR,
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
    turned : helix of the gears, whose overlap helps where the transverse contact ratio
        is below 1

    Returns
    -------
    GearPair

    Raises
    ------
    GearError : no involute contact, total contact ratio below 1, teeth that are cut
        off, pointed tip;
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
    operating = position(
        (first.teeth, second.teeth),
        (first.profile_shift_coefficient, second.profile_shift_coefficient),
        basics,
        centre_distance,
    )
    a = operating.centre_distance
    first_shift, second_shift = operating.shifts
    first_gear = making.build_gear(
        first, basics, first_shift, operating.tip_alteration, operating.assumed
    )
    least_tip = None
    if internal:
        least_tip = least_ring_tip(first_gear, second.teeth, a)
    second_gear = making.build_gear(
        second,
        basics,
        second_shift,
        operating.tip_alteration,
        operating.assumed,
        internal=internal,
        least_tip=least_tip,
    )
    thinned = -first.tooth_thickness_allowance - second.tooth_thickness_allowance
    if internal:
        thinned = 0.0
        first_gear, second_gear = make_room(
            first_gear, second_gear, a, shorten=second.tip_is_derived
        )
    if driving == second.name:
        pair = in_mesh(second_gear, first_gear, a)
    else:
        pair = in_mesh(first_gear, second_gear, a)
    check_pair(pair, thinned, turned)
    return pair


def check_basics(first: GearSpec, second: GearSpec, basics: Basics) -> None:
    """Refuse a module or a pressure angle that no gear has, and two gears of one name.

    Parameters
    ----------
    first, second : the gears
    basics : module and pressure angle

    Raises
    ------
    GearError : naming the value
    """
    module = basics.module
    angle = basics.pressure_angle
    if not module > 0.0:
        raise GearError(f"the module must be positive, not {module:g} m")
    if not 0.0 < angle < math.pi / 4:
        raise GearError(
            "the pressure angle must lie between 0 and 45 deg, not "
            f"{math.degrees(angle):.4g} deg"
        )
    if first.name == second.name:
        raise GearError(f"both gears are called {first.name!r}; give them two names")


def check_pair(pair: GearPair, thinned: float = 0.0, turned: Helix = SPUR) -> None:
    """Refuse a pair that cannot run together.

    Parameters
    ----------
    pair : the gears in mesh
    thinned : by how much allowances thin both teeth at the reference circles [m]
    turned : helix of the gears

    Raises
    ------
    GearError : total contact ratio below 1; involute, tip or fillet interference; tip
        into root; teeth that jam

    References
    ----------
    ISO 21771:2007, clause 5.
    """
    numbers = sorted((DRIVING, DRIVEN), key=lambda number: pair.gears[number].internal)
    first, second = (pair.gears[number] for number in numbers)

    ratio = _low_contact_ratio(pair, turned)
    interference = _interference(pair, first, second, numbers)
    # of a ring, interference tells more than the contact ratio that follows from it
    if pair.internal:
        refuse_first("", chain(interference, ratio))
    else:
        refuse_first("", chain(ratio, interference))
    for gear in (first, second):
        check_reliefs(gear.modification, pair.path.E - pair.path.A, gear.name)
    check_backlash(pair, thinned)


def _interference(
    pair: GearPair, first: Gear, second: Gear, numbers: list[int]
) -> Iterator[str]:
    """Yield where teeth meet that should not; the second gear may be a ring."""
    for number in numbers:
        yield from _involute_interference(pair, number)
    yield from _tip_in_root(first, second, pair.centre_distance)
    yield from _tip_in_root(second, first, pair.centre_distance)
    if pair.internal:
        yield from _tip_interference(first, second, pair.centre_distance)


def _low_contact_ratio(pair: GearPair, turned: Helix) -> Iterator[str]:
    """Yield that at times no teeth touch: ε_α + ε_β below 1."""
    total = pair.total_contact_ratio(turned.base_angle)
    if total >= 1.0:
        return
    path = pair.path.E - pair.path.A
    first, second = sorted(pair.gears, key=lambda gear: gear.internal)

    remedy = "enlarge the tips"
    if any(gear.usable_tip_radius is not None for gear in pair.gears):
        remedy = "reduce the chamfer of the tip"
    elif any(pair.overreach):
        undercut = pair.gears[1 - pair.overreach.index(max(pair.overreach))]
        remedy = f"raise the profile_shift_coefficient of {undercut.name}"
    elif pair.internal:
        remedy = f"give {first.name} a larger or {second.name} a smaller tip_diameter"
    elif pair.backlash > pair.rounding:
        remedy += " or reduce the centre distance"
    ratio = f"contact ratio {pair.contact_ratio:.4f} is below 1"
    if turned.angle:
        needed = (1.0 - pair.contact_ratio) * pair.base_pitch
        wide = math.ceil(1e4 * needed / math.tan(turned.base_angle)) / 10.0
        remedy += f", or give a common face width of {wide:.1f} mm"
        ratio = (
            f"total contact ratio {total:.4f} is below 1, with "
            f"{total - pair.contact_ratio:.4f} of overlap"
        )
    yield (
        f"{ratio}: the path of contact is "
        f"{path * 1e3:.4g} mm and the base pitch {pair.base_pitch * 1e3:.4g} mm; "
        f"{remedy}"
    )


def _involute_interference(pair: GearPair, number: int) -> Iterator[str]:
    """Yield that contact on a gear begins beyond its base circle or its form circle."""
    gear = pair.gears[number]
    mate = pair.gears[1 - number]
    if pair.overreach[1 - number] > 0.0:
        yield from _corner_in_undercut(pair, number)
        return
    begins_at = pair.path.A if number == DRIVING else pair.path.E
    curvature = float(pair.curvature(begins_at)[number])
    name = "involute" if mate.internal else "tip"
    shorten = _shorten(pair, 1 - number)
    if curvature <= 0.0:
        yield (
            f"{name} interference: the tip of {mate.name} reaches "
            f"{-curvature * 1e3:.4g} mm beyond the tangent point of the base circle of "
            f"{gear.name}; {shorten}"
        )

    start = math.hypot(gear.base_radius, curvature)
    form = gear.form_radius
    if gear.outwards * (form - start) > FORM_SLACK * form:
        side = "above" if gear.internal else "below"
        deepen = f"deepen the root of {gear.name}"
        if gear.root_profile != "radial":
            deepen += " or reduce its fillet_radius_coefficient"
        yield (
            f"fillet interference: {mate.name} would touch {gear.name} at diameter "
            f"{2e3 * start:.5g} mm, {side} its form diameter {2e3 * form:.5g} mm; "
            f"{shorten}, or {deepen}"
        )


def _corner_in_undercut(pair: GearPair, number: int) -> Iterator[str]:
    """Yield that a tip cuts into the root of an undercut gear."""
    gear = pair.gears[number]
    mate = pair.gears[1 - number]
    clearance = corner_clearance(gear, mate, pair.centre_distance)
    if clearance >= 0.0:
        return
    yield (
        f"tip interference: the tip corner of {mate.name} cuts "
        f"{-clearance * 1e3:.4g} mm into the undercut root of {gear.name}; "
        f"{_shorten(pair, 1 - number)}"
    )


def _shorten(pair: GearPair, number: int) -> str:
    """Return how far the tip of a gear may reach, as advice."""
    gear = pair.gears[number]
    millimetres = 1e3 * pair.useful_tip_diameter(number)
    if gear.internal:
        least = making.rounded_up(1e-3 * millimetres)
        return f"give {gear.name} a tip_diameter of {least:.3f} mm at least"
    largest = math.floor(1e3 * millimetres) / 1e3
    return f"give {gear.name} a tip_diameter of {largest:.3f} mm at most"


def _tip_in_root(gear: Gear, mate: Gear, centre_distance: float) -> Iterator[str]:
    """Yield that the tip of a gear runs into the root of its mate."""
    is_internal = gear.internal or mate.internal
    distance = (-1.0 if is_internal else 1.0) * centre_distance
    room = distance - gear.outwards * gear.tip_radius - mate.outwards * mate.root_radius
    if room <= 0.0:
        yield (
            f"{gear.name}: its tip runs {-room * 1e3:.4g} mm into the root of "
            f"{mate.name}; shorten the tip of {gear.name} or deepen the root of "
            f"{mate.name}"
        )


def _tip_interference(
    pinion: Gear, ring: Gear, centre_distance: float
) -> Iterator[str]:
    """Yield that tips of a pinion and of its ring overlap where their circles cross."""
    clearance = tip_clearance(pinion, ring, centre_distance)
    if clearance < 0.0:
        yield (
            f"tip interference: with {ring.teeth} − {pinion.teeth} = "
            f"{ring.teeth - pinion.teeth} teeth of difference the tips of "
            f"{pinion.name} and {ring.name} overlap by {-clearance * 1e3:.4g} mm "
            f"where their tip circles cross; give {pinion.name} a tip_diameter of "
            f"{_passing_tip(pinion, ring, centre_distance):.3f} mm at most, or use a "
            "larger difference or centre distance"
        )


def _passing_tip(pinion: Gear, ring: Gear, centre_distance: float) -> float:
    """Return the largest tip diameter of a pinion that passes its ring's tips [mm]."""
    passes = pinion.form_radius
    overlaps = pinion.tip_radius
    for _ in range(BISECTIONS):
        middle = 0.5 * (passes + overlaps)
        shortened = pinion._replace(tip_radius=middle)
        if tip_clearance(shortened, ring, centre_distance) >= 0.0:
            passes = middle
        else:
            overlaps = middle
    return math.floor(2e6 * passes) / 1e3


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
    if not pair.backlash < -pair.rounding:
        return
    names = " and ".join(gear.name for gear in pair.gears)
    farther = "reduce" if pair.internal else "raise"
    allowance = "a tooth_thickness_allowance"
    backlash = f"{pair.backlash * 1e6:.4g} µm"
    added = thinned * math.cos(pair.driving.pressure_angle)
    if added:
        allowance = "more tooth_thickness_allowance"
        backlash = (
            f"{(pair.backlash - added) * 1e6:.4g} µm, allowances of the tooth "
            f"thickness add {added * 1e6:.4g} µm: together {backlash}"
        )
    distance = -pair.backlash / (2.0 * math.sin(pair.working_pressure_angle))
    raise GearError(
        f"the teeth of {names} jam: the backlash that profile shifts and centre "
        f"distance leave is {backlash} along the line of action; {farther} the centre "
        f"distance by {distance * 1e3:.3g} mm, give {allowance} below 0, or leave out "
        "one of shifts and centre distance"
    )


def least_ring_tip(pinion: Gear, ring_teeth: int, centre_distance: float) -> float:
    """Return the tip diameter of a ring that its pinion's involute just reaches.

    ``d_a = 2 √(r_b² + (ρ_F + a sinα_w)²)`` [m].

    Parameters
    ----------
    pinion : the pinion
    ring_teeth : number of teeth of the ring
    centre_distance : a [m]
    """
    base_radius = pinion.base_radius * ring_teeth / pinion.teeth
    lead = _lead(base_radius - pinion.base_radius, centre_distance)
    return 2.0 * math.hypot(base_radius, pinion.form_curvature + lead)


def make_room(
    pinion: Gear, ring: Gear, centre_distance: float, *, shorten: bool
) -> tuple[Gear, Gear]:
    """Return both gears so that contact begins on the pinion's involute.

    Only a small change is made. Where nobody said where the ring's tip lies, it is
    shortened to ``r_a = √(r_b² + (ρ_form + a sinα_w)²)``; otherwise the rounding of the
    pinion's rack is reduced by at most 5 per cent, which helps no undercut pinion. A
    ring's tip that would touch beyond the end of the pinion's involute stays as it is.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]
    shorten : whether the ring's tip may be shortened

    Returns
    -------
    (pinion, ring), the changed one with a flag of what was changed
    """
    lead = _lead(ring.base_radius - pinion.base_radius, centre_distance)
    start = ring.tip_curvature - lead
    end = math.sqrt(pinion.form_radius**2 - pinion.base_radius**2)
    if not 0.0 < start < end:
        return pinion, ring
    if shorten:
        tip = math.hypot(ring.base_radius, end + lead)
        flag = (
            f"tip shortened by {(tip - ring.active_tip_radius) / ring.module:.3g} "
            "modules: it touches the "
            f"{pinion.name} where its involute begins"
        )
        return pinion, _with_tip(ring, tip)._replace(assumed=(*ring.assumed, flag))
    if pinion.is_undercut:
        return pinion, ring
    return _less_rounded(pinion, ring, start), ring


def _lead(apart: float, centre_distance: float) -> float:
    """Return a sinα_w of base radii that lie so far apart, ≥ 0 against rounding [m]."""
    return math.sqrt(max(0.0, centre_distance**2 - apart**2))


def _with_tip(ring: Gear, radius: float) -> Gear:
    """Return a ring whose active flank ends at a radius, with the same chamfer."""
    if ring.usable_tip_radius is None:
        return ring._replace(tip_radius=radius)
    chamfer = ring.usable_tip_radius - ring.tip_radius
    return ring._replace(tip_radius=radius - chamfer, usable_tip_radius=radius)


def _less_rounded(pinion: Gear, ring: Gear, start: float) -> Gear:
    """Return the pinion with the rounding whose edge ends where contact starts.

    It is the given pinion where that rounding would be much smaller.

    ``ρ_form = r sinα − h_e / sinα`` with ``h_e = h − ρ (1 − sinα)``, as in
    :mod:`wearlab.gears.root`.
    """
    sin = math.sin(pinion.pressure_angle)
    edge = (pinion.reference_radius * sin - start) * sin
    rounding = (pinion.reference_radius - pinion.root_radius - edge) / (1.0 - sin)
    is_enough = rounding >= MIN_ROUNDING * pinion.fillet_radius
    if pinion.root_profile != "trochoid" or not is_enough:
        return pinion
    cut = pinion.cut._replace(fillet=rounding / pinion.module)
    form = root.form_radius(pinion.name, cut)
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
    alpha_p = math.acos(pinion.base_radius / r_p)
    alpha_r = math.acos(ring.base_radius / r_r)
    delta_p = math.acos(cos_p)
    delta_r = math.acos((r_r**2 - r_p**2 + a**2) / (2.0 * a * r_r))
    total = pinion.teeth * (involute(alpha_p) + delta_p)
    total -= ring.teeth * (involute(alpha_r) + delta_r)
    total += (ring.teeth - pinion.teeth) * involute(alpha_w)
    return total * r_r / ring.teeth

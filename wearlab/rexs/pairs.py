"""External and internal pairs of a file."""

import math

from wearlab.gears.helix import overlap_ratio, transverse_basics
from wearlab.gears.shifts import internal_position, operating_position
from wearlab.gears.specification import Basics, GearError
from wearlab.rexs.document import Component, Document, RexsError
from wearlab.rexs.draft import Draft, KeyEntry
from wearlab.rexs.power import gears_of
from wearlab.rexs.quantities import Read, number, size
from wearlab.rexs.wheel import Wheel, put_gear, wheel_of

SHIFT_FITS = 2e-3
"""How far a printed sum of shifts may be from what the centre distance asks for."""
OTHER_WIDTH = 1e-9
"""Relative difference from which a gear's face is another one than the pair's."""

Summary = tuple[str, tuple[int, ...], float | None, float | None]
"""Kind of gear set, teeth, module [mm], centre distance [mm]."""


Roles = dict[str, str]
"""Member → number of its gear's component."""


def summary(document: Document, stage: Component) -> Summary:
    """Return a pair as a list of stages shows it.

    Parameters
    ----------
    document : the file
    stage : the pair's component

    Raises
    ------
    RexsError : its gears are not in the file
    """
    wheels = wheels_of(document, stage, Draft(""))
    kind = "internal-pair" if wheels[1].is_ring else "external-pair"
    teeth = tuple(int(wheel.teeth or 0) for wheel in wheels)
    module = size(wheels[0].gear, "normal_module", "mm")
    distance = size(stage, "center_distance", "mm")
    return (
        kind,
        teeth,
        None if module is None else module.value,
        None if distance is None else distance.value,
    )


def wheels_of(
    document: Document, stage: Component, draft: Draft
) -> tuple[Wheel, Wheel]:
    """Return pinion and mate: the gear with fewer teeth first, a ring always second.

    Parameters
    ----------
    document : the file
    stage : the pair's component
    draft : takes remarks

    Raises
    ------
    RexsError : its gears are not in the file
    """
    gears = gears_of(document, stage)
    if gears is None:
        raise RexsError(
            f'"{stage.name or stage.id}" names no two cylindrical gears: export the '
            "gear unit whole"
        )
    first, second = (wheel_of(document, gear, draft) for gear in gears)
    if first.is_ring or (
        not second.is_ring and (second.teeth or 0) < (first.teeth or 0)
    ):
        return second, first
    return first, second


def put_stage(draft: Draft, document: Document, stage: Component) -> Roles:
    """Write ``[gears]`` of a pair.

    Parameters
    ----------
    draft : the campaign file
    document : the file
    stage : the pair's component

    Raises
    ------
    RexsError : module or gears are missing
    """
    wheels = wheels_of(document, stage, draft)
    mate = "ring" if wheels[1].is_ring else "gear"
    kind = "internal-pair" if wheels[1].is_ring else "external-pair"
    draft.put("gears", "kind", kind, f"component {stage.id}, {stage.type}")
    module = put_rack(draft, wheels[0])
    distance = size(stage, "center_distance", "mm")
    if not draft.take("gears", "centre_distance", distance, "mm"):
        inwards = wheels[1].is_ring
        of_ring = ", the ring's with the sign that the file has" if inwards else ""
        draft.missing.append(
            f"gears.centre_distance: it follows from the profile shifts{of_ring}"
        )
    by_member = {"pinion": wheels[0], mate: wheels[1]}
    put_face(draft, stage, by_member)

    for member, wheel in by_member.items():
        put_gear(draft, member, wheel, module)
        put_hand(draft, member, wheel)
    if distance is not None:
        derive_shifts(draft, ("pinion", mate), wheels, module, distance.value)
    put_overlap(draft, wheels[0], module)
    return {"pinion": wheels[0].gear.id, mate: wheels[1].gear.id}


def put_rack(draft: Draft, wheel: Wheel) -> float:
    """Write module, pressure angle and helix angle; return the module [mm].

    Parameters
    ----------
    draft : the campaign file
    wheel : a gear of the set

    Raises
    ------
    RexsError : no module
    """
    module = size(wheel.gear, "normal_module", "mm")
    if module is None:
        raise RexsError(
            f"component {wheel.gear.id} has no normal_module: enter it in the program "
            "that wrote the file"
        )
    draft.take("gears", "module", module, "mm")
    angle = number(wheel.flank, "normal_pressure_angle", "deg")
    draft.take("gears", "pressure_angle", angle, "deg")
    if angle is None:
        draft.missing.append("gears.pressure_angle: 20 deg is assumed")

    helix = wheel.helix
    if helix is not None and helix.value != 0.0:
        positive = helix._replace(value=abs(helix.value))
        draft.take("gears", "helix_angle", positive, "deg")
    return module.value


def put_hand(draft: Draft, member: str, wheel: Wheel) -> None:
    """Write the hand of a helical gear: a positive helix angle is a right hand.

    Parameters
    ----------
    draft : the campaign file
    member : such as ``pinion``
    wheel : its gear
    """
    helix = wheel.helix
    if helix is not None and helix.value != 0.0:
        hand = "right" if helix.value > 0.0 else "left"
        draft.put(f"gears.{member}", "hand", hand, helix.source)


def put_face(draft: Draft, stage: Component, wheels: dict[str, Wheel]) -> None:
    """Write the common face width, and those of gears that are wider.

    It is what the file states, else the overlap of the two faces.

    Parameters
    ----------
    draft : the campaign file
    stage : the pair's component
    wheels : member → its gear
    """
    widths = {
        member: width
        for member, wheel in wheels.items()
        if (width := size(wheel.gear, "face_width", "mm")) is not None
    }
    if not widths:
        draft.missing.append("gears.face_width")
        return

    stated = size(stage, "common_face_width", "mm")
    common = stated or _overlap(list(wheels.values()), list(widths.values()))
    draft.take("gears", "face_width", common, "mm")
    for member, width in widths.items():
        if width.value > common.value * (1.0 + OTHER_WIDTH):
            draft.take(f"gears.{member}", "face_width", width, "mm")


def _overlap(wheels: list[Wheel], widths: list[Read]) -> Read:
    """Return the overlap of two faces, the narrower one where a place is unknown."""
    narrow = min(widths, key=lambda width: width.value)
    middles = [wheel.middle for wheel in wheels]
    if len(widths) != len(wheels) or None in middles:
        return narrow

    ends = [
        (middle - 0.5 * width.value, middle + 0.5 * width.value)
        for middle, width in zip(middles, widths, strict=True)
        if middle is not None
    ]
    overlap = min(end for _, end in ends) - max(begin for begin, _ in ends)
    if not 0.0 < overlap < narrow.value * (1.0 - OTHER_WIDTH):
        return narrow
    return Read(float(f"{overlap:.12g}"), "overlap of the two faces")


def derive_shifts(
    draft: Draft,
    members: tuple[str, str],
    wheels: tuple[Wheel, Wheel],
    module: float,
    distance: float,
) -> None:
    """Say what sum of profile shifts the centre distance asks for.

    Of a ring it is the difference of the shifts, and the ring's own shift is turned to
    the sign that fits, or left out.

    Parameters
    ----------
    draft : the campaign file
    members : names of the two members
    wheels : their gears
    module : normal module [mm]
    distance : centre distance [mm]
    """
    first, second = wheels
    if first.teeth is None or second.teeth is None:
        return

    inwards = second.is_ring
    normal = Basics(1e-3 * module, first.pressure_angle)
    rack = transverse_basics(normal, first.helix_angle)
    find_position = internal_position if inwards else operating_position
    teeth = (int(first.teeth), int(second.teeth))
    if min(teeth) < 1 or (inwards and teeth[1] <= teeth[0]):
        draft.left_out.append(
            f"{' and '.join(members)}: no centre distance goes with "
            f"{' and '.join(map(str, teeth))} teeth"
        )
        return

    try:
        position = find_position(teeth, (None, None), rack, 1e-3 * distance)
    except GearError as error:
        draft.left_out.append(f"{' and '.join(members)}: {error}")
        return

    first_shift, second_shift = position.shifts  # over the transverse module
    transverse_total = second_shift + (-first_shift if inwards else first_shift)
    total = transverse_total * rack.module / normal.module
    working = math.degrees(position.working_pressure_angle)
    label = "difference of profile shifts" if inwards else "sum of profile shifts"
    draft.derived.append(
        f"{members[0]}, {members[1]}: working pressure angle (transverse) "
        f"{working:.5f} deg, {label} {total + 0.0:.6f} from the centre distance"
    )
    if inwards:
        _turn_ring_shift(draft, members, total)


def _turn_ring_shift(draft: Draft, members: tuple[str, str], total: float) -> None:
    """Give a ring's shift the sign that the centre distance fits, or leave it out."""
    section = f"gears.{members[1]}"
    entry = draft.entries[section].get("profile_shift_coefficient")
    pinion = draft.entries[f"gears.{members[0]}"].get("profile_shift_coefficient")
    if entry is None or entry.value == 0.0:
        return

    pinion_shift = float(pinion.value) if pinion is not None else 0.0
    for sign in (1.0, -1.0):
        if abs(sign * entry.value - pinion_shift - total) < SHIFT_FITS:
            turned = KeyEntry(sign * entry.value, entry.comment)
            draft.entries[section]["profile_shift_coefficient"] = turned
            return

    del draft.entries[section]["profile_shift_coefficient"]
    draft.left_out.append(
        f"{entry.comment} = {entry.value:g}: neither sign fits the centre distance; "
        "it is derived"
    )


def put_overlap(draft: Draft, wheel: Wheel, module: float) -> None:
    """Say what the overlap ratio of a helical pair is.

    Parameters
    ----------
    draft : the campaign file
    wheel : one of its gears
    module : normal module [mm]
    """
    face = draft.entries["gears"].get("face_width")
    if wheel.helix_angle == 0.0 or face is None:
        return
    width = float(str(face.value).split()[0])
    ratio = overlap_ratio(width, wheel.helix_angle, module)
    draft.derived.append(f"overlap ratio {ratio:.5f}")

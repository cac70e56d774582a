"""``[operation]`` and ``[lubricant]`` of a stage: load cases, driving member, oil."""

from contextlib import suppress
from typing import Any, NamedTuple

from wearlab.rexs.document import Component, Document, LoadCase, RexsError
from wearlab.rexs.draft import Draft, with_unit
from wearlab.rexs.pairs import Roles
from wearlab.rexs.planetary import planetary_gears
from wearlab.rexs.power import (
    CASING,
    Flow,
    Link,
    ShaftGroups,
    flow,
    gears_of,
    pair_link,
)
from wearlab.rexs.quantities import Read, number
from wearlab.rexs.wheel import Wheel

WHOLE = 1e-2
"""How far shares of time may be from 1 in sum before they are called wrong."""


class StageLoad(NamedTuple):
    """One load case at a stage.

    Parameters
    ----------
    torque : of the first member of the stage's link, positive where it drives [N m]
    speed : of that member, without sign [rpm]
    other_torque : of the second member, positive where it drives [N m]
    other_speed : of that member, without sign [rpm]
    share : of the time, None where it is not given
    """

    torque: float
    speed: float
    other_torque: float
    other_speed: float
    share: float | None


def links_of(document: Document, groups: ShaftGroups) -> list[Link]:
    """Return the stages of a gear unit as links between groups of shafts.

    Parameters
    ----------
    document : the file
    groups : shafts that turn as one
    """
    links = []
    inside = set()
    for stage in document.of_type("planetary_stage"):
        parts = document.partners("assembly", "assembly", stage.id, "part")
        inside |= {part.id for part in parts}
        with suppress(RexsError):  # a stage that cannot be taken passes no power on
            link = _planetary_link(document, groups, stage)
            links += [link] if link is not None else []

    for stage in document.of_type("cylindrical_stage"):
        gears = gears_of(document, stage)
        if stage.id in inside or gears is None:
            continue
        wheels = (Wheel(document, gears[0], None), Wheel(document, gears[1], None))
        pair = pair_link(document, groups, stage, wheels)
        links += [pair] if pair is not None else []
    return links


def _planetary_link(
    document: Document, groups: ShaftGroups, stage: Component
) -> Link | None:
    """Return a planetary stage of which one member is fixed as a link.

    Willis: ``z_s (n_s − n_c) + z_r (n_r − n_c) = 0``.
    """
    members = _members(document, groups, stage)
    if members is None:
        return None

    sun, ring, carrier = (members[name] for name in ("sun", "ring", "carrier"))
    train = planetary_gears(document, stage)
    sun_teeth = Wheel(document, train.sun, None).teeth or 0.0
    ring_teeth = Wheel(document, train.ring, None).teeth or 0.0
    if not sun_teeth or not ring_teeth:
        return None
    if ring == CASING:
        return Link(stage.id, sun, carrier, sun_teeth / (sun_teeth + ring_teeth))
    if carrier == CASING:
        return Link(stage.id, sun, ring, -sun_teeth / ring_teeth)
    if sun == CASING:
        return Link(stage.id, ring, carrier, ring_teeth / (sun_teeth + ring_teeth))
    return None


def _members(
    document: Document, groups: ShaftGroups, stage: Component
) -> dict[str, str] | None:
    """Return the groups of sun, ring and carrier, None where one has no shaft."""
    train = planetary_gears(document, stage)
    sun = Wheel(document, train.sun, None).shaft
    ring = Wheel(document, train.ring, None).shaft
    if sun is None or ring is None or train.carrier is None:
        return None
    return {
        "sun": groups.of(sun.id),
        "ring": groups.of(ring.id),
        "carrier": groups.of(train.carrier.id),
    }


def put_operation(
    draft: Draft,
    document: Document,
    stage: Component,
    roles: Roles,
    cases: tuple[LoadCase, ...],
) -> None:
    """Write ``[operation]``: one torque and speed, or the load cases as a duty.

    Parameters
    ----------
    draft : the campaign file
    document : the file
    stage : the stage's component
    roles : which gear is which member
    cases : the load cases to take; none takes the file's own values
    """
    groups = ShaftGroups(document)
    links = links_of(document, groups)
    link = next((entry for entry in links if entry.stage == stage.id), None)
    loads: list[StageLoad | None] = []
    if link is not None:
        for case in cases or (None,):
            loaded = document.in_case(case)
            loads.append(_stage_load(loaded, link, flow(loaded, groups, links)))

    conditions = [load for load in loads if load is not None]
    if link is None or not conditions:
        draft.missing.append(
            "[operation]: torque and speed of this stage do not follow from the loads "
            "and speeds of the file"
        )
        return

    if len(conditions) < len(loads):
        draft.missing.append(
            f"operation: torque or speed of {len(loads) - len(conditions)} of "
            f"{len(loads)} load cases does not follow from the file; they are left out"
        )
    first, second = _ends(document, groups, stage, roles, link)
    forwards = sum(one.torque * one.speed for one in conditions) >= 0.0
    driving, driven = (first, second) if forwards else (second, first)
    draft.put("operation", "input", driving, "torque times speed is positive there")
    if stage.type == "planetary_stage":
        draft.put("operation", "output", driven, "")
    _put_conditions(draft, conditions, forwards=forwards)
    if any(one.torque * (1 if forwards else -1) < 0.0 for one in conditions):
        if stage.type == "planetary_stage":
            draft.missing.append(
                "operation.duty: load cases of negative torque: planetary sets do not "
                "take them; delete their rows"
            )
        else:
            draft.derived.append(
                "operation.duty: load cases of negative torque load the back flanks, "
                "which wear by themselves"
            )


def _stage_load(document: Document, link: Link, power_flow: Flow) -> StageLoad | None:
    """Return one load case at a stage, None where it leaves torque or speed open."""
    torque = power_flow.torques.get(link.stage)
    speed = power_flow.speeds.get(link.first)
    if torque is None or speed is None:
        return None

    sense = 1.0 if speed >= 0.0 else -1.0
    other_sense = 1.0 if speed * link.ratio >= 0.0 else -1.0
    return StageLoad(
        torque=torque * sense,
        speed=abs(speed),
        other_torque=-torque / link.ratio * other_sense,
        other_speed=abs(speed * link.ratio),
        share=_share(document),
    )


def _share(document: Document) -> float | None:
    """Return the share of time of a load case, or its hours where it has no share."""
    for unit in document.of_type("gear_unit"):
        share = number(unit, "operating_time_fraction", "1")
        if share is None:
            continue
        stated = unit.attributes.get(share.source.split(", ")[1])
        percent = stated is not None and stated.unit.strip() == "%"
        return share.value if percent or share.value <= 1.0 else share.value / 100.0
    for unit in document.of_type("gear_unit"):
        hours = number(unit, "operating_time", "h")
        if hours is not None:
            return hours.value
    return None


def _ends(
    document: Document, groups: ShaftGroups, stage: Component, roles: Roles, link: Link
) -> tuple[str, str]:
    """Return the members at the two ends of a stage's link."""
    if stage.type == "planetary_stage":
        members = _members(document, groups, stage) or {}
        names = {group: name for name, group in members.items()}
        return names[link.first], names[link.second]

    gears = gears_of(document, stage)
    names = {number_: name for name, number_ in roles.items()}
    assert gears is not None  # the link was made of them
    return names[gears[0].id], names[gears[1].id]


def _put_conditions(
    draft: Draft, conditions: list[StageLoad], *, forwards: bool
) -> None:
    """Write torque and speed of the driving member, or a table of load cases."""
    rows = [_row(condition, forwards=forwards) for condition in conditions]
    shares = [condition.share for condition in conditions]
    if len(rows) == 1:
        for key, value in rows[0].items():
            draft.put("operation", key, value, "of the load case, without losses")
        return
    if None in shares:
        draft.missing.append(
            "operation.duty: the load cases have no shares of time; the first one is "
            "taken"
        )
        for key, value in rows[0].items():
            draft.put("operation", key, value, "of the first load case")
        return

    total = sum(share for share in shares if share is not None)
    for row, share in zip(rows, shares, strict=True):
        row["share"] = float(f"{(share or 0.0) / total:.12g}")
    if total > 1.0 + WHOLE:
        draft.derived.append(f"operation.duty: shares of {total:g} h in all")
    draft.put("operation", "duty", rows, "")


def _row(condition: StageLoad, *, forwards: bool) -> dict[str, Any]:
    """Return torque and speed of the member that drives."""
    torque = condition.torque if forwards else condition.other_torque
    speed = condition.speed if forwards else condition.other_speed
    return {
        "torque": with_unit(float(f"{torque:.10g}"), "N*m"),
        "speed": with_unit(float(f"{speed:.10g}"), "rpm"),
    }


def put_lubricant(draft: Draft, document: Document, stage: Component) -> None:
    """Write ``[lubricant]``: of the stage, a pair of it, or the casing.

    Parameters
    ----------
    draft : the campaign file
    document : the file, in a load case
    stage : the stage's component
    """
    inside = document.partners("assembly", "assembly", stage.id, "part")
    casings = list(document.of_type("gear_casing"))
    origins = [stage, *inside, *casings]
    oil = next(
        (
            part
            for origin in origins
            for part in document.partners(
                "reference", "origin", origin.id, "referenced"
            )
            if part.type == "lubricant"
        ),
        None,
    )
    if oil is None:
        draft.missing.append("[lubricant]: none in the file")
        return

    section = "lubricant"
    at_40 = number(oil, "viscosity_at_40_degree_celsius", "mm^2/s")
    at_100 = number(oil, "viscosity_at_100_degree_celsius", "mm^2/s")
    density = number(oil, "density_at_15_degree_celsius", "kg/m^3")
    temperature = _temperature(origins)
    if at_40 is None or at_100 is None or density is None or temperature is None:
        draft.left_out.append(
            f"component {oil.id}, the lubricant: viscosities at 40 and 100 degC, "
            "density and temperature_lubricant are needed together"
        )
        return

    draft.take(section, "kinematic_viscosity_40", at_40, "mm^2/s")
    draft.take(section, "kinematic_viscosity_100", at_100, "mm^2/s")
    draft.take(section, "density", density, "kg/m^3")
    draft.take(section, "temperature", temperature, "degC")


def _temperature(origins: list[Component]) -> Read | None:
    """Return the temperature of the oil at the first place that states one [degC]."""
    for origin in origins:
        read = number(origin, "temperature_lubricant", "degC")
        if read is not None:
            return read
    return None

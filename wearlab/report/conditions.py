"""What the gears are asked to bear: operating conditions and wear law, case by case where they vary."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.scene import Scene
from wearlab.store.place import place

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case

MOST_CASES = 24
"""Cases told one by one; of more, how far their values reach."""
MOST_VALUES = 6  # of one quantity, told in one line
RPM = 30.0 / math.pi
PER_NM = 1e9  # mm³/(N·m) in m²/N


class Condition(NamedTuple):
    """One line: symbol, meaning, unit, and the value that all cases have, or how far theirs reach."""

    symbol: str
    meaning: str
    unit: str
    value: str


class Conditions(NamedTuple):
    """What all cases have in common, and what each has of its own.

    Parameters
    ----------
    shared : quantities, with the range of those that vary
    heads : quantities that vary, with their units
    cases : each case with its values of these
    """

    shared: tuple[Condition, ...]
    heads: tuple[str, ...]
    cases: tuple[tuple[str, tuple[str, ...]], ...]


def conditions(campaign: "Campaign") -> Conditions:
    """Return operating conditions and wear law of a campaign's cases."""
    told = [
        (case, {quantity[:3]: quantity.value for quantity in _quantities(case.scene)})
        for case in campaign.cases
    ]
    keys = list(dict.fromkeys(key for _, own in told for key in own))
    values = {key: list(dict.fromkeys(own.get(key, "none") for _, own in told)) for key in keys}
    varying = [key for key in keys if len(values[key]) > 1]
    beside = varying if len(told) <= MOST_CASES else []
    return Conditions(
        tuple(Condition(*key, _reach(values[key])) for key in keys if key not in beside),
        tuple(f"{meaning} [{unit}]" if unit else meaning for _, meaning, unit in beside),
        tuple(
            (case_name(campaign, case), tuple(own.get(key, "none") for key in beside)) for case, own in told
        )
        if beside
        else (),
    )


def case_name(campaign: "Campaign", case: "Case") -> str:
    """Return how a page calls a case: its label, and its place on every axis."""
    along = [f"{name.replace('_', ' ')} {text}" for name, text in place(campaign, case).items()]
    return ", ".join([*([case.label] if case.label != "base" or not along else []), *along]).replace("*", "·")


def _reach(values: list[str]) -> str:
    """Return what the values of all cases are, of many numbers how far they reach."""
    if len(values) <= MOST_VALUES:
        return ", ".join(values)
    try:
        ordered = sorted(values, key=float)
    except ValueError:
        return f"{', '.join(values[:MOST_VALUES])}, … {len(values)} in all"
    return f"{ordered[0]} to {ordered[-1]} ({len(values)} values)"


def _quantities(scene: Scene) -> Iterator[Condition]:
    yield from _load(scene)
    yield from _oil(scene)
    yield from _wear(scene)


def _load(scene: Scene) -> Iterator[Condition]:
    """Yield torque and speed of the input, or of the conditions that take turns."""
    operation = scene.operation
    if several := operation.blocks or operation.stages:
        meaning = "conditions that take turns" if operation.blocks else "conditions in order"
        yield Condition("", meaning, "", str(len(several)))
        torques, speeds = (
            [condition.torque for condition in several],
            [RPM * condition.speed for condition in several],
        )
        yield Condition("T", f"torque on the {operation.input}", "N·m", _span(torques))
        yield Condition("n", f"speed of the {operation.input}", "rpm", _span(speeds))
    else:
        yield Condition("T", f"torque on the {operation.input}", "N·m", _number(operation.torque))
        yield Condition("n", f"speed of the {operation.input}", "rpm", _number(RPM * operation.speed))
        yield Condition("P", "power", "kW", _number(1e-3 * operation.torque * operation.speed))
    if operation.fixed:
        yield Condition("", "at rest", "", operation.fixed)


def _oil(scene: Scene) -> Iterator[Condition]:
    oil = scene.lubricant
    if oil is None:
        return
    warm = "" if oil.temperature is None else f" at {oil.temperature - 273.15:.4g} °C"
    if oil.grade:
        yield Condition("", "oil", "", f"ISO VG {oil.grade}{warm}")
    if oil.viscosity is not None:
        yield Condition("η_0", "viscosity of the oil", "mPa·s", _number(1e3 * oil.viscosity))


def _wear(scene: Scene) -> Iterator[Condition]:
    """Yield the wear law with its coefficient, the wear before the first cycle, and what ends the life."""
    wear = scene.wear
    if wear is None:
        return
    if wear.coefficient is not None:
        yield Condition("", "wear law", "", f"{wear.law.chosen.capitalize()}, {wear.load.chosen} load")
        each = {member: wear.coefficient_of(member) for member in scene.gears.toothed}
        alike = len({condition.model_dump_json() for condition in each.values()}) == 1
        for member, condition in list(each.items())[: 1 if alike else None]:
            yield _coefficient(condition, "" if alike else f" of the {member}")
    for name, initial in wear.initial or ():
        if initial is not None:
            yield Condition("", f"initial wear of the {name}", "", initial_wear(initial))
    if wear.until is not None:
        yield Condition("", "ends at", "", " or ".join(_ends(wear.until)))


def _coefficient(coefficient: Any, whose: str) -> Condition:
    """Return a wear coefficient: its number where it has one, else what it follows from."""
    scaled = "" if coefficient.factor == 1.0 else f" × {coefficient.factor:.4g}"
    if coefficient.chosen == "constant":
        return Condition(
            "k", f"wear coefficient{whose}", "mm³/(N·m)", _number(PER_NM * coefficient.value) + scaled
        )
    if coefficient.chosen == "hardness":
        return Condition(
            "K", f"wear coefficient{whose}", "", f"{_number(coefficient.k)}{scaled} over the hardness"
        )
    if coefficient.chosen == "calibrated":
        depth = f"{_number(1e6 * coefficient.depth)} µm on the {coefficient.flank}"
        life = f"calibrated: {depth} in {coefficient.life:.4g} cycles"
        at = f"at {_number(coefficient.torque)} N·m, {_number(RPM * coefficient.speed)} rpm"
        return Condition("k", f"wear coefficient{whose}", "", f"{life} {at}{scaled}")
    return Condition("k", f"wear coefficient{whose}", "", f"{coefficient.chosen}{scaled}")


def initial_wear(initial: Any) -> str:
    """Return the wear that a flank begins with, in words."""
    if initial.chosen == "measured":
        file = getattr(initial, "file", None)
        return f"as measured in {Path(file).name}" if file else "as measured"
    depth = getattr(initial, "depth", None)
    return f"{initial.chosen}, {_number(1e6 * depth)} µm" if depth is not None else str(initial.chosen)


def _ends(until: Any) -> Iterator[str]:
    if until.depth is not None:
        yield f"{_number(1e6 * until.depth)} µm of wear{f' of the {until.flank}' if until.flank else ''}"
    for name in ("cycles", "mesh_cycles", "hours"):
        if (limit := getattr(until, name)) is not None:
            yield f"{limit:.4g} {name.replace('_', ' ')}"


def _span(values: list[float]) -> str:
    low, high = min(values), max(values)
    return _number(low) if low == high else f"{_number(low)} to {_number(high)}"


def _number(value: float) -> str:
    return f"{value:.4g}"

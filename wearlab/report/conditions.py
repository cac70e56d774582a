"""What the gears of a campaign are asked to bear: loads, speeds, oil and wear law."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.campaign import Campaign, Case
from wearlab.scene import Scene
from wearlab.store.outcome import place
from wearlab.units import shown_unit

MAX_SHOWN_CASES = 24
"""Cases listed one by one; of more, a page says how far their values reach."""
MAX_SHOWN_VALUES = 6  # of one quantity, in one line
RPM = 30.0 / math.pi
ABSENT = "none"


class Condition(NamedTuple):
    """One quantity of one case, or of all.

    Parameters
    ----------
    symbol, meaning, unit : of the quantity, "" where it has none
    value : that all cases have, or how far theirs reach
    """

    symbol: str
    meaning: str
    unit: str
    value: str

    @property
    def quantity(self) -> tuple[str, str, str]:
        """Symbol, meaning and unit."""
        return self.symbol, self.meaning, self.unit


class Conditions(NamedTuple):
    """What all cases have in common, and what differs between them.

    Parameters
    ----------
    shared : quantities, with the range of those that vary
    heads : quantities that vary, with their units
    cases : each case with its values of these
    """

    shared: tuple[Condition, ...]
    heads: tuple[str, ...]
    cases: tuple[tuple[str, tuple[str, ...]], ...]


def conditions(campaign: Campaign) -> Conditions:
    """Return operating conditions and wear law of a campaign's cases.

    Parameters
    ----------
    campaign : its cases and axes
    """
    values_of_cases = [
        {condition.quantity: condition.value for condition in _conditions(case.scene)}
        for case in campaign.cases
    ]
    quantities = dict.fromkeys(
        quantity for values in values_of_cases for quantity in values
    )
    different_values = {
        quantity: list(
            dict.fromkeys(values.get(quantity, ABSENT) for values in values_of_cases)
        )
        for quantity in quantities
    }

    varying = []
    if len(campaign.cases) <= MAX_SHOWN_CASES:
        varying = [
            quantity for quantity, values in different_values.items() if len(values) > 1
        ]
    shared = [
        Condition(*quantity, _reach(values))
        for quantity, values in different_values.items()
        if quantity not in varying
    ]
    heads = [f"{meaning} [{unit}]" if unit else meaning for _, meaning, unit in varying]
    rows = []
    if varying:
        for case, values in zip(campaign.cases, values_of_cases, strict=True):
            row = tuple(values.get(quantity, ABSENT) for quantity in varying)
            rows.append((case_name(campaign, case), row))
    return Conditions(tuple(shared), tuple(heads), tuple(rows))


def case_name(campaign: Campaign, case: Case) -> str:
    """Return how a page calls a case: its label, and its place on every axis.

    Parameters
    ----------
    campaign : its axes
    case : of the campaign
    """
    keys = {axis.name: axis.key for axis in campaign.axes}
    places = [
        f"{_axis_name(name, keys[name])} {text}"
        for name, text in place(campaign, case).items()
    ]
    is_named_by_place = case.label == "base" and places
    label = [] if is_named_by_place else [case.label]
    return shown_unit(", ".join([*label, *places]))


def _axis_name(name: str, key: str) -> str:
    """Return an axis' own name, or the words of its key below the section."""
    words = key.split(".")
    if words[-1] == name:
        name = " ".join(words[1:] or words)
    return name.replace("_", " ")


def _reach(values: list[str]) -> str:
    """Return the values of all cases, of many numbers how far they reach."""
    if len(values) <= MAX_SHOWN_VALUES:
        return ", ".join(values)
    try:
        return f"{number_range(values)} ({len(values)} values)"
    except ValueError:
        first = ", ".join(values[:MAX_SHOWN_VALUES])
        return f"{first}, … {len(values)} in all"


def number_range(numbers: Sequence[str]) -> str:
    """Return how far numbers reach, such as "1 to 3".

    Parameters
    ----------
    numbers : as texts

    Raises
    ------
    ValueError : one is no number
    """
    low = min(numbers, key=float)
    high = max(numbers, key=float)
    return low if low == high else f"{low} to {high}"


def _number(value: float) -> str:
    """Return a number in four digits."""
    return f"{value:.4g}"


def _conditions(scene: Scene) -> Iterator[Condition]:
    """Yield everything that a scene asks of its gears."""
    yield from _load(scene)
    yield from _oil(scene)
    yield from _wear(scene)


def _load(scene: Scene) -> Iterator[Condition]:
    """Yield torque and speed of the input, or of the conditions that take turns."""
    operation = scene.operation
    in_turn = operation.blocks or operation.stages
    if operation.blocks:
        yield Condition("", "conditions that take turns", "", str(len(in_turn)))
    elif operation.stages:
        yield Condition("", "conditions in order", "", str(len(in_turn)))

    member = operation.input
    loads = in_turn or (operation,)
    torques = [_number(load.torque) for load in loads]
    speeds = [_number(RPM * load.speed) for load in loads]
    yield Condition("T", f"torque on the {member}", "N·m", number_range(torques))
    yield Condition("n", f"speed of the {member}", "rpm", number_range(speeds))
    if not in_turn:
        power = _number(1e-3 * operation.torque * operation.speed)
        yield Condition("P", "power", "kW", power)
    if operation.fixed:
        yield Condition("", "at rest", "", operation.fixed)


def _oil(scene: Scene) -> Iterator[Condition]:
    """Yield grade and viscosity of the oil."""
    oil = scene.lubricant
    if oil is None:
        return
    if oil.grade:
        name = f"ISO VG {oil.grade}"
        if oil.temperature is not None:
            name += f" at {oil.temperature - 273.15:.4g} °C"
        yield Condition("", "oil", "", name)
    if oil.viscosity is not None:
        viscosity = _number(1e3 * oil.viscosity)
        yield Condition("η_0", "viscosity of the oil", "mPa·s", viscosity)


def _wear(scene: Scene) -> Iterator[Condition]:
    """Yield the wear law, its coefficient, the initial wear, and what ends the life."""
    wear = scene.wear
    if wear is None:
        return
    if wear.coefficient is not None:
        law = f"{wear.law.chosen.capitalize()}, {wear.load.chosen} load"
        yield Condition("", "wear law", "", law)
        yield from _coefficients(scene)
    for name, initial in wear.initial or ():
        if initial is not None:
            depth = initial_wear(initial)
            yield Condition("", f"initial wear of the {name}", "", depth)
    if wear.until is not None:
        yield Condition("", "ends at", "", " or ".join(_ends(wear.until)))


def _coefficients(scene: Scene) -> Iterator[Condition]:
    """Yield the wear coefficient of every member, one where all are equal."""
    wear: Any = scene.wear
    coefficients = {
        member: wear.coefficient_of(member) for member in scene.gears.toothed
    }
    different = {value.model_dump_json() for value in coefficients.values()}
    if len(different) == 1:
        yield _coefficient(next(iter(coefficients.values())), "wear coefficient")
        return
    for member, coefficient in coefficients.items():
        yield _coefficient(coefficient, f"wear coefficient of the {member}")


def _coefficient(coefficient: Any, meaning: str) -> Condition:
    """Return the number of a wear coefficient, or what it follows from."""
    factor = "" if coefficient.factor == 1.0 else f" × {coefficient.factor:.4g}"
    if coefficient.chosen == "constant":
        value = _number(1e9 * coefficient.value)
        return Condition("k", meaning, "mm³/(N·m)", value + factor)
    if coefficient.chosen == "hardness":
        value = f"{_number(coefficient.k)}{factor} over the hardness"
        return Condition("K", meaning, "", value)
    if coefficient.chosen == "calibrated":
        depth = f"{_number(1e6 * coefficient.depth)} µm on the {coefficient.flank}"
        torque = f"{_number(coefficient.torque)} N·m"
        speed = f"{_number(RPM * coefficient.speed)} rpm"
        value = (
            f"calibrated: {depth} in {coefficient.life:.4g} cycles at {torque}, "
            f"{speed}{factor}"
        )
        return Condition("k", meaning, "", value)
    return Condition("k", meaning, "", f"{coefficient.chosen}{factor}")


def initial_wear(initial: Any) -> str:
    """Return the wear that a flank begins with, in words.

    Parameters
    ----------
    initial : variant of ``wear.initial``
    """
    if initial.chosen == "measured":
        file = getattr(initial, "file", None)
        return f"as measured in {Path(file).name}" if file else "as measured"
    depth = getattr(initial, "depth", None)
    if depth is None:
        return str(initial.chosen)
    return f"{initial.chosen}, {_number(1e6 * depth)} µm"


def _ends(until: Any) -> Iterator[str]:
    """Yield each limit that ends the life."""
    if until.depth is not None:
        flank = f" of the {until.flank}" if until.flank else ""
        yield f"{_number(1e6 * until.depth)} µm of wear{flank}"
    for name in ("cycles", "mesh_cycles", "hours"):
        limit = getattr(until, name)
        if limit is not None:
            yield f"{limit:.4g} {name.replace('_', ' ')}"

"""The answer of a campaign in words, and what the gears are asked to bear."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearlab.campaign import Campaign, Case
from wearlab.scene import Scene
from wearlab.store import Store, catalogue, files
from wearlab.store.outcome import hours_text, place, unasked_end
from wearlab.units import shown_unit

MOST_CASES = 24
"""Cases told one by one; of more, how far their values reach."""
MOST_VALUES = 6  # of one quantity, told in one line
RPM = 30.0 / math.pi
Entries = Mapping[str, catalogue.Entry]


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


def conditions(campaign: Campaign) -> Conditions:
    """Return operating conditions and wear law of a campaign's cases."""
    parts = (_load, _oil, _wear)
    told = [
        (c, {q[:3]: q.value for part in parts for q in part(c.scene)})
        for c in campaign.cases
    ]
    keys = list(dict.fromkeys(key for _, own in told for key in own))
    values = {
        key: list(dict.fromkeys(own.get(key, "none") for _, own in told))
        for key in keys
    }
    beside = (
        [key for key in keys if len(values[key]) > 1] if len(told) <= MOST_CASES else []
    )
    shared = [Condition(*key, _reach(values[key])) for key in keys if key not in beside]
    heads = [f"{meaning} [{unit}]" if unit else meaning for _, meaning, unit in beside]
    each = [
        (case_name(campaign, c), tuple(own.get(key, "none") for key in beside))
        for c, own in told
    ]
    return Conditions(tuple(shared), tuple(heads), tuple(each) if beside else ())


def case_name(campaign: Campaign, case: Case) -> str:
    """Return how a page calls a case: its label, and its place on every axis."""
    keys = {axis.name: axis.key for axis in campaign.axes}
    along = [
        f"{_axis_name(name, keys[name])} {text}"
        for name, text in place(campaign, case).items()
    ]
    return shown_unit(
        ", ".join(
            [*([case.label] if case.label != "base" or not along else []), *along]
        )
    )


def _axis_name(name: str, key: str) -> str:
    """Return how a page calls an axis: by the words of its key below the section, or its own name."""
    words = key.split(".")
    return (name if words[-1] != name else " ".join(words[1:] or words)).replace(
        "_", " "
    )


def _reach(values: list[str]) -> str:
    """Return what the values of all cases are, of many numbers how far they reach."""
    if len(values) <= MOST_VALUES:
        return ", ".join(values)
    try:
        return f"{_between(values)} ({len(values)} values)"
    except ValueError:
        return f"{', '.join(values[:MOST_VALUES])}, … {len(values)} in all"


def _load(scene: Scene) -> Iterator[Condition]:
    """Yield torque and speed of the input, or of the conditions that take turns."""
    operation = scene.operation
    if several := operation.blocks or operation.stages:
        meaning = (
            "conditions that take turns" if operation.blocks else "conditions in order"
        )
        yield Condition("", meaning, "", str(len(several)))
    each = several or (operation,)
    member = operation.input
    torques = [_number(one.torque) for one in each]
    speeds = [_number(RPM * one.speed) for one in each]
    yield Condition("T", f"torque on the {member}", "N·m", _between(torques))
    yield Condition("n", f"speed of the {member}", "rpm", _between(speeds))
    if not several:
        yield Condition(
            "P", "power", "kW", _number(1e-3 * operation.torque * operation.speed)
        )
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
        yield Condition(
            "η_0", "viscosity of the oil", "mPa·s", _number(1e3 * oil.viscosity)
        )


def _wear(scene: Scene) -> Iterator[Condition]:
    """Yield the wear law with its coefficient, the wear before the first cycle, and what ends the life."""
    wear = scene.wear
    if wear is None:
        return
    if wear.coefficient is not None:
        yield Condition(
            "",
            "wear law",
            "",
            f"{wear.law.chosen.capitalize()}, {wear.load.chosen} load",
        )
        each = {member: wear.coefficient_of(member) for member in scene.gears.toothed}
        alike = len({condition.model_dump_json() for condition in each.values()}) == 1
        for member, condition in list(each.items())[: 1 if alike else None]:
            yield _coefficient(condition, "" if alike else f" of the {member}")
    for name, initial in wear.initial or ():
        if initial is not None:
            yield Condition(
                "", f"initial wear of the {name}", "", initial_wear(initial)
            )
    if wear.until is not None:
        yield Condition("", "ends at", "", " or ".join(_ends(wear.until)))


def _coefficient(coefficient: Any, whose: str) -> Condition:
    """Return a wear coefficient: its number where it has one, else what it follows from."""
    scaled = "" if coefficient.factor == 1.0 else f" × {coefficient.factor:.4g}"
    meaning = f"wear coefficient{whose}"
    if coefficient.chosen == "constant":
        return Condition(
            "k", meaning, "mm³/(N·m)", _number(1e9 * coefficient.value) + scaled
        )
    if coefficient.chosen == "hardness":
        return Condition(
            "K", meaning, "", f"{_number(coefficient.k)}{scaled} over the hardness"
        )
    if coefficient.chosen == "calibrated":
        depth = f"{_number(1e6 * coefficient.depth)} µm on the {coefficient.flank}"
        life = f"calibrated: {depth} in {coefficient.life:.4g} cycles"
        at = (
            f"at {_number(coefficient.torque)} N·m, {_number(RPM * coefficient.speed)} "
            "rpm"
        )
        return Condition("k", meaning, "", f"{life} {at}{scaled}")
    return Condition("k", meaning, "", f"{coefficient.chosen}{scaled}")


def initial_wear(initial: Any) -> str:
    """Return the wear that a flank begins with, in words."""
    if initial.chosen == "measured":
        file = getattr(initial, "file", None)
        return f"as measured in {Path(file).name}" if file else "as measured"
    depth = getattr(initial, "depth", None)
    return (
        f"{initial.chosen}, {_number(1e6 * depth)} µm"
        if depth is not None
        else str(initial.chosen)
    )


def _ends(until: Any) -> Iterator[str]:
    if until.depth is not None:
        yield (
            f"{_number(1e6 * until.depth)} µm of "
            f"wear{f' of the {until.flank}' if until.flank else ''}"
        )
    for name in ("cycles", "mesh_cycles", "hours"):
        if (limit := getattr(until, name)) is not None:
            yield f"{limit:.4g} {name.replace('_', ' ')}"


def _between(numbers: Sequence[str]) -> str:
    """Return how far numbers reach."""
    low = min(numbers, key=float)
    high = max(numbers, key=float)
    return low if low == high else f"{low} to {high}"


def _number(value: float) -> str:
    return f"{value:.4g}"


FEW = 4
"""Cases that a sentence names."""
COMPARED = "Comparisons between cases hold all the same."


class CaseTold(NamedTuple):
    """One case of the answer; everything in words.

    Parameters
    ----------
    case : which
    hours : to the limit, or what was worn when the run ended
    range : for wear coefficients so many times as large or small
    cycles : to the limit
    error : estimated numerical error
    times : over the first case, nothing where there is no other
    share : of the longest life, for a bar [%]
    flank : that is worn deepest at the end
    begins : wear that this flank begins with [m]
    diameter : where it is worn deepest [m], 0 where that is not known
    """

    case: str
    hours: str
    range: str
    cycles: str
    error: str
    times: str
    share: float
    flank: str = ""
    begins: float = 0.0
    diameter: float = 0.0


class Reply(NamedTuple):
    """Sentences, and the cases they sum up; whether these end on different flanks."""

    sentences: tuple[str, ...]
    limit: str
    cases: tuple[CaseTold, ...]
    several_flanks: bool = False


def answer(
    campaign: Campaign, entries: Entries, factor: float, store: Store | None = None
) -> Reply | None:
    """Return the answer of a campaign whose runs wear to a limit, None of any other.

    Parameters
    ----------
    campaign : its cases
    entries : what the store knows of their runs
    factor : by which the wear coefficient may be larger or smaller; where the cases
        vary it, no range is told
    store : where the runs are, to say which flank is worn deepest
    """
    limit = _limit(campaign.cases[0].scene) if campaign.cases else ""
    known = ((case, entries.get(case.id)) for case in campaign.cases)
    done = [
        (case, entry.summary)
        for case, entry in known
        if entry is not None and entry.state == "done"
    ]
    worn = [(case, summary) for case, summary in done if summary.get("operating_hours")]
    ended = _ended_otherwise(
        [(case_name(campaign, case), summary) for case, summary in done]
    )
    if not worn:
        return Reply(tuple(ended), limit, ()) if ended else None
    lives = [life for _, summary in worn if (life := _life(summary)) is not None]
    given = [getattr(case.scene.wear, "coefficient", None) for case in campaign.cases]
    range_by = (
        factor if all(each == given[0] for each in given) else None
    )  # cases are the range themselves
    told = worn[:MOST_CASES]
    words = [
        _case(case_name(campaign, case), own, lives, range_by) for case, own in told
    ]
    cases = [
        one._replace(**_deepest(store, case))
        for one, (case, _) in zip(words, told, strict=True)
    ]
    if len(worn) == 1:
        cases = [cases[0]._replace(times="")]
    answered = [
        *_sentences(cases, lives, len(worn), limit, range_by),
        *_deepest_point(cases),
    ]
    sentences = (*answered, *ended, *_begun(cases, [case for case, _ in told]))
    shown = tuple(cases) if len(worn) <= MOST_CASES else ()
    return Reply(
        sentences, limit, shown, len({case.flank for case in cases if case.share}) > 1
    )


def gathered(pairs: Iterable[tuple[Any, Any]]) -> dict[Any, list[Any]]:
    """Return what goes with each key, in the order in which they come."""
    found: dict[Any, list[Any]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def _ended_otherwise(done: Sequence[tuple[str, Mapping[str, Any]]]) -> list[str]:
    """Return which cases ended otherwise than asked, those of one reason in one sentence."""
    cases = gathered(
        (end, name) for name, summary in done if (end := unasked_end(summary))
    )
    named = {
        end: ", ".join([*names[:FEW], *(["…"] if names[FEW:] else [])])
        for end, names in cases.items()
    }
    asked = f"of {len(done)} ended otherwise than asked"
    return [
        f"{len(names)} {asked} ({named[end]}): {end}." for end, names in cases.items()
    ]


def _deepest(store: Store | None, case: Case) -> dict[str, Any]:
    """Return the flank of a run that is worn deepest at its end, and how deep it began [m]."""
    if store is None:
        return {}
    try:
        run = store.run(case.id)
    except (files.StoreError, OSError):
        return {}
    depth = run.get("max_wear_depth")
    wear = run.get("wear_depth")
    if depth is None or set(depth.dims) != {"update", "flank"}:
        return {}
    at = int(np.nanargmax(depth.isel(update=-1).values))
    begins = float(depth.isel(update=0, flank=at).values)
    told = {
        "flank": str(depth["flank"].values[at]),
        "begins": begins if np.isfinite(begins) else 0.0,
    }
    if (
        wear is None
        or "diameter" not in run
        or set(wear.dims) != {"update", "flank", "profile"}
    ):
        return told
    deepest = int(np.nanargmax(wear.isel(update=-1, flank=at).values))
    return told | {"diameter": float(run["diameter"].isel(flank=at, profile=deepest))}


def _deepest_point(cases: Sequence[CaseTold]) -> Iterator[str]:
    """Yield at which diameters the flanks that are worn deepest are so."""
    places = gathered(
        (case.flank, f"{1e3 * case.diameter:.2f}") for case in cases if case.diameter
    )
    for flank, diameters in places.items():
        yield f"The {flank} is worn deepest at diameter {_between(diameters)} mm."


def _begun(cases: Sequence[CaseTold], asked: Sequence[Case]) -> Iterator[str]:
    """Yield that the wear with which a flank begins counts, and where it comes from."""
    begun = [
        (told, case.scene.wear)
        for told, case in zip(cases, asked, strict=True)
        if told.begins > 0.0
    ]
    given = [
        (told, getattr(getattr(wear, "initial", None), told.flank, None))
        for told, wear in begun
    ]
    whence = (
        (told, f", {initial_wear(initial)}" if initial else "")
        for told, initial in given
    )
    depths = gathered(
        ((told.flank, words), f"{1e6 * told.begins:.3g}") for told, words in whence
    )
    for (flank, words), own in depths.items():
        said = f"up to {_between(own)} µm{words}"
        yield f"The wear that the {flank} begins with ({said}) is part of these depths."


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and bool(np.isfinite(value))


def _limit(scene: Scene) -> str:
    until = getattr(scene.wear, "until", None)
    depth = getattr(until, "depth", None)
    flank = getattr(until, "flank", None)
    on = f" on the {flank}" if flank else ""
    return "" if depth is None else f"{1e6 * depth:.4g} µm of wear{on}"


def _life(summary: Mapping[str, Any]) -> float | None:
    """Return the time to the limit [s], None where it is not reached."""
    life: Any = summary.get("service_life")
    return float(life) if _is_number(life) else None


def _case(
    name: str, summary: Mapping[str, Any], lives: Sequence[float], factor: float | None
) -> CaseTold:
    """Return a case in words, its life beside the first and the longest of all."""
    if (life := _life(summary)) is None:
        depth = summary.get("max_wear_depth")
        worn = (
            f"not reached: {1e6 * float(depth):.3g} µm after "
            if depth is not None
            else "not reached: "
        )
        return CaseTold(
            name,
            f"{worn}{hours_text(summary.get('operating_hours'))}",
            "",
            "",
            "",
            "",
            0.0,
        )
    error = summary.get("error_estimate_life")
    cycles = summary.get("life")
    reach = (
        ""
        if factor is None
        else f"{hours_text(life / factor)} to {hours_text(life * factor)}"
    )
    off = f"{100 * (error / cycles):.2g} %" if _is_number(error) and cycles else ""
    times = f"× {life / lives[0]:.3g}" if lives[0] else ""
    share = 100.0 * life / max(lives)
    return CaseTold(
        name,
        hours_text(life),
        reach,
        f"{cycles:.3g}" if cycles else "",
        off,
        times,
        share,
    )


def _sentences(
    cases: Sequence[CaseTold],
    lives: list[float],
    count: int,
    limit: str,
    factor: float | None,
) -> Iterator[str]:
    if not limit:
        yield f"{count} cases ran to their end; no wear depth was set as the limit."
        return
    if not lives:
        yield f"No case reaches {limit} in the time that was asked for."
        return
    flanks = {case.flank for case in cases if case.share and case.flank}
    if len(flanks) == 1 and len(cases) == count and " on the " not in limit:
        limit = f"{limit} on the {next(iter(flanks))}"
    reached = f"{limit[0].upper()}{limit[1:]} is reached after"
    if len(lives) == 1:
        yield f"{reached} {hours_text(lives[0])} of operation."
    elif count <= MOST_CASES:
        texts = [hours_text(min(lives)), hours_text(max(lives))]
        low, high = (
            f"{text} ({next(c.case for c in cases if c.hours == text)})"
            for text in texts
        )
        equal = (
            f"{texts[0]} of operation in "
            f"{'both' if len(lives) == 2 else f'all {len(lives)}'} cases"
        )
        yield (
            f"{reached} "
            f"{equal if texts[0] == texts[1] else f'{low} to {high} of operation'}."
        )
    else:
        low, middle, high = (
            hours_text(float(q)) for q in np.quantile(lives, (0.05, 0.5, 0.95))
        )
        middle = f"{middle} of operation in the middle of {len(lives)} runs"
        yield f"{reached} {middle}; 90 % of them take {low} to {high}."
    if len(lives) < count:
        yield (
            f"{count - len(lives)} of {count} cases do not reach it in the time that "
            "was asked for."
        )
    if factor is not None:
        now, less, more = (
            hours_text(min(lives) * by) for by in (1.0, 1.0 / factor, factor)
        )
        were = (
            f"were that {factor:.3g} times as large or small, {now} would be {less} or "
            f"{more}"
        )
        yield (
            f"The life is inversely proportional to the wear coefficient: {were}. "
            f"{COMPARED}"
        )
    else:
        yield (
            "The wear coefficient is varied from case to case: no other range is put "
            "on these lives."
        )
    errors = [float(c.error.split()[0]) for c in cases if c.error]
    if errors:
        small = "" if max(errors) > 0.2 else ", little beside that"
        yield (
            f"The numerical error of the life is estimated at up to {max(errors):.2g} "
            f"%{small}."
        )

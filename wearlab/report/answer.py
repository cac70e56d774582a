"""The answer of a campaign in words: how long the gears last, and which flank wears."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from wearlab.campaign import Campaign, Case
from wearlab.report.conditions import (
    MAX_SHOWN_CASES,
    case_name,
    initial_wear,
    number_range,
)
from wearlab.scene import Scene
from wearlab.store import Store, catalogue, files
from wearlab.store.outcome import hours_text, unasked_end

MAX_NAMED_CASES = 4  # in a sentence
LARGE_ERROR = 0.2  # of a life [%]
Entries = Mapping[str, catalogue.Entry]
Summary = Mapping[str, Any]


class CaseAnswer(NamedTuple):
    """One case of the answer; everything in words.

    Parameters
    ----------
    case : which
    hours : to the limit, or what was worn when the run ended
    range : for wear coefficients so many times as large or small
    cycles : to the limit
    error : estimated numerical error
    times : over the first case, nothing where there is one case only
    share : of the longest life, for a bar [%]
    flank : that is worn deepest at the end
    initial_depth : wear that this flank begins with [m]
    diameter : where it is worn deepest [m], 0 where that is not known
    planet : that is worn deepest of planets that differ, 0 where they are alike
    """

    case: str
    hours: str
    range: str = ""
    cycles: str = ""
    error: str = ""
    times: str = ""
    share: float = 0.0
    flank: str = ""
    initial_depth: float = 0.0
    diameter: float = 0.0
    planet: int = 0


class Reply(NamedTuple):
    """The answer of a campaign.

    Parameters
    ----------
    sentences : first what counts most
    limit : wear that ends the lives, "" where no depth is set
    cases : that the sentences sum up
    several_flanks : whether the cases end on different flanks
    """

    sentences: tuple[str, ...]
    limit: str
    cases: tuple[CaseAnswer, ...]
    several_flanks: bool = False


class _DoneCase(NamedTuple):
    """A case whose run is there, and the numbers of that run."""

    case: Case
    summary: Summary


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
    done = list(_done_cases(campaign, entries))
    worn = [run for run in done if run.summary.get("operating_hours")]
    ended = _ended_otherwise(
        [(case_name(campaign, run.case), run.summary) for run in done]
    )
    if not worn:
        return Reply(tuple(ended), limit, ()) if ended else None

    lives = [life for run in worn if (life := _life(run.summary)) is not None]
    range_factor = None if _varies_coefficient(campaign) else factor
    listed = worn[:MAX_SHOWN_CASES]
    cases = []
    for run in listed:
        name = case_name(campaign, run.case)
        in_words = _case_answer(name, run.summary, lives, range_factor)
        cases.append(in_words._replace(**_deepest(store, run.case)))
    if len(worn) == 1:
        cases = [cases[0]._replace(times="")]

    sentences = (
        *_sentences(cases, lives, len(worn), limit, range_factor),
        *_deepest_point(cases),
        *_worn_planets(cases),
        *ended,
        *_initial_wear(cases, [run.case for run in listed]),
    )
    flanks = {case.flank for case in cases if case.share}
    shown = tuple(cases) if len(worn) <= MAX_SHOWN_CASES else ()
    return Reply(sentences, limit, shown, len(flanks) > 1)


def _done_cases(campaign: Campaign, entries: Entries) -> Iterator[_DoneCase]:
    """Yield the cases whose runs are there."""
    for case in campaign.cases:
        entry = entries.get(case.id)
        if entry is not None and entry.state == "done":
            yield _DoneCase(case, entry.summary)


def _varies_coefficient(campaign: Campaign) -> bool:
    """Whether the cases differ in their wear coefficient, and are its range."""
    first, *rest = [
        getattr(case.scene.wear, "coefficient", None) for case in campaign.cases
    ]
    return any(coefficient != first for coefficient in rest)


def gathered(pairs: Iterable[tuple[Any, Any]]) -> dict[Any, list[Any]]:
    """Return what goes with each key, in the order in which they come.

    Parameters
    ----------
    pairs : (key, value)
    """
    groups: dict[Any, list[Any]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def _limit(scene: Scene) -> str:
    """Return the wear depth that ends the life, "" where none is set."""
    until = getattr(scene.wear, "until", None)
    depth = getattr(until, "depth", None)
    if depth is None:
        return ""
    flank = getattr(until, "flank", None)
    place = f" on the {flank}" if flank else ""
    return f"{1e6 * depth:.4g} µm of wear{place}"


def _life(summary: Summary) -> float | None:
    """Return the time to the limit [s], None where it is not reached."""
    life: Any = summary.get("service_life")
    return float(life) if _is_number(life) else None


def _is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and bool(np.isfinite(value))


def _case_answer(
    name: str, summary: Summary, lives: Sequence[float], factor: float | None
) -> CaseAnswer:
    """Return a case in words, its life beside the first and the longest of all."""
    life = _life(summary)
    if life is None:
        depth = summary.get("max_wear_depth")
        worn = "" if depth is None else f"{1e6 * float(depth):.3g} µm after "
        duration = hours_text(summary.get("operating_hours"))
        return CaseAnswer(name, f"not reached: {worn}{duration}")

    cycles = summary.get("life")
    error = summary.get("error_estimate_life")
    coefficient_range = ""
    if factor is not None:
        shortest = hours_text(life / factor)
        longest = hours_text(life * factor)
        coefficient_range = f"{shortest} to {longest}"
    relative_error = ""
    if _is_number(error) and cycles:
        relative_error = f"{100 * (error / cycles):.2g} %"
    return CaseAnswer(
        case=name,
        hours=hours_text(life),
        range=coefficient_range,
        cycles=f"{cycles:.3g}" if cycles else "",
        error=relative_error,
        times=f"× {life / lives[0]:.3g}" if lives[0] else "",
        share=100.0 * life / max(lives),
    )


def _deepest(store: Store | None, case: Case) -> dict[str, Any]:
    """Return which flank of a run is worn deepest, and where, as fields of a case."""
    if store is None:
        return {}
    try:
        run = store.run(case.id)
    except (files.StoreError, OSError):
        return {}

    max_depth = run.get("max_wear_depth")
    if max_depth is None or set(max_depth.dims) != {"update", "flank"}:
        return {}
    flank = int(np.nanargmax(max_depth.isel(update=-1).values))
    initial_depth = float(max_depth.isel(update=0, flank=flank).values)
    fields: dict[str, Any] = {
        "flank": str(max_depth["flank"].values[flank]),
        "initial_depth": initial_depth if np.isfinite(initial_depth) else 0.0,
    }

    if "planet_max_wear_depth" in run:
        of_planets = run["planet_max_wear_depth"].isel(update=-1).max("flank")
        fields["planet"] = int(
            of_planets["planet"].values[np.argmax(of_planets.values)]
        )

    depth = run.get("wear_depth")
    if depth is None or "diameter" not in run:
        return fields
    if set(depth.dims) == {"update", "flank", "profile"}:
        node = int(np.nanargmax(depth.isel(update=-1, flank=flank).values))
        fields["diameter"] = float(run["diameter"].isel(flank=flank, profile=node))
    return fields


def _sentences(
    cases: Sequence[CaseAnswer],
    lives: list[float],
    count: int,
    limit: str,
    factor: float | None,
) -> Iterator[str]:
    """Yield what the lives of the cases are, their range and their error.

    ``count`` cases wear; ``lives`` are those that reach the limit [s].
    """
    if not limit:
        yield f"{count} cases ran to their end; no wear depth was set as the limit."
        return
    if not lives:
        yield f"No case reaches {limit} in the time that was asked for."
        return

    flanks = {case.flank for case in cases if case.share and case.flank}
    if len(flanks) == 1 and len(cases) == count and " on the " not in limit:
        limit = f"{limit} on the {next(iter(flanks))}"
    durations = _durations(cases, lives, count)
    yield f"{limit[0].upper()}{limit[1:]} is reached after {durations}."
    if len(lives) < count:
        yield (
            f"{count - len(lives)} of {count} cases do not reach it in the time that "
            "was asked for."
        )
    yield _range_sentence(lives, factor)
    errors = [float(case.error.split()[0]) for case in cases if case.error]
    if errors:
        remark = "" if max(errors) > LARGE_ERROR else ", little beside that"
        yield (
            f"The numerical error of the life is estimated at up to {max(errors):.2g} "
            f"%{remark}."
        )


def _durations(cases: Sequence[CaseAnswer], lives: list[float], count: int) -> str:
    """Return after how many hours the cases reach their limit."""
    if len(lives) == 1:
        return f"{hours_text(lives[0])} of operation"
    if count > MAX_SHOWN_CASES:
        low, middle, high = (
            hours_text(float(life)) for life in np.quantile(lives, (0.05, 0.5, 0.95))
        )
        return (
            f"{middle} of operation in the middle of {len(lives)} runs; 90 % of them "
            f"take {low} to {high}"
        )

    shortest = hours_text(min(lives))
    longest = hours_text(max(lives))
    if shortest == longest:
        number = "both" if len(lives) == 2 else f"all {len(lives)}"
        return f"{shortest} of operation in {number} cases"
    first = next(case.case for case in cases if case.hours == shortest)
    last = next(case.case for case in cases if case.hours == longest)
    return f"{shortest} ({first}) to {longest} ({last}) of operation"


def _range_sentence(lives: list[float], factor: float | None) -> str:
    """Return how the lives depend on the wear coefficient."""
    if factor is None:
        return (
            "The wear coefficient is varied from case to case: no other range is put "
            "on these lives."
        )
    life = hours_text(min(lives))
    shorter = hours_text(min(lives) * (1.0 / factor))
    longer = hours_text(min(lives) * factor)
    return (
        "The life is inversely proportional to the wear coefficient: were that "
        f"{factor:.3g} times as large or small, {life} would be {shorter} or "
        f"{longer}. Comparisons between cases hold all the same."
    )


def _deepest_point(cases: Sequence[CaseAnswer]) -> Iterator[str]:
    """Yield at which diameters the flanks that are worn deepest are so."""
    places = gathered(
        (case.flank, f"{1e3 * case.diameter:.2f}") for case in cases if case.diameter
    )
    for flank, diameters in places.items():
        yield f"The {flank} is worn deepest at diameter {number_range(diameters)} mm."


def _worn_planets(cases: Sequence[CaseAnswer]) -> Iterator[str]:
    """Yield which planets are worn deepest where planets differ, and in which cases."""
    names_by_planet = gathered((case.planet, case.case) for case in cases)
    for planet, names in names_by_planet.items():
        if planet:
            more = ["…"] if len(names) > MAX_NAMED_CASES else []
            named = ", ".join([*names[:MAX_NAMED_CASES], *more])
            yield f"Of the planets, which differ, planet {planet} wears most ({named})."


def _ended_otherwise(done: Sequence[tuple[str, Summary]]) -> list[str]:
    """Return which cases ended otherwise than asked, a sentence for each reason."""
    names_by_end = gathered(
        (end, name) for name, summary in done if (end := unasked_end(summary))
    )
    sentences = []
    for end, names in names_by_end.items():
        more = ["…"] if len(names) > MAX_NAMED_CASES else []
        named = ", ".join([*names[:MAX_NAMED_CASES], *more])
        sentences.append(
            f"{len(names)} of {len(done)} ended otherwise than asked ({named}): {end}."
        )
    return sentences


def _initial_wear(
    cases: Sequence[CaseAnswer], sources: Sequence[Case]
) -> Iterator[str]:
    """Yield that the wear with which a flank begins counts, and where it comes from."""
    depths: dict[tuple[str, str], list[str]] = {}
    for case, source in zip(cases, sources, strict=True):
        if case.initial_depth > 0.0:
            initial_by_flank = getattr(source.scene.wear, "initial", None)
            initial = getattr(initial_by_flank, case.flank, None)
            origin = f", {initial_wear(initial)}" if initial else ""
            depth = f"{1e6 * case.initial_depth:.3g}"
            depths.setdefault((case.flank, origin), []).append(depth)
    for (flank, origin), values in depths.items():
        amount = f"up to {number_range(values)} µm{origin}"
        yield (
            f"The wear that the {flank} begins with ({amount}) is part of these depths."
        )

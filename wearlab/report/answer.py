"""The answer of a campaign in words: hours to the limit at each case, and how uncertain they are."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wearlab.report.conditions import case_name, initial_wear
from wearlab.scene import Scene
from wearlab.store.errors import StoreError
from wearlab.store.headline import hours_text, unasked_end

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case
    from wearlab.store import Store
    from wearlab.store.catalogue import Entry

MOST_CASES = 24
"""Cases told one by one; of more, their quantiles."""
FEW = 4
"""Cases that a sentence names."""
QUANTILES = (0.05, 0.5, 0.95)
SHARE = 0.002  # of the life: numerical errors below are not worth words


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


class Reply(NamedTuple):
    """Sentences, and the cases they sum up; whether these end on different flanks."""

    sentences: tuple[str, ...]
    limit: str
    cases: tuple[CaseTold, ...]
    several_flanks: bool = False


def answer(
    campaign: "Campaign", entries: "Mapping[str, Entry]", factor: float, store: "Store | None" = None
) -> Reply | None:
    """Return the answer of a campaign whose runs wear to a limit, None of any other.

    Parameters
    ----------
    campaign : its cases
    entries : what the store knows of their runs
    factor : by which the wear coefficient may be larger or smaller; where the cases vary it, no range is told
    store : where the runs are, to say which flank is worn deepest
    """
    limit = _limit(campaign.cases[0].scene) if campaign.cases else ""
    done = [
        (case, entries[case.id].summary) for case in campaign.cases if case.id in entries
        and entries[case.id].state == "done"
    ]  # fmt: skip
    worn = [(case, summary) for case, summary in done if summary.get("operating_hours")]
    ended = _ended_otherwise([(case_name(campaign, case), summary) for case, summary in done])
    if not worn:
        return Reply(tuple(ended), limit, ()) if ended else None
    lives = {case.id: float(s["service_life"]) for case, s in worn if _is_number(s.get("service_life"))}
    longest = max(lives.values(), default=0.0)
    first = next(iter(lives.values()), None) if len(worn) > 1 else None
    range_by = None if _varies_coefficient(campaign) else factor
    cases = [
        _case(case_name(campaign, case), summary, lives.get(case.id), first, longest, range_by)._replace(
            **_deepest(store, case)
        )
        for case, summary in worn[:MOST_CASES]
    ]
    flanks = {known_case.flank for known_case in cases if known_case.share}
    sentences = list(_sentences(cases, list(lives.values()), len(worn), limit, range_by))
    sentences += ended
    sentences += _begun(cases, [case for case, _ in worn[:MOST_CASES]])
    shown = tuple(cases) if len(worn) <= MOST_CASES else ()
    return Reply(tuple(sentences), limit, shown, len(flanks) > 1)


def _ended_otherwise(done: "Sequence[tuple[str, Mapping[str, Any]]]") -> list[str]:
    """Return which cases ended otherwise than asked, those of one reason in one sentence."""
    cases: dict[str, list[str]] = {}
    for name, summary in done:
        if end := unasked_end(summary):
            cases.setdefault(end, []).append(name)
    return [
        f"{len(names)} of {len(done)} ended otherwise than asked ({', '.join(names[:FEW])}"
        f"{', …' if len(names) > FEW else ''}): {end}."
        for end, names in cases.items()
    ]


def _varies_coefficient(campaign: "Campaign") -> bool:
    """Say whether the cases differ in their wear coefficient, so that they are the range themselves."""
    wears = [case.scene.wear for case in campaign.cases]
    given = [None if wear is None else getattr(wear, "coefficient", None) for wear in wears]
    return any(known_case != given[0] for known_case in given)


def _deepest(store: "Store | None", case: "Case") -> dict[str, Any]:
    """Return the flank of a run that is worn deepest at its end, and how deep it began [m]."""
    if store is None:
        return {}
    try:
        depth = store.run(case.id).get("max_wear_depth")
    except (StoreError, OSError):
        return {}
    if depth is None or set(depth.dims) != {"update", "flank"}:
        return {}
    at = int(np.nanargmax(depth.isel(update=-1).values))
    begins = float(depth.isel(update=0, flank=at).values)
    return {"flank": str(depth["flank"].values[at]), "begins": begins if np.isfinite(begins) else 0.0}


def _begun(cases: Sequence[CaseTold], asked: "Sequence[Case]") -> Iterator[str]:
    """Yield that the wear with which a flank begins counts, and where it comes from."""
    told: dict[tuple[str, str], list[float]] = {}
    for known_case, case in zip(cases, asked, strict=True):
        if known_case.begins > 0.0:
            initial = getattr(case.scene.wear, "initial", None)
            given = None if initial is None else getattr(initial, known_case.flank, None)
            told.setdefault((known_case.flank, initial_wear(given) if given else ""), []).append(
                known_case.begins
            )
    for (flank, whence), depths in told.items():
        low, high = (f"{1e6 * depth:.3g}" for depth in (min(depths), max(depths)))
        span = f"up to {high} µm" if low == high else f"up to {low} to {high} µm"
        said = f"{span}, {whence}" if whence else span
        yield f"The wear that the {flank} begins with ({said}) is part of these depths."


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and bool(np.isfinite(value))


def _limit(scene: Scene) -> str:
    until = getattr(scene.wear, "until", None)
    depth = getattr(until, "depth", None)
    if depth is None:
        return ""
    named = getattr(until, "flank", None)
    flank = f" on the {named}" if named else ""
    return f"{1e6 * depth:.4g} µm of wear{flank}"


def _case(
    name: str,
    summary: Mapping[str, Any],
    life: float | None,
    first: float | None,
    longest: float,
    factor: float | None,
) -> CaseTold:
    if life is None:
        depth = summary.get("max_wear_depth")
        worn = f"not reached: {1e6 * float(depth):.3g} µm after " if depth is not None else "not reached: "
        return CaseTold(name, f"{worn}{hours_text(summary.get('operating_hours'))}", "", "", "", "", 0.0)
    error, cycles = summary.get("error_estimate_life"), summary.get("life")
    relative = error / cycles if _is_number(error) and cycles else None
    return CaseTold(
        name,
        hours_text(life),
        "" if factor is None else f"{hours_text(life / factor)} to {hours_text(life * factor)}",
        f"{cycles:.3g}" if cycles else "",
        "" if relative is None else f"{100 * relative:.2g} %",
        f"× {life / first:.3g}" if first else "",
        100.0 * life / longest,
    )


def _sentences(
    cases: Sequence[CaseTold], lives: list[float], count: int, limit: str, factor: float | None
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
    if len(lives) == 1:
        yield f"{limit[0].upper()}{limit[1:]} is reached after {hours_text(lives[0])} of operation."
    elif count <= MOST_CASES:
        shortest, longest = min(lives), max(lives)
        named = {
            hours: next(c.case for c in cases if c.hours == hours_text(hours))
            for hours in (shortest, longest)
        }
        yield (
            f"{limit[0].upper()}{limit[1:]} is reached after {hours_text(shortest)} ({named[shortest]}) to "
            f"{hours_text(longest)} ({named[longest]}) of operation."
        )
    else:
        low, middle, high = (hours_text(float(q)) for q in np.quantile(lives, QUANTILES))
        yield (
            f"{limit[0].upper()}{limit[1:]} is reached after {middle} of operation in the middle of "
            f"{len(lives)} runs; 90 % of them take {low} to {high}."
        )
    if len(lives) < count:
        yield f"{count - len(lives)} of {count} cases do not reach it in the time that was asked for."
    if factor is not None:
        yield (
            f"The life is inversely proportional to the wear coefficient: were that {factor:.3g} times as "
            f"large or small, {hours_text(min(lives))} would be {hours_text(min(lives) / factor)} or "
            f"{hours_text(min(lives) * factor)}. Comparisons between cases hold all the same."
        )
    else:
        yield "The wear coefficient is varied from case to case: no other range is put on these lives."
    errors = [float(c.error.split()[0]) for c in cases if c.error]
    if errors:
        small = "" if max(errors) > 100 * SHARE else ", little beside that"
        yield f"The numerical error of the life is estimated at up to {max(errors):.2g} %{small}."

"""The answer of a campaign in words: hours to the limit at each case, and how uncertain they are."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wearlab.scene import Scene
from wearlab.store.headline import hours_text
from wearlab.store.place import place

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store.catalogue import Entry

MOST_CASES = 24
"""Cases told one by one; of more, their quantiles."""
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
    error : numerical error
    times : over the first case
    share : of the longest life, for a bar [%]
    """

    case: str
    hours: str
    range: str
    cycles: str
    error: str
    times: str
    share: float


class Reply(NamedTuple):
    """Sentences, and the cases they sum up."""

    sentences: tuple[str, ...]
    limit: str
    cases: tuple[CaseTold, ...]


def answer(campaign: "Campaign", entries: "Mapping[str, Entry]", factor: float) -> Reply | None:
    """Return the answer of a campaign whose runs wear to a limit, None of any other.

    Parameters
    ----------
    campaign : its cases
    entries : what the store knows of their runs
    factor : by which the wear coefficient may be larger or smaller
    """
    limit = _limit(campaign.cases[0].scene) if campaign.cases else ""
    done = [
        (case, entries[case.id].summary) for case in campaign.cases if case.id in entries
        and entries[case.id].state == "done"
    ]  # fmt: skip
    worn = [(case, summary) for case, summary in done if summary.get("operating_hours")]
    if not worn:
        return None
    lives = {case.id: float(s["service_life"]) for case, s in worn if _is_number(s.get("service_life"))}
    longest = max(lives.values(), default=0.0)
    first = next(iter(lives.values()), None)
    cases = [
        _case(_name(campaign, case), summary, lives.get(case.id), first, longest, factor)
        for case, summary in worn[:MOST_CASES]
    ]
    sentences = list(_sentences(cases, list(lives.values()), len(worn), limit, factor))
    return Reply(tuple(sentences), limit, tuple(cases) if len(worn) <= MOST_CASES else ())


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


def _name(campaign: "Campaign", case: Any) -> str:
    where = place(campaign, case)
    along = [f"{name.replace('_', ' ')} {text}".replace("*", "·") for name, text in where.items()]
    return ", ".join([*([case.label] if case.label != "base" or not along else []), *along])


def _case(
    name: str,
    summary: Mapping[str, Any],
    life: float | None,
    first: float | None,
    longest: float,
    factor: float,
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
        f"{hours_text(life / factor)} to {hours_text(life * factor)}",
        f"{cycles:.3g}" if cycles else "",
        "" if relative is None else f"{100 * relative:.2g} %",
        f"× {life / first:.3g}" if first else "",
        100.0 * life / longest,
    )


def _sentences(cases: Sequence[CaseTold], lives: list[float], count: int, limit: str, factor: float) -> Any:
    if not limit:
        yield f"{count} cases ran to their end; no wear depth was set as the limit."
        return
    if not lives:
        yield f"No case reaches {limit} in the time that was asked for."
        return
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
    yield (
        f"The life is inversely proportional to the wear coefficient: were that {factor:.3g} times as large "
        f"or small, {hours_text(min(lives))} would be {hours_text(min(lives) / factor)} or "
        f"{hours_text(min(lives) * factor)}. Comparisons between cases hold all the same."
    )
    errors = [float(c.error.split()[0]) for c in cases if c.error]
    if errors and max(errors) > 100 * SHARE:
        yield f"The computation itself is off by up to {max(errors):.2g} %."
    elif errors:
        yield f"The computation itself is off by {max(errors):.2g} % at most: little beside that."

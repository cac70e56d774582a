"""``plan``: what would be done with a campaign, before it is done."""

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING

from wearlab.cli.output import REFUSALS, Status, complain, load_campaign, refusing, say, show_json
from wearlab.units import HOUR, MINUTE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from wearlab.campaign import Campaign
    from wearlab.runner.plan import Amount, Plan
    from wearlab.store import Store

SHOWN = 6
UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


def plan_campaign(file: str, store: "Store", workers: int | None, retry: bool, as_json: bool) -> Status:
    """Show what ``run`` would compute, how long it takes and how much it writes."""
    from wearlab.runner.plan import plan

    campaign = load_campaign(file)
    with refusing(*REFUSALS):
        found = plan(campaign, store, workers=workers, retry=retry)
    if as_json:
        content = asdict(found) | {"runs": [run._asdict() for run in found.runs]}
        show_json(content | {name: amount and amount._asdict() for name, amount in _amounts(found)})
    else:
        _tell(found)
        if campaign.update is not None:
            _tell_update(campaign, store, workers)
    for warning in found.warnings:
        complain(f"warning: {warning}")
    return Status.TROUBLE if found.warnings else Status.WELL


def _tell_update(campaign: "Campaign", store: "Store", workers: int | None) -> None:
    from wearlab.cli.updating import tell_plan
    from wearlab.updating import UpdateError

    with refusing(*REFUSALS, UpdateError):
        tell_plan(campaign, store, workers)


def _amounts(found: "Plan") -> "list[tuple[str, Amount | None]]":
    return [("seconds", found.seconds), ("bytes", found.bytes)]


def _tell(found: "Plan") -> None:
    from wearlab.runner.plan import WORDS

    say(found.title)
    say(f"  {found.cases} cases, {len(found.runs)} distinct runs, {len(found.excluded)} excluded")
    for state, words in WORDS.items():
        if count := found.count(state):
            say(f"  {count:>7} {words}")
    if other := sum(run.other_code for run in found.runs):
        say(f"  {other:>7} of the cached made by other code")
    for keys, count in Counter(run.changed for run in found.runs if run.changed).items():
        say(f"  {count:>7} of the new were run before with another {_some(keys)}")
    for condition, count in Counter(condition for condition, _ in found.excluded).items():
        say(f"  {count:>7} excluded by {condition}")
    for run in found.runs:
        if run.state in ("failed", "refused", "lost"):
            where = ", ".join(f"{name}={value}" for name, value in run.position.items())
            say(f"  {run.state}: {run.label}{f' ({where})' if where else ''}")
    if found.seconds is None and found.basis:
        say(f"  {found.basis}")
        return
    if found.seconds is None or found.bytes is None:
        to_do = any(run.state in ("new", "lost") for run in found.runs)
        say("  time and size unknown: no recorded runs to tell from" if to_do else "  nothing to do")
        return
    about, least, most = (_time(value / found.workers) for value in found.seconds)
    workers = "one worker" if found.workers == 1 else f"{found.workers} workers"
    say(f"  time: about {about} with {workers} ({least} to {most})")
    low, high = _size(found.bytes.low), _size(found.bytes.high)
    say(f"  disk: about {_size(found.bytes.value)} ({low} to {high}), {_size(found.free)} free")
    say(f"  from {found.basis}")


def _some(keys: "Sequence[str]") -> str:
    more = f" and {len(keys) - SHOWN} more" if len(keys) > SHOWN else ""
    return ", ".join(keys[:SHOWN]) + more


def _time(seconds: float) -> str:
    if seconds >= HOUR:
        return f"{seconds / HOUR:.3g} h"
    return f"{seconds / MINUTE:.3g} min" if seconds >= MINUTE else f"{seconds:.2g} s"


def _size(count: float) -> str:
    scale, unit = next(((scale, unit) for scale, unit in UNITS if count >= scale), (1.0, "bytes"))
    return f"{count / scale:.3g} {unit}"

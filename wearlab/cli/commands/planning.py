"""What would be done with a campaign, before it is done."""

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder, Workers
from wearlab.cli.output import REFUSALS, Status, complain, read_campaign, refusing, say, show_json
from wearlab.cli.registry import app
from wearlab.store import Store
from wearlab.units import HOUR, MINUTE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from wearlab.campaign import Campaign
    from wearlab.runner.plan import Amount, Plan

SHOWN = 6
UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


@app.command()
def plan(
    file: File,
    folder: StoreFolder = STORE,
    workers: Workers = None,
    retry: Annotated[bool, typer.Option("--retry", help="Count failed and refused cases too.")] = False,
    json: Json = False,
) -> Status:
    """Show what run would do with FILE: new, cached, excluded, failed before; time and disk space."""
    from wearlab.runner.plan import plan as planned_of

    store = Store(folder)
    campaign = read_campaign(file)
    with refusing(*REFUSALS):
        planned = planned_of(campaign, store, workers=workers, retry=retry)
    if json:
        content = asdict(planned) | {"runs": [run._asdict() for run in planned.runs]}
        show_json(content | {name: amount and amount._asdict() for name, amount in _amounts(planned)})
    else:
        _tell(planned)
        if campaign.update is not None:
            _tell_update(campaign, store, workers)
    for warning in planned.warnings:
        complain(f"warning: {warning}")
    return Status.TROUBLE if planned.warnings else Status.WELL


def _tell_update(campaign: "Campaign", store: "Store", workers: int | None) -> None:
    from wearlab.cli.updates import tell_plan
    from wearlab.updating import UpdateError

    with refusing(*REFUSALS, UpdateError):
        tell_plan(campaign, store, workers)


def _amounts(planned: "Plan") -> "list[tuple[str, Amount | None]]":
    return [("seconds", planned.seconds), ("bytes", planned.bytes)]


def _tell(planned: "Plan") -> None:
    from wearlab.runner.plan import WORDS

    say(planned.title)
    say(f"  {planned.cases} cases, {len(planned.runs)} distinct runs, {len(planned.excluded)} excluded")
    for state, words in WORDS.items():
        if count := planned.count(state):
            say(f"  {count:>7} {words}")
    if other := sum(run.other_code for run in planned.runs):
        say(f"  {other:>7} of the cached made by other code")
    for keys, count in Counter(run.changed for run in planned.runs if run.changed).items():
        say(f"  {count:>7} of the new were run before with another {_some(keys)}")
    for condition, count in Counter(condition for condition, _ in planned.excluded).items():
        say(f"  {count:>7} excluded by {condition}")
    for run in planned.runs:
        if run.state in ("failed", "refused", "lost"):
            where = ", ".join(f"{name}={value}" for name, value in run.position.items())
            say(f"  {run.state}: {run.label}{f' ({where})' if where else ''}")
    if planned.seconds is None and planned.basis:
        say(f"  {planned.basis}")
        return
    if planned.seconds is None or planned.bytes is None:
        to_do = any(run.state in ("new", "lost") for run in planned.runs)
        say("  time and size unknown: no recorded runs to tell from" if to_do else "  nothing to do")
        return
    about, least, most = (_time(value / planned.workers) for value in planned.seconds)
    workers = "one worker" if planned.workers == 1 else f"{planned.workers} workers"
    say(f"  time: about {about} with {workers} ({least} to {most})")
    low, high = _size(planned.bytes.low), _size(planned.bytes.high)
    say(f"  disk: about {_size(planned.bytes.value)} ({low} to {high}), {_size(planned.free)} free")
    say(f"  from {planned.basis}")


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

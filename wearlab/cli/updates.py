"""Kept updates: what measurements said, in words or as JSON."""

from typing import TYPE_CHECKING, Any

from wearlab.cli.output import (
    REFUSALS,
    Status,
    complain,
    refusing,
    say,
    show_json,
    show_table,
)
from wearlab.runner.plan import WORDS
from wearlab.schema import VARIABLES
from wearlab.units import convert

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Campaign
    from wearlab.store import Store
    from wearlab.store.updates import KeptUpdate

REMAINING = ("remaining_5", "remaining_50", "remaining_95")


def list_updates(store: "Store", as_json: bool) -> Status:
    """List the updates of a store, a line a case, the latest last."""
    from wearlab.store.updates import kept_updates

    with refusing(*REFUSALS):
        kept = kept_updates(store).values()
    if as_json:
        show_json([each_update._asdict() for each_update in kept])
    elif kept:
        rows = [
            (
                each_update.id[:10],
                each_update.title,
                case,
                *_told(summary),
                str(len(each_update.runs)),
                each_update.recorded[:19],
            )
            for each_update in kept
            for case, summary in each_update.summary.items()
        ]
        heads = ("id", "campaign", "case", "last inspection", "remaining life", "90 %", "runs", "recorded")
        show_table(heads, rows)
    else:
        complain("no updates: wearlab update FILE makes one")
    return Status.WELL


def _told(summary: dict[str, float]) -> tuple[str, str, str]:
    """Return the last inspection, the remaining life and its interval, in cycles."""
    now, low, middle, high = (summary[key] for key in ("now", *REMAINING))
    return f"{now:.4g}", f"{middle:.4g}", f"{low:.4g} to {high:.4g}"


def show_update(store: "Store", update: "KeptUpdate", as_json: bool) -> Status:
    """Show a kept update: what it says, and what it was made from."""
    from wearlab.store.updates import read_update, update_files
    from wearlab.updating.summary import told

    with refusing(*REFUSALS):
        tree = read_update(store, update.id)
    if tree is None:
        complain(f"update {update.id}: its file has gone; wearlab update makes it anew")
        return Status.TROUBLE
    if as_json:
        show_json(content(tree) | {"runs": update.runs, "sha256": update.sha256, "recorded": update.recorded})
        return Status.WELL
    for line in told(tree):
        say(line)
    facts = {"id": update.id, "file": str(update_files(store).path(update.id)), "sha256": update.sha256}
    facts |= {"recorded": update.recorded, "runs": ", ".join(run[:10] for run in update.runs[:6])}
    if len(update.runs) > 6:
        facts["runs"] += f" and {len(update.runs) - 6} more"
    say()
    for name, value in facts.items():
        say(f"{name:<16}{value}")
    for name, node in tree.children.items():
        say(f"{name:<22}{', '.join(map(str, node.to_dataset().data_vars))}")
    return Status.WELL


def tell_update(campaign: "Campaign") -> None:
    """Say what a campaign's [update] has to go by; nothing without one.

    Raises
    ------
    UpdateError : its data cannot be read, or it cannot be updated
    """
    from wearlab.updating.study import studies

    if campaign.update is None:
        return
    for study in studies(campaign):
        say(f"\nupdate of {study.label}")
        for key, prior in study.spec.unknown.items():
            cost = "" if key not in study.costly else f", {study.spec.draws} runs"
            before = f"{prior.at(0.05):.4g} to {prior.at(0.95):.4g} {prior.unit or ''}"
            say(f"  unknown: {key}, before {before}{cost}")
        for seen in study.seen:
            words = seen.data.label.replace("_", " ")
            say(f"  measured: {len(seen)} values of {words} in {seen.data.file.name}")
        where = "" if study.limit.where is None else f" of the {study.limit.where}"
        unit = VARIABLES[study.limit.quantity]
        level = convert(study.limit.value, unit.units, unit.display_units)
        say(f"  limit: {unit.long_name}{where}, {level:.4g} {unit.display_units}")


def tell_plan(campaign: "Campaign", store: "Store", workers: int | None) -> None:
    """Say which runs `wearlab update` would need, and whether its answer is there already."""
    from wearlab.runner.plan import plan
    from wearlab.updating.inference import kept
    from wearlab.updating.study import studies

    if campaign.update is None:
        return
    wanted = studies(campaign)
    if store.path.exists() and kept(wanted, store, replay=False, check=0) is not None:
        say("\nwearlab update: made before, it would be read")
        return
    say("\nwearlab update needs")
    for study in wanted:
        planned = plan(study.campaign(campaign.title), store, workers=workers)
        states = ", ".join(f"{planned.count(s)} {w}" for s, w in WORDS.items() if planned.count(s))
        time = "" if planned.seconds is None else f", about {planned.seconds.value / planned.workers:.2g} s"
        say(f"  {study.label}: {len(planned.runs)} runs, {states}{time}")
    say("  and as many longer ones where the measurements lie beyond them")


def content(tree: "xr.DataTree") -> dict[str, Any]:
    """Return what `--json` tells of an update."""
    from wearlab.store.description import plain

    names = ("predictions", "sample_stats", "calibration")
    content: dict[str, Any] = {"id": tree.attrs["id"], "title": tree.attrs["title"]}
    for name in names:
        if name in tree.children:
            data = tree[name].to_dataset()
            content[name] = {str(key): plain(value.values) for key, value in data.variables.items()}
    return content

"""``run`` and ``update``: simulate what is missing.

Narrow what is unknown by measurements.
"""

from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output
from wearlab.cli.commands import plan as before
from wearlab.store import Store

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Campaign
    from wearlab.runner import Report
    from wearlab.store import updates


@app.command()
def run(
    file: str,
    store: Store,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    recompute: str | None = None,
    dashboard: bool = False,
) -> output.Findings:
    """Compute what is missing of FILE.

    Parameters
    ----------
    scheduler : ADDRESS: A dask scheduler to use, tcp://host:port.
    retry : Compute failed and refused cases again.
    recompute : WHAT: Compute again: failed, stale (made by other code) or all.
    dashboard : Let the workers show dask's page about themselves.
    """
    from wearlab.runner import Interrupted, foresee
    from wearlab.runner import run as computed

    output.at_once_when_twice()
    campaign = output.read_campaign(file)
    foresee(campaign, store, scheduler)
    output.refuse_wrong_figures(campaign, file)
    before.refuse_the_impossible(campaign)
    asked: Any = {
        "workers": workers,
        "scheduler": scheduler,
        "retry": retry,
        "recompute": recompute,
    }
    try:
        report = computed(
            campaign,
            store,
            **asked,
            progress=not output.AS_JSON.get(),
            dashboard=dashboard,
        )
    except Interrupted as interrupted:
        raise output.Stop(str(interrupted), output.Status.INTERRUPTED) from None
    return output.Findings(report.to_dict, _text(campaign, report), report.ok)


def _text(campaign: "Campaign", report: "Report") -> output.Text:
    for note in report.notes:
        output.complain(note)
    for warning in campaign.warnings:
        output.complain(f"warning: {warning}")
    yield report.headline
    names: dict[str, str] = {
        case.id: output.case_name(campaign, case) for case in reversed(campaign.cases)
    }
    foreseen = {case.id for case in report.expected if case.comparison.met}
    for case in report.troubled:
        if case.state != "done" and case.id not in foreseen:
            output.complain(
                f"{case.state}: {names[case.id]}, run {output.short(case.id)}: "
                f"{case.headline}"
            )
        for warning in case.warnings:
            output.complain(
                f"warning: {names[case.id]}, run {output.short(case.id)}: {warning}"
            )
    if report.expected:
        rows = []
        for expected in report.expected:
            *said, met = (
                expected.label,
                output.place(expected.position),
                *expected.comparison,
            )
            rows.append((*said, "yes" if met else "NO"))
        heads = ("case", "differs by", "verdict", "expected", "measured", "met")
        yield from ("", output.ShownTable(heads, rows))
        yield (
            f"{sum(one.comparison.met for one in report.expected)} of {len(rows)} as "
            "expected"
        )


REMAINING = ("remaining_5", "remaining_50", "remaining_95")


def list_updates(store: Store) -> output.Findings:
    """Return the updates of a store, a line a case, the latest last."""
    from wearlab.store import updates

    kept = updates.kept_updates(store).values()
    rows = []
    for one in kept:
        for case, summary in one.summary.items():
            now, low, middle, high = (
                f"{summary[key]:.4g}" for key in ("now", *REMAINING)
            )
            cycles = (now, middle, f"{low} to {high}")
            rows.append(
                (
                    one.id[:10],
                    one.title,
                    case,
                    *cycles,
                    str(len(one.runs)),
                    one.recorded[:19],
                )
            )
    heads = (
        "id",
        "campaign",
        "case",
        "last inspection",
        "remaining life",
        "90 %",
        "runs",
        "recorded",
    )
    table = output.ShownTable(
        heads, rows, empty="no updates: wearlab update FILE makes one"
    )
    return output.Findings([one._asdict() for one in kept], [table])


def show_update(store: Store, update: "updates.KeptUpdate") -> output.Findings:
    """Return what a kept update says, and what it was made from."""
    from wearlab.store import updates
    from wearlab.updating import report_text

    tree = updates.read_update(store, update.id)
    if tree is None:
        said = f"update {update.id}: its file has gone; wearlab update makes it anew"
        raise output.Stop(said, output.Status.TROUBLE)
    made = {"runs": update.runs, "sha256": update.sha256, "recorded": update.recorded}
    more = f" and {len(update.runs) - 6} more" if len(update.runs) > 6 else ""
    facts = {"id": update.id, "file": str(updates.update_files(store).path(update.id))}
    facts |= {"sha256": update.sha256, "recorded": update.recorded}
    facts |= {"runs": ", ".join(run[:10] for run in update.runs[:6]) + more}
    groups = {
        name: ", ".join(map(str, node.to_dataset().data_vars))
        for name, node in tree.children.items()
    }
    lines = [f"{name:<16}{text}" for name, text in facts.items()]
    lines += [f"{name:<22}{text}" for name, text in groups.items()]
    return output.Findings(
        content(tree) | made, [*report_text.text_of(tree), "", *lines]
    )


def content(tree: "xr.DataTree") -> dict[str, Any]:
    """Return what `--json` tells of an update."""
    from wearlab.store import description

    groups = {
        name: {
            str(key): description.plain(v.values)
            for key, v in tree[name].to_dataset().variables.items()
        }
        for name in ("predictions", "sample_stats", "calibration")
        if name in tree.children
    }
    return {"id": tree.attrs["id"], "title": tree.attrs["title"], **groups}


@app.command()
def update(
    file: str,
    store: Store,
    replay: bool = False,
    check: int = 0,
    workers: int | None = None,
) -> output.Findings:
    """Infer wear coefficient and remaining life from FILE's measurements, with intervals.

    Parameters
    ----------
    replay : Answer as it would have been after every inspection too.
    check : N from 0: Put N synthetic twins through the same code.
    """
    from wearlab.updating import report_text
    from wearlab.updating import update as updated

    campaign = output.read_campaign(file)
    shown = not output.AS_JSON.get()
    tree = updated(
        campaign, store, replay=replay, check=check, progress=shown, workers=workers
    )
    kept = f"\nkept as update {str(tree.attrs['id'])[:10]}"
    return output.Findings(content(tree), [*report_text.text_of(tree), kept])

"""``run`` and ``update``: simulate what is missing, and infer from measurements."""

from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output
from wearlab.cli.commands import plan
from wearlab.store import Store, files

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Campaign
    from wearlab.runner import Report
    from wearlab.store import updates

REMAINING = ("remaining_5", "remaining_50", "remaining_95")
MAX_RUNS = 6  # of an update that are listed


@app.command()
def run(
    file: options.CampaignFile,
    store: options.StoreFolder = options.DEFAULT_STORE,
    workers: options.Workers = None,
    scheduler: Annotated[
        str | None,
        options.option(
            "--scheduler", "A dask scheduler to use, tcp://host:port.", "ADDRESS"
        ),
    ] = None,
    retry: Annotated[
        bool, options.option("--retry", "Compute failed and refused cases again.")
    ] = False,
    recompute: Annotated[
        str | None,
        options.option(
            "--recompute",
            "Compute again: failed, stale (made by other code) or all.",
            "WHAT",
        ),
    ] = None,
    dashboard: Annotated[
        bool,
        options.option(
            "--dashboard", "Let the workers show dask's page about themselves."
        ),
    ] = False,
) -> output.Findings:
    """Compute what is missing of FILE."""
    from wearlab.runner import Interrupted, foresee
    from wearlab.runner import run as run_campaign

    output.stop_on_second_interrupt()
    campaign = output.read_campaign(file)
    foresee(campaign, store, scheduler)
    output.refuse_wrong_figures(campaign, file)
    plan.refuse_the_impossible(campaign)
    try:
        report = run_campaign(
            campaign,
            store,
            workers=workers,
            scheduler=scheduler,
            retry=retry,
            recompute=recompute,
            progress=not output.AS_JSON.get(),
            dashboard=dashboard,
        )
    except Interrupted as interrupted:
        raise output.Stop(str(interrupted), output.Status.INTERRUPTED) from None
    return output.Findings(report.to_dict, _report_text(campaign, report), report.ok)


def _report_text(campaign: "Campaign", report: "Report") -> output.Text:
    """Yield what runs came to; what went wrong goes to standard error."""
    for note in report.notes:
        output.complain(note)
    for warning in campaign.warnings:
        output.complain(f"warning: {warning}")
    yield report.headline

    _complain_of_troubled(campaign, report)
    if report.expected:
        yield from _expected_table(report)


def _complain_of_troubled(campaign: "Campaign", report: "Report") -> None:
    """Write to standard error which runs failed, and what warns of others."""
    # of equal scenes the first case names the run
    names = {
        case.id: output.case_name(campaign, case) for case in reversed(campaign.cases)
    }
    expected = {case.id for case in report.expected if case.comparison.met}
    for case in report.troubled:
        name = f"{names[case.id]}, run {output.short(case.id)}"
        if case.state != "done" and case.id not in expected:
            output.complain(f"{case.state}: {name}: {case.headline}")
        for warning in case.warnings:
            output.complain(f"warning: {name}: {warning}")


def _expected_table(report: "Report") -> Iterator[str | output.ShownTable]:
    """Yield what the file expects of its cases beside what came out."""
    rows = []
    for case in report.expected:
        *columns, met = case.comparison
        verdict = "yes" if met else "NO"
        rows.append((case.label, output.place(case.position), *columns, verdict))
    heads = ("case", "differs by", "verdict", "expected", "measured", "met")
    yield ""
    yield output.ShownTable(heads, rows)
    count = sum(case.comparison.met for case in report.expected)
    yield f"{count} of {len(rows)} as expected"


def list_updates(store: Store) -> output.Findings:
    """Return the updates of a store, a line a case, the latest last.

    Parameters
    ----------
    store : the folder of runs and updates
    """
    from wearlab.store import updates

    stored = updates.kept_updates(store).values()
    rows = []
    for update in stored:
        for case, summary in update.summary.items():
            inspected = f"{summary['now']:.4g}"
            low, middle, high = (f"{summary[key]:.4g}" for key in REMAINING)
            first, day, last = summary.get("days", ("", "", ""))
            between = f"{first} to {last}" if day else ""
            rows.append(
                (
                    update.id[:10],
                    update.title,
                    case,
                    inspected,
                    middle,
                    f"{low} to {high}",
                    day,
                    between,
                    str(len(update.runs)),
                    update.recorded[:19],
                )
            )
    heads = (
        "id",
        "campaign",
        "case",
        "last inspection",
        "remaining life",
        "90 %",
        "limit reached",
        "90 % between",
        "runs",
        "recorded",
    )
    empty = "no updates: wearlab update FILE makes one"
    table = output.ShownTable(heads, rows, empty=empty)
    return output.Findings([update._asdict() for update in stored], [table])


def show_update(store: Store, update: "updates.KeptUpdate") -> output.Findings:
    """Return what a stored update says, and what it was made from.

    Parameters
    ----------
    store : the folder of runs and updates
    update : its entry
    """
    from wearlab.store import updates
    from wearlab.updating import report_text

    tree = updates.read_update(store, update.id)
    if tree is None:
        raise output.Stop(
            f"update {update.id}: its file has gone; wearlab update makes it anew",
            output.Status.TROUBLE,
        )

    origin = {"runs": update.runs, "sha256": update.sha256, "recorded": update.recorded}
    further = len(update.runs) - MAX_RUNS
    runs = ", ".join(run[:10] for run in update.runs[:MAX_RUNS])
    facts = {
        "id": update.id,
        "file": str(updates.update_files(store).path(update.id)),
        "sha256": update.sha256,
        "recorded": update.recorded,
        "runs": f"{runs} and {further} more" if further > 0 else runs,
    }
    with updates.understanding(update.id):
        told = report_text.text_of(tree)
        content = update_content(tree)
    groups = {
        name: ", ".join(map(str, node.to_dataset().data_vars))
        for name, node in tree.children.items()
    }
    lines = [f"{name:<16}{text}" for name, text in facts.items()]
    lines += [f"{name:<22}{text}" for name, text in groups.items()]
    return output.Findings(content | origin, [*told, "", *lines])


def update_content(tree: "xr.DataTree") -> dict[str, Any]:
    """Return an update as JSON has it.

    Parameters
    ----------
    tree : the update as it is stored
    """
    from wearlab.store import description

    content: dict[str, Any] = {"id": tree.attrs["id"], "title": tree.attrs["title"]}
    for name in ("predictions", "sample_stats", "calibration"):
        if name in tree.children:
            variables = tree[name].to_dataset().variables
            content[name] = {
                str(key): description.plain(variable.values)
                for key, variable in variables.items()
            }
    return content


def _day(written: str | None) -> date | None:
    """Return a day that a command gives as ISO 8601."""
    if written is None:
        return None
    try:
        return date.fromisoformat(written)
    except ValueError:
        raise output.Stop(
            f"--today: {written!r} is no day: write it as 2026-06-30"
        ) from None


@app.command(
    help="Infer wear coefficient and remaining life from FILE's measurements, with "
    "intervals."
)
def update(
    file: options.CampaignFile,
    store: options.StoreFolder = options.DEFAULT_STORE,
    replay: Annotated[
        bool,
        options.option(
            "--replay",
            "Answer as it would have been after every inspection too.",
        ),
    ] = False,
    check: Annotated[
        int,
        options.option(
            "--check", "Put N synthetic twins through the same code.", "N", min=0
        ),
    ] = 0,
    today: Annotated[
        str | None,
        options.option(
            "--today",
            "The day from which what is overdue is judged.",
            "DATE",
            show_default="update.today, else that of this machine",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        options.option(
            "--out",
            "Write the days of each unit: a table (.xlsx, .csv) or a calendar (.ics).",
            "FILE",
        ),
    ] = None,
    workers: options.Workers = None,
) -> output.Findings:
    """Infer wear coefficient and remaining life from measurements."""
    from wearlab.report import dates_file
    from wearlab.updating import cases, report_text
    from wearlab.updating import update as infer

    if out is not None:
        dates_file.refuse_format(out)
    campaign = output.read_campaign(file)
    if out is not None:
        is_dated = cases.studies(campaign)[0].spec.today is not None
        dates_file.refuse_format(out, has_days=is_dated)
    with output.watched("inspections" if replay else "twins"):
        tree = infer(
            campaign,
            store,
            replay=replay,
            check=check,
            today=_day(today),
            progress=not output.AS_JSON.get(),
            workers=workers,
        )
    stored = f"\nkept as update {str(tree.attrs['id'])[:10]}"
    if out is not None:
        with files.written(out):
            files.write_whole(out, dates_file.content_of(tree, out))
        stored += f"\n{out}"
    return output.Findings(update_content(tree), [*report_text.text_of(tree), stored])

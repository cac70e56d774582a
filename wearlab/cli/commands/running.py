"""Making a campaign so."""

from typing import TYPE_CHECKING, Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder, Workers
from wearlab.cli.output import (
    REFUSALS,
    Status,
    Stop,
    complain,
    read_campaign,
    refusing,
    say,
    show_json,
    show_table,
)
from wearlab.cli.registry import app
from wearlab.cli.sound import case_name, refuse_the_impossible, refuse_wrong_figures
from wearlab.sources import SHORT_ID
from wearlab.store import Store

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.runner import Report


@app.command()
def run(
    file: File,
    folder: StoreFolder = STORE,
    workers: Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A dask scheduler to use, tcp://host:port.")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Compute failed and refused cases again.")] = False,
    recompute: Annotated[
        str | None,
        typer.Option(metavar="WHAT", help="Compute again: failed, stale (made by other code) or all."),
    ] = None,
    dashboard: Annotated[
        bool, typer.Option("--dashboard", help="Let the workers show dask's page about themselves.")
    ] = False,
    json: Json = False,
) -> Status:
    """Compute what is missing of FILE."""
    from wearlab.cli.interrupting import at_once_when_twice
    from wearlab.plugins import PluginError
    from wearlab.runner import Interrupted, RunnerError, foresee
    from wearlab.runner import run as computed

    at_once_when_twice()
    store, campaign = Store(folder), read_campaign(file)
    with refusing(*REFUSALS):
        foresee(campaign, store, scheduler)
    refuse_wrong_figures(campaign, file)
    refuse_the_impossible(campaign)
    try:
        with refusing(*REFUSALS, RunnerError, PluginError):
            report = computed(
                campaign,
                store,
                workers=workers,
                scheduler=scheduler,
                retry=retry,
                recompute=recompute,
                progress=not json,
                dashboard=dashboard,
            )
    except Interrupted as interrupted:
        raise Stop(str(interrupted), Status.INTERRUPTED) from None
    if json:
        show_json(report.to_dict())
    else:
        _tell(campaign, report)
    return Status.WELL if report.ok else Status.TROUBLE


def _tell(campaign: "Campaign", report: "Report") -> None:
    for note in report.notes:
        complain(note)
    for warning in campaign.warnings:
        complain(f"warning: {warning}")
    say(report.headline)
    names: dict[str, str] = {case.id: case_name(campaign, case) for case in reversed(campaign.cases)}
    foreseen = {case.id for case in report.expected if case.comparison.met}
    for case in report.troubled:
        if case.state != "done" and case.id not in foreseen:
            complain(f"{case.state}: {names[case.id]}, run {case.id[:SHORT_ID]}: {case.headline}")
        for warning in case.warnings:
            complain(f"warning: {names[case.id]}, run {case.id[:SHORT_ID]}: {warning}")
    _tell_expected(report)


def _tell_expected(report: "Report") -> None:
    """Show case → verdict → expected → measured, where the campaign expects something."""
    if not report.expected:
        return
    rows = []
    for case in report.expected:
        place_words = ", ".join(f"{name}={value}" for name, value in case.position.items())
        verdict, expected, measured, met = case.comparison
        rows.append((case.label, place_words, verdict, expected, measured, "yes" if met else "NO"))
    say()
    show_table(("case", "differs by", "verdict", "expected", "measured", "met"), rows)
    missed = sum(not case.comparison.met for case in report.expected)
    say(f"{len(rows) - missed} of {len(rows)} as expected")

"""What a campaign file asks for, and making it so."""

from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder, Workers
from wearlab.cli.output import Status
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def check(file: File, json: Json = False) -> Status:
    """Show what FILE asks for: parts present and left out, cases, and which of them cannot be."""
    from wearlab.cli.working import check_campaign

    return check_campaign(file, json)


@app.command()
def plan(
    file: File,
    store: StoreFolder = STORE,
    workers: Workers = None,
    retry: Annotated[bool, typer.Option("--retry", help="Count failed and refused cases too.")] = False,
    json: Json = False,
) -> Status:
    """Show what run would do with FILE: new, cached, excluded, failed before; time and disk space."""
    from wearlab.cli.planning import plan_campaign

    return plan_campaign(file, Store(store), workers, retry, json)


@app.command()
def run(
    file: File,
    store: StoreFolder = STORE,
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
    from wearlab.cli.working import run_campaign

    at_once_when_twice()
    return run_campaign(file, Store(store), json, workers, scheduler, retry, recompute, dashboard)

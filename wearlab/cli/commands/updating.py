"""From measurements to a remaining life."""

from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder, Workers
from wearlab.cli.output import Status
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def update(
    file: File,
    store: StoreFolder = STORE,
    replay: Annotated[
        bool, typer.Option("--replay", help="Answer as it would have been after every inspection too.")
    ] = False,
    check: Annotated[
        int, typer.Option("--check", metavar="N", min=0, help="Put N synthetic twins through the same code.")
    ] = 0,
    workers: Workers = None,
    json: Json = False,
) -> Status:
    """Infer wear coefficient and remaining life from FILE's measurements, with intervals."""
    from wearlab.cli.updating import update_campaign

    return update_campaign(file, Store(store), replay, check, workers, json)

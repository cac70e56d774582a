"""Pages about campaigns."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder
from wearlab.cli.output import Status
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def report(
    file: File,
    store: StoreFolder = STORE,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page.", show_default="FILE's name, .html")
    ] = None,
    json: Json = False,
) -> Status:
    """Write one self-contained HTML page about FILE and its stored runs."""
    from wearlab.cli.reporting import write_report

    return write_report(file, Store(store), out, json)

"""A campaign as one page."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder
from wearlab.cli.output import REFUSALS, Status, read_campaign, refusing, say, show_json
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def report(
    file: File,
    folder: StoreFolder = STORE,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page.", show_default="FILE's name, .html")
    ] = None,
    json: Json = False,
) -> Status:
    """Write one self-contained HTML page about FILE and its stored runs."""
    from wearlab.report.page import report as page_of
    from wearlab.store.files import write_whole

    store, campaign = Store(folder), read_campaign(file)
    path = out or Path(f"{Path(file).stem}.html")
    with refusing(*REFUSALS, OSError):
        write_whole(path, page_of(campaign, store).encode())
    if json:
        show_json({"file": str(path)})
    else:
        say(str(path))
    return Status.WELL

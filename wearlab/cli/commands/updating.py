"""From measurements to a remaining life."""

from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, StoreFolder, Workers
from wearlab.cli.output import REFUSALS, Status, read_campaign, refusing, say, show_json
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def update(
    file: File,
    folder: StoreFolder = STORE,
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
    from wearlab.cli.updates import content
    from wearlab.updating import UpdateError
    from wearlab.updating import update as updated
    from wearlab.updating.summary import told

    store, campaign = Store(folder), read_campaign(file)
    with refusing(*REFUSALS, UpdateError):
        tree = updated(campaign, store, replay=replay, check=check, progress=not json, workers=workers)
    if json:
        show_json(content(tree))
    else:
        for line in told(tree):
            say(line)
        say(f"\nkept as update {str(tree.attrs['id'])[:10]}")
    return Status.WELL

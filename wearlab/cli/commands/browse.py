"""``browse``: a window on a store, in a browser."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli import output, registry
from wearlab.store import open_store


@registry.command()
def browse(
    store: Annotated[
        Path | None, typer.Argument(metavar="STORE", help="The folder of the runs.", show_default=False)
    ] = None,
    folder: registry.StoreFolder = registry.STORE,
    port: Annotated[
        int, typer.Option(metavar="N", min=0, max=65535, help="Where it answers.", show_default="any free")
    ] = 0,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Print the address, and open no browser.")
    ] = False,
    static: Annotated[
        Path | None, typer.Option("--static", metavar="DIR", help="Write a copy of one campaign instead.")
    ] = None,
    campaign: str | None = None,
    json: registry.Json = False,
) -> output.Status:
    """Open a window on a store: look, choose, compare, in a browser on this machine.

    Parameters
    ----------
    campaign : TITLE [the only one]: With --static, which campaign.
    """
    from wearlab.browsing.window import Window

    own = open_store(store or folder)
    if static is not None:
        from wearlab.browsing.taking import write_copy

        with output.refusing(OSError):
            made = write_copy(own, static, campaign)
        if json:
            output.show_json({"file": str(made)})
        else:
            output.say(str(made))
        return output.Status.WELL
    if campaign is not None:
        raise output.Stop("browse: --campaign goes with --static DIR")

    def ready(address: str) -> None:
        if json:
            output.show_json({"address": address})
        else:
            output.say(f"{address}\nCtrl-C ends it")
        if not no_open:
            webbrowser.open(address)

    Window(own, port).run(ready)
    return output.Status.WELL

"""Figures from stored runs."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, Json, StoreFolder
from wearlab.cli.output import Status, Stop
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def figures(
    file: Annotated[
        str | None, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)
    ] = None,
    store: StoreFolder = STORE,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the figures go.")] = Path("figures"),
    ending: Annotated[str, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf.")] = "png",
    again: Annotated[
        list[Path] | None,
        typer.Option("--from", metavar="FIGURE", help="Draw this figure again, by what its file says."),
    ] = None,
    json: Json = False,
) -> Status:
    """Draw the figures of FILE from the stored runs, or a figure again from what its file says."""
    from wearlab.cli.drawing import draw_figures, redraw_figures

    if again and file is None:
        return redraw_figures(again, Store(store), out, json)
    if file is None or again:
        raise Stop("figures: give a campaign FILE, or --from FIGURE")
    return draw_figures(file, Store(store), out, ending, json)

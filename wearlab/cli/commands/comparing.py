"""Two runs or two campaigns side by side."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, Json, StoreFolder
from wearlab.cli.output import Status
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def compare(
    a: Annotated[
        str,
        typer.Argument(metavar="A", help="A run (id or condition) or a campaign file.", show_default=False),
    ],
    b: Annotated[str, typer.Argument(metavar="B", help="Another.", show_default=False)],
    store: StoreFolder = STORE,
    on: Annotated[str, typer.Option(metavar="WHAT", help="At the same cycle or wear_depth.")] = "cycle",
    tolerance: Annotated[float, typer.Option(metavar="T", help="Relative difference that counts.")] = 0.01,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the comparison as netCDF.")] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw it: PNG, SVG or PDF.")] = None,
    json: Json = False,
) -> Status:
    """Compare two runs or two campaigns: what was asked and what came out differently."""
    from wearlab.cli.comparing import compare_two

    return compare_two((a, b), Store(store), on, tolerance, (out, figure), json)

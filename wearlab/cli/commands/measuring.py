"""Error against run time."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import File, Json
from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def accuracy(
    file: File,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where dataset and figures go.")] = Path(
        "accuracy"
    ),
    error: Annotated[
        float | None,
        typer.Option(metavar="E", help="Relative error asked for.", show_default="numerics.tolerance"),
    ] = None,
    json: Json = False,
) -> Status:
    """Measure error against run time of FILE's scenes, beside other integrators."""
    from wearlab.cli.measuring import measure_accuracy

    return measure_accuracy(file, out, error, json)

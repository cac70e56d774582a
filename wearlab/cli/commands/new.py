"""A campaign file to begin with."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="external-pair, internal-pair, planetary, fzg or wind-stage.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file to write.", show_default="KIND, .toml"),
    ] = None,
) -> Status:
    """Write a commented campaign file to begin with, and the JSON Schema that editors complete it by."""
    from wearlab.cli.beginning import begin

    return begin(kind, out)

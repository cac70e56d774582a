"""Natural frequencies and critical speeds."""

from typing import Annotated

import typer

from wearlab.cli.options import File, Json
from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def modes(
    file: File,
    case: Annotated[
        str | None, typer.Option(metavar="LABEL", help="Which case.", show_default="the first")
    ] = None,
    json: Json = False,
) -> Status:
    """Show natural frequencies and critical speeds of FILE's gears."""
    from wearlab.cli.working import show_modes

    return show_modes(file, case, json)

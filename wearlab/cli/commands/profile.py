"""What a measured flank's file says, as a campaign would read it."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import Json
from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def profile(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A measured flank, as the machine wrote it.", show_default=False),
    ],
    columns: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=HEADER", help="Which header is meant, such as deviation=Abweichung."),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=UNIT", help="A unit that the file does not tell, such as diameter=mm."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FIGURE", help="PNG, SVG or PDF.", show_default="FILE's name, .png")
    ] = None,
    json: Json = False,
) -> Status:
    """Draw a measured flank as it was understood, and say how the file was read."""
    from wearlab.cli.profiling import draw_profile

    return draw_profile(file, columns or [], units or [], out, json)

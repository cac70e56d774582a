"""What can be written in a campaign file."""

from typing import Annotated

import typer

from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def schema(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="[FILE]", help="A campaign file whose plug-ins are added.", show_default=False
        ),
    ] = None,
    added: Annotated[
        bool, typer.Option("--added", help="Only what the file's plug-ins add, by slot and name.")
    ] = False,
    figures: Annotated[bool, typer.Option("--figures", help="List the kinds of figures instead.")] = False,
) -> Status:
    """Print the JSON Schema of campaign files: every option with unit, default and meaning."""
    from wearlab.cli.working import show_schema

    return show_schema(file, added, figures)

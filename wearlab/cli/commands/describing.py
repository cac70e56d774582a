"""What can be written in a campaign file."""

from typing import Annotated

import typer

from wearlab.cli.output import Status, Stop, read_plugins, say, show_json
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
    if figures:
        from wearlab.figures import KINDS

        show_json(sorted(KINDS))
        return Status.WELL
    from wearlab.campaign import added_json, schema_json

    if added and file is None:
        raise Stop("--added needs a campaign FILE that names plug-ins")
    plugins = () if file is None else read_plugins(file)
    say(added_json(plugins) if added else schema_json())
    return Status.WELL

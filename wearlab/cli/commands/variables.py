"""What datasets hold."""

from typing import Annotated

import typer

from wearlab.cli.options import Json
from wearlab.cli.output import Status
from wearlab.cli.registry import app


@app.command()
def variables(
    like: Annotated[
        str, typer.Argument(metavar="[WORD]", help="Only those with this in name or meaning.")
    ] = "",
    json: Json = False,
) -> Status:
    """List the variables of datasets: name, dims, unit, meaning, and what makes them."""
    from wearlab.cli.describing import list_variables

    return list_variables(like, json)

"""What datasets hold."""

from difflib import get_close_matches
from typing import Annotated

import typer

from wearlab.cli.options import Json
from wearlab.cli.output import Status, Stop, show_json, show_table
from wearlab.cli.registry import app

HEADS = ("name", "dims", "unit", "shown in", "meaning", "made by")


@app.command()
def variables(
    like: Annotated[
        str, typer.Argument(metavar="[WORD]", help="Only those with this in name or meaning.")
    ] = "",
    json: Json = False,
) -> Status:
    """List the variables of datasets: name, dims, unit, meaning, and what makes them."""
    from wearlab.schema import VARIABLES, origin_of

    word = like.lower()
    known = {
        name: variable
        for name, variable in VARIABLES.items()
        if word in f"{name} {variable.long_name} {variable.comment}".lower()
    }
    if not known:
        near = get_close_matches(like, VARIABLES, 1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise Stop(f"variables: none has {like!r} in its name or meaning{meant}")
    if json:
        show_json(
            [
                {
                    "name": name,
                    "dims": list(variable.dims),
                    "units": variable.units,
                    "display_units": variable.display_units,
                    "long_name": variable.long_name,
                    "comment": variable.comment,
                    "group": origin_of(name)[0],
                    "made_by": origin_of(name)[1],
                }
                for name, variable in known.items()
            ]
        )
        return Status.WELL
    rows = []
    for name, variable in known.items():
        meaning = f"{variable.long_name} ({variable.comment})" if variable.comment else variable.long_name
        rows.append(
            (
                name,
                ", ".join(variable.dims),
                variable.units,
                variable.display_units,
                meaning,
                origin_of(name)[1],
            )
        )
    show_table(HEADS, rows)
    return Status.WELL

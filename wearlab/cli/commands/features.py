"""Tables for statistics and learning."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, Condition, Json, StoreFolder
from wearlab.cli.output import REFUSALS, Status, refusing, split_columns
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def features(
    store: StoreFolder = STORE,
    where: Condition = "",
    variables: Annotated[
        str | None, typer.Option(metavar="A,B", help="From these variables only; see wearlab variables.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write FILE, .csv or .nc.", show_default="CSV to read")
    ] = None,
    si: Annotated[bool, typer.Option("--si", help="SI units throughout.")] = False,
    json: Json = False,
) -> Status:
    """Write one row for each wear state of each run: harmonics, indicators, orders as columns."""
    from wearlab.cli.featuring import write_features
    from wearlab.query.errors import QueryError

    with refusing(*REFUSALS, QueryError):
        return write_features(Store(store), where, split_columns(variables), out, si, json)

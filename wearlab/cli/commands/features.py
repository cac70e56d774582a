"""Tables for statistics and learning: runs as numbers, on the screen or in a file."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, Condition, Json, StoreFolder
from wearlab.cli.output import REFUSALS, Status, Stop, refusing, say, show_json, split_columns
from wearlab.cli.registry import app
from wearlab.store import Store

ENDINGS = (".csv", ".nc")


@app.command()
def features(
    folder: StoreFolder = STORE,
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
    from wearlab.query.grammar import QueryError

    if out is not None and out.suffix not in ENDINGS:
        raise Stop(f"{out}: features are written as {' or '.join(ENDINGS)}")
    with refusing(*REFUSALS, QueryError):
        table = Store(folder).features(where, variables=split_columns(variables))
    if json:
        units = [{"name": column.name, "unit": column.unit_of(True) or None} for column in table.columns]
        show_json({"columns": units, "rows": table.to_rows(si=True)})
        return Status.WELL
    if out is None:
        say(table.to_csv(si=si).rstrip("\n"))
        return Status.WELL
    try:
        if out.suffix == ".nc":
            table.to_xarray(si=si).to_netcdf(out)
        else:
            out.write_text(table.to_csv(si=si))
    except OSError as error:
        raise Stop(f"{out}: cannot be written ({error.strerror or error})") from error
    say(f"{out}: {len(table)} rows, {len(table.columns)} columns")
    return Status.WELL

"""What a store holds."""

from typing import Annotated

import typer

from wearlab.cli.options import STORE, Condition, Json, Run, StoreFolder
from wearlab.cli.output import REFUSALS, Format, Status, refusing, split_columns
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def ls(
    store: StoreFolder = STORE,
    state: Annotated[
        str | None,
        typer.Option(
            metavar="STATE", help="Only runs that are done, failed, refused, running, interrupted or lost."
        ),
    ] = None,
    where: Condition = "",
    columns: Annotated[
        str | None, typer.Option(metavar="A,B", help="What to show, such as speed,life.")
    ] = None,
    sort: Annotated[str | None, typer.Option(metavar="A", help="By a column; -A turns the order.")] = None,
    limit: Annotated[int | None, typer.Option(metavar="N", min=0, help="At most so many.")] = None,
    updates: Annotated[bool, typer.Option("--updates", help="The updates in place of the runs.")] = False,
    format: Annotated[Format, typer.Option(help="How to write it.")] = Format.TABLE,
    json: Json = False,
) -> Status:
    """List the runs of a store: all, or those that meet a condition."""
    if updates:
        from wearlab.cli.updating import list_updates

        return list_updates(Store(store), json or format is Format.JSON)
    from wearlab.cli.listing import RowsWanted, list_runs
    from wearlab.query.errors import QueryError

    wanted = RowsWanted(where, split_columns(columns), sort, limit, state)
    with refusing(*REFUSALS, QueryError):
        return list_runs(Store(store), wanted, Format.JSON if json else format)


@app.command()
def show(
    run: Run,
    store: StoreFolder = STORE,
    variables: Annotated[
        bool, typer.Option("--variables", help="Describe every stored variable: dimensions, unit, meaning.")
    ] = False,
    json: Json = False,
) -> Status:
    """Show one run: results, what they are worth, its scene, what is stored."""
    from wearlab.cli.showing import show_run

    with refusing(*REFUSALS):
        return show_run(Store(store), run, json, variables=variables)

"""Stores that are handed on, trusted and tidied."""

from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.options import STORE, File, Json, Run, StoreFolder
from wearlab.cli.output import REFUSALS, Status, refusing
from wearlab.cli.registry import app
from wearlab.store import Store


@app.command()
def export(
    file: File,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="out.nc, out.zarr (a folder), or out.zip (a crate).", show_default=False
        ),
    ],
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Write all runs of FILE as one file that needs no wearlab to be read; a crate holds its figures too."""
    from wearlab.cli.sharing import export_campaign

    return export_campaign(file, Store(store), out, json)


@app.command()
def merge(
    other: Annotated[Path, typer.Argument(metavar="OTHER", help="Another store.", show_default=False)],
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Take the runs of the store OTHER into this one, each verified."""
    from wearlab.cli.sharing import merge_stores

    return merge_stores(Store(other), Store(store), json)


@app.command()
def pull(
    other: Annotated[
        Path, typer.Argument(metavar="OTHER", help="A folder, or https://… or s3://…", show_default=False)
    ],
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Bring here what the store OTHER has and this one has not, each run verified; the same as merge."""
    return merge(other, store, json)


@app.command()
def push(
    other: Annotated[
        Path, typer.Argument(metavar="OTHER", help="The folder to bring them to.", show_default=False)
    ],
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Bring to the store OTHER what this one has and that one has not, each run verified."""
    return merge(store, other, json)


@app.command()
def prune(
    store: StoreFolder = STORE,
    keep: Annotated[
        list[str] | None, typer.Option(metavar="FILE", help="A campaign whose runs stay.")
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Remove them; otherwise only say what would go.")
    ] = False,
    json: Json = False,
) -> Status:
    """Show the runs that no campaign refers to, and remove them with --yes."""
    from wearlab.cli.sharing import prune_store

    return prune_store(Store(store), keep or [], yes, json)


@app.command()
def reindex(store: StoreFolder = STORE, json: Json = False) -> Status:
    """Make the catalogue anew from the run files."""
    from wearlab.cli.sharing import reindex_store

    return reindex_store(Store(store), json)


@app.command()
def cite(
    run: Run,
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Print how to cite a run, and where it comes from."""
    from wearlab.cli.sharing import cite_run

    return cite_run(Store(store), run, json)


@app.command()
def verify(store: StoreFolder = STORE, json: Json = False) -> Status:
    """Compare every run file with the hash of what was written."""
    from wearlab.cli.listing import verify_store

    with refusing(*REFUSALS):
        return verify_store(Store(store), json)

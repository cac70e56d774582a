"""The commands and their options; everything heavy is imported by the command that needs it."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from wearlab.cli.output import REFUSALS, Format, Status, Stop, complain, refusing, split_columns
from wearlab.store import Store

app = typer.Typer(
    name="wearlab",
    help="Experiments and datasets of coupled gear wear and dynamics.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

File = Annotated[str, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)]
StoreFolder = Annotated[
    Path, typer.Option("--store", metavar="DIR", envvar="WEARLAB_STORE", help="The folder of the runs.")
]
Json = Annotated[bool, typer.Option("--json", help="Write JSON.")]
Run = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help='An id, its beginning, or a condition that one run meets: "speed = 900 rpm".',
        show_default=False,
    ),
]
STORE = Path("wearlab-store")


@app.command()
def check(file: File, json: Json = False) -> Status:
    """Show what FILE asks for: parts present and left out, cases, and which of them cannot be."""
    from wearlab.cli.working import check_campaign

    return check_campaign(file, json)


@app.command()
def plan(
    file: File,
    store: StoreFolder = STORE,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Worker processes.", show_default="the cores")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Count failed and refused cases too.")] = False,
    json: Json = False,
) -> Status:
    """Show what run would do with FILE: new, cached, excluded, failed before; time and disk space."""
    from wearlab.cli.planning import plan_campaign

    return plan_campaign(file, Store(store), workers, retry, json)


@app.command()
def run(
    file: File,
    store: StoreFolder = STORE,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Worker processes.", show_default="the cores")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A dask scheduler to use, tcp://host:port.")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Compute failed and refused cases again.")] = False,
    recompute: Annotated[
        str | None,
        typer.Option(metavar="WHAT", help="Compute again: failed, stale (made by other code) or all."),
    ] = None,
    dashboard: Annotated[
        bool, typer.Option("--dashboard", help="Let the workers show dask's page about themselves.")
    ] = False,
    json: Json = False,
) -> Status:
    """Compute what is missing of FILE."""
    from wearlab.cli.interrupting import at_once_when_twice
    from wearlab.cli.working import run_campaign

    at_once_when_twice()
    return run_campaign(file, Store(store), json, workers, scheduler, retry, recompute, dashboard)


@app.command()
def ls(
    store: StoreFolder = STORE,
    state: Annotated[
        str | None,
        typer.Option(
            metavar="STATE", help="Only runs that are done, failed, refused, running, interrupted or lost."
        ),
    ] = None,
    where: Annotated[
        str, typer.Option(metavar="EXPR", help='Such as "torque > 100 N*m and life < 2e7".')
    ] = "",
    columns: Annotated[
        str | None, typer.Option(metavar="A,B", help="What to show, such as speed,life.")
    ] = None,
    sort: Annotated[str | None, typer.Option(metavar="A", help="By a column; -A turns the order.")] = None,
    limit: Annotated[int | None, typer.Option(metavar="N", min=0, help="At most so many.")] = None,
    format: Annotated[Format, typer.Option(help="How to write it.")] = Format.TABLE,
    json: Json = False,
) -> Status:
    """List the runs of a store: all, or those that meet a condition."""
    from wearlab.cli.listing import Wanted, list_runs
    from wearlab.query.errors import QueryError

    wanted = Wanted(where, split_columns(columns), sort, limit, state)
    with refusing(*REFUSALS, QueryError):
        return list_runs(Store(store), wanted, Format.JSON if json else format)


@app.command()
def show(
    run: Run,
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Show one run: scene, variables with units, verdict, times."""
    from wearlab.cli.listing import show_run

    with refusing(*REFUSALS):
        return show_run(Store(store), run, json)


@app.command()
def figures(
    file: Annotated[
        str | None, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)
    ] = None,
    store: StoreFolder = STORE,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the figures go.")] = Path("figures"),
    ending: Annotated[str, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf.")] = "png",
    again: Annotated[
        list[Path] | None,
        typer.Option("--from", metavar="FIGURE", help="Draw this figure again, by what its file says."),
    ] = None,
    json: Json = False,
) -> Status:
    """Draw the figures of FILE from the stored runs, or a figure again from what its file says."""
    from wearlab.cli.drawing import draw_figures, redraw_figures

    if again and file is None:
        return redraw_figures(again, Store(store), out, json)
    if file is None or again:
        raise Stop("figures: give a campaign FILE, or --from FIGURE")
    return draw_figures(file, Store(store), out, ending, json)


@app.command()
def compare(
    a: Annotated[
        str,
        typer.Argument(metavar="A", help="A run (id or condition) or a campaign file.", show_default=False),
    ],
    b: Annotated[str, typer.Argument(metavar="B", help="Another.", show_default=False)],
    store: StoreFolder = STORE,
    on: Annotated[str, typer.Option(metavar="WHAT", help="At the same cycle or wear_depth.")] = "cycle",
    tolerance: Annotated[float, typer.Option(metavar="T", help="Relative difference that counts.")] = 0.01,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the comparison as netCDF.")] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw it: PNG, SVG or PDF.")] = None,
    json: Json = False,
) -> Status:
    """Compare two runs or two campaigns: what was asked and what came out differently."""
    from wearlab.cli.comparing import compare_two

    return compare_two(a, b, Store(store), on, tolerance, (out, figure), json)


@app.command()
def report(
    file: File,
    store: StoreFolder = STORE,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page.", show_default="FILE's name, .html")
    ] = None,
    json: Json = False,
) -> Status:
    """Write one self-contained HTML page about FILE and its stored runs."""
    from wearlab.cli.reporting import write_report

    return write_report(file, Store(store), out, json)


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


@app.command()
def accuracy(
    file: File,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where dataset and figures go.")] = Path(
        "accuracy"
    ),
    error: Annotated[
        float | None,
        typer.Option(metavar="E", help="Relative error asked for.", show_default="numerics.tolerance"),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Processes that score drawn scenes ([estimates]).",
            show_default="the cores",
        ),
    ] = None,
    json: Json = False,
) -> Status:
    """Measure error against run time of FILE's scenes, beside other integrators; or score [estimates]."""
    from wearlab.cli.measuring import measure_accuracy

    return measure_accuracy(file, out, error, workers, json)


@app.command()
def schema(
    figures: Annotated[bool, typer.Option("--figures", help="List the kinds of figures instead.")] = False,
) -> Status:
    """Print the JSON Schema of campaign files: every option with unit, default and meaning."""
    from wearlab.cli.working import show_schema

    return show_schema(figures)


@app.command()
def export(
    file: File,
    out: Annotated[
        Path, typer.Argument(metavar="OUT", help="out.nc, or out.zarr (a folder).", show_default=False)
    ],
    store: StoreFolder = STORE,
    json: Json = False,
) -> Status:
    """Write all runs of FILE as one file that needs no wearlab to be read."""
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


def status_of(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; trouble is one message on standard error.

    Parameters
    ----------
    arguments : words after ``wearlab`` [those of this process]
    """
    try:
        result = app(
            args=None if arguments is None else list(arguments), prog_name="wearlab", standalone_mode=False
        )
        sys.stdout.flush()
        return int(result or Status.WELL)
    except Stop as stop:
        complain(f"wearlab: {stop}")
        return stop.status
    except KeyboardInterrupt:
        complain("wearlab: interrupted")
        return Status.INTERRUPTED
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Status.TROUBLE
    except Exception as error:
        return _misuse(error)


def _misuse(error: Exception) -> int:
    """Tell a wrong command or option in one message; a fault of ours keeps its traceback."""
    tell = getattr(error, "format_message", None)
    if tell is None:
        raise error
    complain(tell() if type(error).__name__ == "NoArgsIsHelpError" else f"wearlab: {tell()}")
    return Status.REFUSED


def main() -> None:
    """Run the command line and leave with its exit status."""
    sys.exit(status_of())

"""Figures from stored runs: those of a campaign, or one again by what its own file says."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearlab.cli.options import STORE, Json, StoreFolder
from wearlab.cli.output import REFUSALS, Status, Stop, complain, refusing, say, show_json
from wearlab.cli.registry import app
from wearlab.cli.sound import sound_campaign
from wearlab.store import Store

if TYPE_CHECKING:
    from wearlab.figures.again import Redrawn


@app.command()
def figures(
    file: Annotated[
        str | None, typer.Argument(metavar="FILE", help="A campaign file (TOML).", show_default=False)
    ] = None,
    folder: StoreFolder = STORE,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the figures go.")] = Path("figures"),
    ending: Annotated[str, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf.")] = "png",
    again: Annotated[
        list[Path] | None,
        typer.Option("--from", metavar="FIGURE", help="Draw this figure again, by what its file says."),
    ] = None,
    json: Json = False,
) -> Status:
    """Draw the figures of FILE from the stored runs, or a figure again from what its file says."""
    if again and file is None:
        return redraw_figures(again, Store(folder), out, json)
    if file is None or again:
        raise Stop("figures: give a campaign FILE, or --from FIGURE")
    return draw_figures(file, Store(folder), out, ending, json)


def draw_figures(file: str, store: "Store", out: Path, ending: str, as_json: bool) -> Status:
    """Draw the figures of a campaign from its stored runs."""
    from wearlab.figures import FigureError, draw
    from wearlab.figures.drawing import check_format

    with refusing(FigureError):
        check_format(ending)
    campaign = sound_campaign(file)
    status = Status.WELL
    with refusing(*REFUSALS, OSError):
        try:
            drawn = tuple(draw(campaign, store, out, ending))
        except FigureError as error:
            complain(str(error))
            drawn, status = error.drawn, Status.TROUBLE
    if as_json:
        show_json([str(path) for path in drawn])
    else:
        for path in drawn:
            say(str(path))
    return status


def redraw_figures(figures: Sequence[Path], store: "Store", out: Path, as_json: bool) -> Status:
    """Draw figures again from the store, and say which of their runs are missing or stale."""
    from wearlab.figures import FigureError, redraw

    with refusing(*REFUSALS, FigureError, OSError):
        drawn = [redraw(figure, store, out) for figure in figures]
    if as_json:
        show_json([{**vars(redrawn), "path": str(redrawn.path)} for redrawn in drawn])
    else:
        for redrawn in drawn:
            _tell(redrawn)
    return Status.TROUBLE if any(redrawn.missing for redrawn in drawn) else Status.WELL


def _tell(drawn: "Redrawn") -> None:
    say(f"{drawn.path}: {'the same bytes' if drawn.same else 'differs from the figure it was drawn from'}")
    for words, runs in (
        ("missing", drawn.missing),
        ("stale, made by other code", drawn.stale),
        ("computed again since the figure was drawn", drawn.changed),
    ):
        if runs:
            complain(f"{words}: {', '.join(runs)}")

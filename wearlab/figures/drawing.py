"""Files of figures: of a campaign, for a page, drawn again from a file."""

import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import xarray as xr

from wearlab.figures.kind import FigureError, is_of_update
from wearlab.figures.plot import Paper, narrow
from wearlab.figures.plotting import PlottedFigure, of_update, plotted
from wearlab.figures.question import (
    Question,
    embedded,
    numbered_figures,
    question,
    question_in,
    texts,
)
from wearlab.nearest import choices
from wearlab.sources import SHORT_ID, is_other_code
from wearlab.store.files import StoreError, write_whole

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store


FORMATS = ("png", "svg", "pdf")


class FigureOutcome(NamedTuple):
    """What became of one ``[[figure]]`` of a campaign.

    Parameters
    ----------
    spec : the campaign's figure
    result : what was made of it, None where it cannot be drawn
    problem : why it cannot be drawn, "" where it can
    """

    spec: Any
    result: Any
    problem: str


def draw(
    campaign: "Campaign",
    store: "Store",
    out: Path,
    ending: str = "png",
    paper: Paper | None = None,
) -> list[Path]:
    """Draw one file for every ``[[figure]]`` of a campaign, named by number and kind.

    Parameters
    ----------
    campaign : its figures, and the runs to draw
    store : where the runs are; nothing is computed
    out : folder of the figures, made when absent
    ending : png, svg or pdf
    paper : width and style, where they are not wearlab's

    Returns
    -------
    The files, in the order of the campaign file. The same store gives the same bytes.

    Raises
    ------
    FigureError
        When some cannot be drawn: one line each; the others are drawn all the same
        (``error.drawn``).
    StoreError
        When there is no store.
    """
    check_format(ending)
    grid = store.open(campaign)

    def written(figure_question: Question) -> Path:
        path = out / f"{figure_question.name}.{ending}"
        asked = figure_question._replace(paper=paper or Paper())
        image, _ = file_of(asked, grid, store, ending)
        write_whole(path, image)
        return path

    outcomes = list(each_figure(campaign, written))
    paths = [outcome.result for outcome in outcomes if outcome.result]

    if len(paths) < len(outcomes):
        problems = [outcome.problem for outcome in outcomes if outcome.problem]
        raise FigureError("\n".join(problems), tuple(paths))
    return paths


def each_figure(
    campaign: "Campaign", make: Callable[[Question], Any]
) -> Iterator[FigureOutcome]:
    """Yield what is made of each ``[[figure]]`` of a campaign.

    Parameters
    ----------
    campaign : its figures
    make : what is called with the question of each figure
    """
    for number, spec in numbered_figures(campaign):
        result = None
        problem = ""
        try:
            result = make(question(campaign, spec, number))
        except (FigureError, StoreError) as error:
            problem = str(error)
        except Exception as error:  # a fault of ours in one figure stops no other
            problem = fault_message(f"figure {number} ({spec.kind})", error)
        yield FigureOutcome(spec, result, problem)


def fault_message(name: str, error: Exception) -> str:
    """Return the message of a figure that fails by a fault of wearlab.

    Parameters
    ----------
    name : of the figure
    error : what was raised; the message names the file and line that raised it
    """
    frames = traceback.extract_tb(error.__traceback__)
    place = ""
    if frames:
        place = f" in {Path(frames[-1].filename).name}, line {frames[-1].lineno}"

    message = (
        f"{name}: a fault of wearlab, not of the file: {type(error).__name__}: "
        f"{error}{place}"
    )
    return (
        f"{message}; the other figures are drawn; please report this line with the "
        "campaign"
    )


def check_format(ending: str) -> None:
    """Refuse a format that figures are not written in.

    Parameters
    ----------
    ending : of the file, such as ``png``

    Raises
    ------
    FigureError : no such format
    """
    if ending not in FORMATS:
        raise FigureError(f"format {ending!r}: {choices(ending, FORMATS)}")


def both_widths(
    figure_question: Question, grid: xr.Dataset, store: "Store"
) -> tuple[bytes, bytes | None]:
    """Return the picture of a figure for a page, and one for small screens.

    A figure of one column is drawn once: it fits both, and the second is None.

    Parameters
    ----------
    figure_question : the question
    grid : the campaign as the store has it
    store : of the grid

    Raises
    ------
    FigureError : it cannot be drawn
    """
    from wearlab.figures.render import lightened, rendered

    plot = plot_of(figure_question, grid, store).plot
    small = lightened(rendered(narrow(plot), {})) if plot.columns > 1 else None
    return lightened(rendered(plot, {})), small


def file_of(
    figure_question: Question, grid: xr.Dataset, store: "Store", ending: str
) -> tuple[bytes, tuple[str, ...]]:
    """Return the file of a figure, and the names of the runs that are missing.

    Parameters
    ----------
    figure_question : the question
    grid : the campaign as the store has it
    store : of the grid, for what it knows of the runs
    ending : png, svg or pdf

    Raises
    ------
    FigureError : it cannot be drawn
    """
    from wearlab.figures.render import rendered

    figure = plot_of(figure_question, grid, store)
    entries = store.archive.entries(run.id for run in figure.runs)
    keywords = texts(figure_question, entries, figure.missing)
    image = rendered(figure.plot, keywords, ending, figure_question.paper)
    return image, figure.missing


def plot_of(
    figure_question: Question, grid: xr.Dataset, store: "Store"
) -> PlottedFigure:
    """Return a figure of runs or of the kept update as data.

    Parameters
    ----------
    figure_question : the question
    grid : the campaign as the store has it
    store : of the grid, where the update is kept

    Raises
    ------
    FigureError : it cannot be drawn
    """
    request = figure_question.request
    if is_of_update(request.kind):
        return PlottedFigure(of_update(figure_question.subject, store, request), [], ())
    return plotted(grid, request)


class Redrawn(NamedTuple):
    """A figure drawn again.

    Parameters
    ----------
    path : the new file
    same : whether it has the bytes of the one that asked
    missing : runs without data, by name and state
    stale : runs made by other code than the present
    changed : runs computed again since the figure was first drawn
    """

    path: Path
    same: bool
    missing: tuple[str, ...]
    stale: tuple[str, ...]
    changed: tuple[str, ...]


def redraw(
    figure: Path,
    store: "Store",
    out: Path,
    ending: str | None = None,
    paper: Paper | None = None,
) -> Redrawn:
    """Draw a figure again from a store, by what its file says.

    Parameters
    ----------
    figure : PNG, SVG or PDF drawn by wearlab
    store : where the runs are; nothing is computed
    out : folder of the new figure, which may be that of the old one
    ending : png, svg or pdf [that of the old one]
    paper : width and style, of which each holds that is given [those of the old one]

    Returns
    -------
    Redrawn

    Raises
    ------
    FigureError : the file carries no question, or none of its runs is there
    StoreError : there is no store, or a file of it is damaged
    """
    figure_question = question_in(embedded(figure), figure)
    ending = ending or figure.suffix.lower().removeprefix(".")
    check_format(ending)
    if paper is not None:
        old_paper = figure_question.paper
        width = paper.width or old_paper.width
        look = Paper(width, paper.settings or old_paper.settings)
        figure_question = figure_question._replace(paper=look)

    old_image = figure.read_bytes()
    grid = store.open(figure_question.campaign)  # type: ignore[arg-type]
    image, missing = file_of(figure_question, grid, store, ending)
    path = out / f"{figure_question.name}.{ending}"
    write_whole(path, image)

    recorded = figure_question.runs or {}
    entries = store.archive.entries(recorded)
    stale = [
        run_id for run_id, entry in entries.items() if is_other_code(entry.source_hash)
    ]
    changed = [
        run_id for run_id, entry in entries.items() if entry.sha256 != recorded[run_id]
    ]
    return Redrawn(
        path=path,
        same=image == old_image,
        missing=missing,
        stale=tuple(run_id[:SHORT_ID] for run_id in stale),
        changed=tuple(run_id[:SHORT_ID] for run_id in changed),
    )

"""Every figure of a campaign, drawn from the store."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from wearlab.figures.ask import Ask
from wearlab.figures.compose import compose, hue_of
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kind import Kind
from wearlab.figures.kinds import KINDS
from wearlab.figures.kinds.line import joined
from wearlab.figures.plot import Plot
from wearlab.figures.published import published
from wearlab.figures.question import Question, question, texts
from wearlab.figures.runs import Picked, Run, load, pick, require

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store


FORMATS = ("png", "svg", "pdf")


def draw(campaign: "Campaign", store: "Store", out: Path, ending: str = "png") -> list[Path]:
    """Draw one file for every ``[[figure]]`` of a campaign, named by its number and kind.

    Parameters
    ----------
    campaign : its figures, and the runs to draw
    store : where the runs are; nothing is computed
    out : folder of the figures, made when absent
    ending : png, svg or pdf

    Returns
    -------
    The files, in the order of the campaign file. The same store gives the same bytes.

    Raises
    ------
    FigureError
        When some cannot be drawn: one line each; the others are drawn all the same (``error.drawn``).
    StoreError
        When there is no store.
    """
    check_format(ending)
    grid = store.open(campaign)
    drawn: list[Path] = []
    problems: list[str] = []
    for number, spec in enumerate(campaign.figures, 1):
        try:
            asked = question(campaign, spec, number)
            image, _ = answer(asked, grid, store, ending)
            drawn.append(write(out / f"{asked.name}.{ending}", image))
        except FigureError as error:
            problems.append(str(error))
    if problems:
        raise FigureError("\n".join(problems), tuple(drawn))
    return drawn


def check_format(ending: str) -> None:
    """Refuse a format that figures are not written in.

    Raises
    ------
    FigureError : no such format
    """
    if ending not in FORMATS:
        raise FigureError(f"format {ending!r}: {choices(ending, FORMATS)}")


def answer(asked: Question, grid: xr.Dataset, store: "Store", ending: str) -> tuple[bytes, tuple[str, ...]]:
    """Return the file of a figure, and the names of the runs that are missing.

    Parameters
    ----------
    asked : the question
    grid : the campaign as the store has it
    store : of the grid, for what it knows of the runs
    ending : png, svg or pdf

    Raises
    ------
    FigureError : it cannot be drawn
    """
    ask = asked.ask
    plot, runs, missing = plotted(grid, ask)
    from wearlab.figures.render import rendered

    return rendered(plot, texts(asked, ask, store.entries(run.id for run in runs), missing), ending), missing


def plotted(grid: xr.Dataset, ask: Ask) -> tuple[Plot, list[Run], tuple[str, ...]]:
    """Return a figure as data, the runs it shows, and the names of those that are missing.

    Raises
    ------
    FigureError : it cannot be drawn
    """
    if ask.kind not in KINDS:
        raise FigureError(f"{ask.name}: no such kind; {choices(ask.kind, KINDS)}")
    kind = KINDS[ask.kind]
    picked = pick(grid, ask, all_cases=kind.all_cases)
    runs = _able(grid, _for_kind(ask, kind, grid), kind, picked)
    ask = _for_kind(ask, kind, grid)
    series = [one for run in runs for one in kind.series(run, ask)]
    if not series:
        raise FigureError(f"{ask.name}: no selected run has {' or '.join(ask.y or kind.also or kind.needs)}")
    dims = [str(dim) for dim in grid.run_id.dims]
    if ask.kind == "line" and ask.x in dims:
        series = joined(series)
    if kind.joined is not None:
        series = kind.joined(series)
    notes = _notes(ask, picked.missing)
    if ask.published is not None:
        series += published(ask.published, series, hue_of(series, ask, kind, dims), ask)
    return compose(series, ask, kind, dims, notes), runs, picked.missing


def _for_kind(ask: Ask, kind: Kind, grid: xr.Dataset) -> Ask:
    """Return the ask with the kind's own selection: the first flank where one is enough."""
    roles = (ask.hue, ask.rows, ask.cols)
    if kind.one_flank and "flank" in grid.coords and "flank" not in ask.select and "flank" not in roles:
        return replace(ask, select={**ask.select, "flank": str(grid["flank"].values[0])})
    return ask


def _able(grid: xr.Dataset, ask: Ask, kind: Kind, picked: Picked) -> list[Run]:
    if not picked.points:
        raise FigureError(f"{ask.name}: none of its runs is there to be drawn: {'; '.join(picked.missing)}")
    names = [*kind.needs, *kind.also, *ask.y, *([ask.x] if ask.x else [])]
    if not (ask.y or kind.needs):
        raise FigureError(f"{ask.name}: y names no variable; {_near('', grid.data_vars)}")
    for name in ask.y:
        if name not in grid.variables:
            raise FigureError(f"{ask.name}: y = {name!r} is not there; {_near(name, grid.data_vars)}")
        if grid[name].dtype.kind not in "fiub":
            raise FigureError(f"{ask.name}: y = {name!r} holds text, not numbers")
    needed = [*(kind.needs if not ask.y else [n for n in kind.needs if n in grid.coords]), *ask.y[:1]]
    if ask.x and ask.x not in grid.variables and ask.x not in grid.dims:
        raise FigureError(f"{ask.name}: x = {ask.x!r} is not there; {_near(ask.x, grid.coords)}")
    return require(load(grid, picked, names, ask), needed, ask)


def _near(name: str, known: Iterable[object]) -> str:
    return choices(name, sorted(map(str, known)))


def _notes(ask: Ask, missing: Sequence[str]) -> list[str]:
    absent = [f"Not drawn: {'; '.join(missing)}."] if missing else []
    return ([ask.note] if ask.note else []) + absent


def write(path: Path, image: bytes) -> Path:
    """Put a figure in place, all of it or nothing."""
    part = path.with_name(f"{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(image)
        os.replace(part, path)
    except OSError as error:
        raise FigureError(f"{path}: cannot be written ({error.strerror or error})") from error
    return path

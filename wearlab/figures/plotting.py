"""A figure as plain data: from a request to panels, curves and notes."""

from typing import TYPE_CHECKING, NamedTuple

import xarray as xr

from wearlab.figures import checks, kinds, layout, notes, series_of_runs, updated
from wearlab.figures.kind import FigureRequest, Run, no_kind
from wearlab.figures.plot import Plot
from wearlab.figures.runs import pick

if TYPE_CHECKING:
    from wearlab.store import Store


class PlottedFigure(NamedTuple):
    """A figure as data, with the runs that it shows.

    Parameters
    ----------
    plot : what is to be drawn
    runs : the runs that it shows
    missing : names of the runs that have no data, each with its state
    """

    plot: Plot
    runs: list[Run]
    missing: tuple[str, ...]


def of_update(subject: str, store: "Store", request: FigureRequest) -> Plot:
    """Return a figure of a kept update as data.

    Parameters
    ----------
    subject : identity of what the update is of
    store : where it is kept
    request : what the figure asks for

    Raises
    ------
    FigureError : no update that shows it is kept
    """
    kind = kinds.KINDS[request.kind]
    cases = updated.updated_cases(subject, store, request, kind.needs)
    curves = [curve for case in cases for curve in kind.curves(case, request)]
    series = [curve for curve in curves if len(curve.x)]
    if not series:
        raise request.error("the update has nothing to show of it")

    lines = [request.note] if request.note else []
    return layout.compose(series, request, kind, {"case": ""}, lines)


def plotted(grid: xr.Dataset, request: FigureRequest) -> PlottedFigure:
    """Return a figure of runs as data.

    Parameters
    ----------
    grid : the campaign's dataset
    request : what the figure asks for

    Raises
    ------
    FigureError : it cannot be drawn
    """
    if request.kind not in kinds.KINDS:
        raise request.error(no_kind(request.kind))
    kind = kinds.KINDS[request.kind]

    request, of_defaults = checks.with_defaults(request, kind, grid)
    points, missing = pick(grid, request, all_cases=kind.all_cases)
    runs, of_runs = checks.able_runs(grid, request, kind, points)

    curves = series_of_runs.curves_of(runs, request, kind)
    omitted = notes.omissions(grid, request, kind, runs, curves)
    series, of_series = series_of_runs.arranged(curves, grid, request, kind)

    absent = f"Not drawn: {'; '.join(missing)}." if missing else ""
    series, of_points = series_of_runs.with_published(series, request, kind, grid)
    lines = [request.note, absent, *of_defaults, *of_runs, *omitted, *of_series]
    lines += of_points

    dims = series_of_runs.keys_of_dimensions(grid)
    plot = layout.compose(series, request, kind, dims, [text for text in lines if text])
    doubts = notes.uncertainty(runs, request, kind, plot.panels)
    if doubts:
        plot = plot._replace(notes=(*plot.notes, doubts))
    return PlottedFigure(plot, runs, tuple(missing))

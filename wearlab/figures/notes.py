"""Notes below a figure: what it does not draw, and how uncertain its runs are."""

from collections.abc import Sequence

import xarray as xr

from wearlab.figures import doubt, wording
from wearlab.figures.kind import FigureRequest, Kind, Run
from wearlab.figures.plot import Panel, Series, apart_from, grouped
from wearlab.figures.runs import BASE

THINNED = {
    "update": "wear states are drawn, spread over the life",
    "response_speed": "speeds are drawn, spread over all",
}
"""Dimension → what its note says where a kind draws some of its places."""
MAX_CASES = 8
"""Names of cases in a note."""


def omissions(
    grid: xr.Dataset,
    request: FigureRequest,
    kind: Kind,
    runs: Sequence[Run],
    series: Sequence[Series],
) -> list[str]:
    """Return what is not drawn though the campaign did not choose: states, cases.

    Parameters
    ----------
    grid : the campaign's dataset
    request : what the figure asks for
    kind : of the figure
    runs : that it shows
    series : their curves
    """
    return [*_places_left_out(runs, series), *_cases_left_out(grid, request, kind)]


def _places_left_out(runs: Sequence[Run], series: Sequence[Series]) -> list[str]:
    """Return how many of the wear states and speeds are drawn, where not all are."""
    notes = []
    for dim, words in THINNED.items():
        along_dim = [curve for curve in series if dim in curve.key]
        groups = grouped(along_dim, apart_from(dim)).values()
        counts = [len({curve.key[dim] for curve in group}) for group in groups]
        drawn = max(counts, default=0)
        total = max(run.data.sizes.get(dim, 1) for run in runs)
        if 0 < drawn < total:
            notes.append(f"{drawn} of {total} {words}; select.{dim} names others.")
    return notes


def _cases_left_out(grid: xr.Dataset, request: FigureRequest, kind: Kind) -> list[str]:
    """Return the names of cases that are not drawn beside the base."""
    cases = [str(case) for case in grid["case"].values] if "case" in grid.dims else []
    further = [case for case in cases if case != BASE]
    roles = (request.hue, request.rows, request.cols, request.x)
    is_chosen = kind.all_cases or "case" in (*request.select, *roles)
    if is_chosen or BASE not in cases or not further:
        return []

    names = wording.first_of(further, MAX_CASES)
    return [f"The base alone; further cases, for select.case or hue: {names}."]


def uncertainty(
    runs: Sequence[Run], request: FigureRequest, kind: Kind, panels: Sequence[Panel]
) -> str:
    """Return the line that says how uncertain a figure is, "" where it says nothing.

    Parameters
    ----------
    runs : that the figure shows
    request : what it asks for
    kind : of the figure
    panels : with the curves as they are drawn
    """
    variables = [kind.y] if kind.y else [*kind.needs, *kind.also]
    return doubt.note(runs, request.y or variables, panels)

"""Curves of the runs of a figure, arranged over a sweep or as bands."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.figures import curves, layout
from wearlab.figures.kind import FigureError, FigureRequest, Kind, Run
from wearlab.figures.kinds import cycles
from wearlab.figures.places_of_points import CurvesOfFigure
from wearlab.figures.plot import BESIDE, Series
from wearlab.figures.published import published
from wearlab.figures.runs import along_axes


class ArrangedSeries(NamedTuple):
    """Curves of all runs as they are drawn, and notes on what was done to them."""

    series: list[Series]
    notes: list[str]


class _SampledSeries(NamedTuple):
    """Series with the axes along which their runs were drawn at random, and notes."""

    series: list[Series]
    axes: list[str]
    notes: list[str]


def curves_of(runs: Sequence[Run], request: FigureRequest, kind: Kind) -> list[Series]:
    """Return the curves of all runs; empty ones only where there are no others.

    Parameters
    ----------
    runs : that the figure shows
    request : what it asks for
    kind : of the figure

    Raises
    ------
    FigureError : no run has a curve
    """
    series = [
        _with_run(curve, run) for run in runs for curve in kind.curves(run, request)
    ]
    series = [curve for curve in series if len(curve.x)] or series
    if not series:
        names = request.y or kind.also or kind.needs
        raise request.error(f"no selected run has {' or '.join(names)}")
    return series


def _with_run(curve: Series, run: Run) -> Series:
    """Return a curve with what is known of its run: id, doubt, and early end."""
    if curve.style in (*BESIDE, "area"):
        return curve
    doubtful = np.ones(len(curve.x), bool) if run.doubts else None
    ids = np.full(len(curve.x), run.id)
    ended_by = run.end.reason if run.end else ""
    return replace(curve, runs=ids, doubtful=doubtful, ended_by=ended_by)


def arranged(
    series: list[Series], grid: xr.Dataset, request: FigureRequest, kind: Kind
) -> ArrangedSeries:
    """Return curves as they are drawn: repeated ones once, over a sweep, or as bands.

    Parameters
    ----------
    series : curves of all runs
    grid : the campaign's dataset
    request : what the figure asks for
    kind : of the figure

    Raises
    ------
    FigureError : the kind cannot join the curves
    """
    series, notes = curves.without_repeats(series, request)
    notes = [*notes, *_caveats(series)]

    is_sweep = request.x in along_axes(grid)
    if kind.over_sweeps and kind.joined is None and is_sweep:
        dims = [str(dim) for dim in grid.run_id.dims]
        states = curves.states_in_common(series, dims)
        series = cycles.joined(states, str(grid[request.x].dims[0]))

    if kind.joined is not None:
        try:
            joined = kind.joined(series)
        except FigureError as error:
            raise request.error(error) from error
        return ArrangedSeries(joined, list(dict.fromkeys([*notes, *_caveats(joined)])))

    sampled = _sampled(grid, request, series)
    variable = (*request.y, kind.y)[0]
    bands, of_bands = curves.sample_bands(
        sampled.series, sampled.axes, curves.ended_of(variable)
    )
    return ArrangedSeries(bands, [*notes, *sampled.notes, *of_bands])


def _caveats(series: Sequence[Series]) -> list[str]:
    """Return what a reader must know of some curves, each text once."""
    return list(dict.fromkeys(curve.caveat for curve in series if curve.caveat))


def _sampled(
    grid: xr.Dataset, request: FigureRequest, series: list[Series]
) -> _SampledSeries:
    """Return series with the sampled axes that become bands: those without a role."""
    roles = {request.hue, request.rows, request.cols, request.x}
    axes = [axis for axis in curves.sampled_axes(grid) if axis not in roles]
    varied = [axis for axis in axes if any(axis in curve.key for curve in series)]
    if not varied:
        return _SampledSeries(series, [], [])

    dims = [str(dim) for dim in grid.run_id.dims]
    in_common = curves.states_in_common(series, dims)
    frequent, notes = curves.states_of_most(in_common, dims)
    return _SampledSeries(frequent, varied, notes)


def with_published(
    series: list[Series], request: FigureRequest, kind: Kind, grid: xr.Dataset
) -> ArrangedSeries:
    """Return curves, and the points of a paper where the figure asks for them.

    Parameters
    ----------
    series : curves as they are drawn
    request : what the figure asks for
    kind : of the figure
    grid : the campaign's dataset

    Raises
    ------
    FigureError : the points cannot be read, or have no place in the figure
    """
    has_published = any("source" in curve.key for curve in series)
    if request.published is None or has_published:
        return ArrangedSeries(series, [])
    roles = layout.laid_out(series, request, kind, keys_of_dimensions(grid)).roles
    of_figure = CurvesOfFigure(series, roles, grid)
    quantity = (*request.y, kind.y)[0]
    points = published(request.published, of_figure, quantity, request)
    return ArrangedSeries([*series, *points.series], points.notes)


def keys_of_dimensions(grid: xr.Dataset) -> Mapping[str, str]:
    """Return the dotted key that each dimension of the grid varies, "" for none.

    Parameters
    ----------
    grid : the campaign's dataset
    """
    return {str(dim): str(grid[dim].attrs.get("key", "")) for dim in grid.run_id.dims}

"""The generic figure: any variable over any of its dimensions, or over a sweep."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import plot, runs, wording
from wearlab.figures.kind import Ask, FigureError, kind
from wearlab.figures.kinds.engagement import POSITIONS, along_path
from wearlab.figures.slices import slices, thinned
from wearlab.nearest import choices
from wearlab.units import UnitError

DEFAULT_X = {"update": "cycle", "profile": "path_position"}
FREQUENCY = "mesh_frequency"
MOST_POINTS = 30
FEWEST_DOTS = 10


@kind(
    "line", "", (),
    roles=(("rows", "variable"), ("cols", "member"), ("hue", "*"), ("hue", "update"), ("cols", "*"),
        ("cols", "update"), ("rows", "flank")),
    also=(FREQUENCY,), all_cases=True, over_sweeps=True,
)  # fmt: skip
def line(run: runs.Run, ask: Ask) -> Iterator[plot.Series]:
    """Any variable y over a dimension, a coordinate or a sweep x, with hue, rows and cols."""
    several = len(ask.y) > 1
    for order, name in enumerate(ask.y):
        if name in run.data:
            extra = {"variable": wording.Label(float(order), name)} if several else {}
            for curve in _curves(run, name, ask):
                yield replace(curve, key={**curve.key, **extra})


def _curves(run: runs.Run, name: str, ask: Ask) -> Iterator[plot.Series]:
    if ask.x is not None and (ask.x in run.place or ask.x in run.beside):
        yield from _over_sweep(run, name, ask, ask.x)
        return
    dim, coordinate = _across(run, name, ask)
    run = run if dim == "update" else thinned(run)
    if coordinate in POSITIONS:
        yield from along_path(run, name, ask)
        return
    for piece in slices(run, name, ask, dim):
        for extra, x, across in _positions(run, dim, coordinate, piece.place, ask):
            held = np.isfinite(x) & np.isfinite(piece.values)
            look: plot.Look = "line-points" if held.sum() <= MOST_POINTS else "line"
            key, y, up = {**piece.key, **extra}, piece.values, piece.scale
            yield plot.Series(key, x, y, across, up, look, y_error=piece.error).at(held)


def _over_sweep(run: runs.Run, name: str, ask: Ask, axis: str) -> Iterator[plot.Series]:
    """Yield single points at this run's place along a sweep; they are joined to curves afterwards."""
    x, own = run.abscissa(axis)
    across = plot.Scale(run.labels.get(axis, axis.replace("_", " ")), run.units.get(axis, "1"))
    for piece in slices(thinned(run), name, ask):
        y = np.atleast_1d(piece.values)
        point = plot.Series(piece.key, np.array([x]), y, across, piece.scale, "line-points", own=own)
        yield replace(point, y_error=piece.error)


def _across(run: runs.Run, name: str, ask: Ask) -> tuple[str, str]:
    """Return the dimension that runs along x, and the coordinate that tells its values."""
    dims = [str(dim) for dim in run.data[name].dims]
    if ask.x is None:
        if not dims:
            raise FigureError(
                f"{ask.name}: {name} is one number per run; x must name a sweep: {choices('', run.place)}"
            )
        free = [d for d in dims if d not in (ask.hue, ask.rows, ask.cols)] or dims
        dim = next((d for d in ("phase", "profile", "update") if d in free), free[-1])
        return dim, DEFAULT_X.get(dim, dim)
    if ask.x in dims:
        return ask.x, DEFAULT_X.get(ask.x, ask.x)
    own = [str(dim) for dim in run.data[ask.x].dims] if ask.x in run.data.variables else []
    shared = [dim for dim in own if dim in dims]
    if not shared:
        valid = [*run.place, *dims, *(str(c) for c, v in run.data.coords.items() if set(v.dims) & set(dims))]
        raise FigureError(
            f"{ask.name}: x = {ask.x!r} does not run along {name}; {choices(ask.x, dict.fromkeys(valid))}"
        )
    return shared[-1], ask.x


def _positions(
    run: runs.Run, dim: str, coordinate: str, index: Mapping[str, int], ask: Ask
) -> Iterator[tuple[dict[str, wording.Label], Array, plot.Scale]]:
    """Yield abscissae along a dimension: one, or one for each place along dimensions that y has not."""
    if coordinate not in run.data.variables:
        yield {}, np.arange(run.data.sizes[dim], dtype=float), plot.Scale(dim.replace("_", " "), "1")
        return
    units = ask.units.get("x") or ask.units.get("order", "1")
    if coordinate == "order" and units != "1" and FREQUENCY in run.data:
        frequency = run.data[FREQUENCY]
        hertz = frequency[index.get("mesh", 0)].values * run.data[coordinate].values
        yield {}, _in_units(hertz, units, ask), plot.Scale("frequency", units)
        return
    kept = {name: at for name, at in index.items() if name in run.data[coordinate].dims}
    here = replace(run, data=run.data.isel(kept))
    for piece in slices(here, coordinate, ask, dim, axis="x"):
        extra = {name: label for name, label in piece.key.items() if name in piece.place}
        yield extra, piece.values, piece.scale


def _in_units(hertz: Array, units: str, ask: Ask) -> Array:
    try:
        return wording.converted(hertz, "Hz", units)
    except UnitError as error:
        raise FigureError(
            f"{ask.name}: units of order: {error}; orders of the mesh, or a frequency"
        ) from error


def joined(series: list[plot.Series], axis: str) -> list[plot.Series]:
    """Join single points that differ along one axis alone; a case that is not swept becomes a level.

    Points whose places were drawn at random stay points.
    """
    series = [replace(curve, key={k: v for k, v in curve.key.items() if k != axis}) for curve in series]
    groups: dict[tuple[object, ...], list[plot.Series]] = {}
    for curve in series:
        groups.setdefault((tuple(sorted(curve.key.items())), curve.up, curve.look), []).append(curve)
    places = np.concatenate([curve.x for curve in series])
    if not np.isfinite(places).any():
        raise FigureError(
            f'x = {axis!r} has names, not numbers: kind = "cases" draws a number beside each name'
        )
    return [_join(group, places) for group in groups.values()]


def _join(group: list[plot.Series], places: Array) -> plot.Series:
    whole = plot.merged(group)
    if np.isnan(whole.x).all():
        return plot.horizontal(group[0], places)
    held = whole.at(np.isfinite(whole.x) & np.isfinite(whole.y))
    steps = np.diff(held.x)
    mixed = len(whole.x) > FEWEST_DOTS and (steps > 0).any() and (steps < 0).any()
    return replace(held.at(np.argsort(held.x, kind="stable")), look="dots" if mixed else whole.look)

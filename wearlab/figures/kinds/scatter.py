"""One point a run: a result over an input or over another result, and all inputs beside each other."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Look, Mark, Scale, Series, horizontal, merged
from wearlab.figures.runs import Run
from wearlab.figures.slices import Slice, companion, lone, slices
from wearlab.figures.wording import Label, typeset

MANY = 60  # points, from which on they are drawn small
NUMBERED = ("sample", "scene")  # axes that only count runs
SHARE = Scale("share of each range", "1")


def _points(run: Run, ask: Ask) -> Iterator[Series]:
    for piece in _results(run, ask):
        x, across, own = _abscissa(run, ask, piece)
        key = {n: label for n, label in piece.key.items() if n not in run.place} | _told_apart(run, ask)
        point = Series(key, x, np.atleast_1d(piece.values), across, piece.scale, "points", own=own)
        yield replace(point, y_error=piece.error)


def _results(run: Run, ask: Ask) -> Iterator[Slice]:
    """Yield the result at each place along its dimensions, at the last wear state when none is selected."""
    name = ask.y[0]
    if "update" in run.data[name].dims and run.data.sizes["update"] > 1:
        run = replace(run, data=run.data.isel(update=[-1]), states=run.states[-1:])
    for piece in slices(run, name, ask):
        yield piece._replace(key={n: label for n, label in piece.key.items() if n != "update"})


def _told_apart(run: Run, ask: Ask) -> dict[str, Label]:
    names = (ask.hue, ask.rows, ask.cols)
    return {n: run.along(n) for n in names if n is not None and (n in run.place or n in run.beside)}


def _inputs(run: Run) -> list[str]:
    """Return the axes, and what advances with them, those that only count runs apart."""
    names = [name for name in dict.fromkeys((*run.place, *run.beside)) if name != "case"]
    return [name for name in names if name not in NUMBERED] or names


def _abscissa(run: Run, ask: Ask, piece: Slice) -> tuple[Array, Scale, float | None]:
    inputs = _inputs(run)
    name = ask.x or next(iter(inputs), None)
    if name is None:
        raise FigureError(f"{ask.name}: x must name an axis or a result; {choices('', run.data.data_vars)}")
    if name in run.place or name in run.beside:
        x, own = run.abscissa(name)
        scale = Scale(run.words.get(name, name.replace("_", " ")), run.units.get(name, "1"))
        return np.array([x]), scale, own
    if name not in run.data.variables:
        raise FigureError(f"{ask.name}: x = {name!r} is not there; {choices(name, [*inputs, *run.data])}")
    data = run.data.isel(update=[-1]) if "update" in run.data[name].dims else run.data
    return *lone(*companion(replace(run, data=data), name, piece.place, ask), name, ask), None


def _gathered(series: list[Series]) -> list[Series]:
    """Join the points that nothing tells apart; a case without a place on x becomes a level."""
    groups: dict[tuple[object, ...], list[Series]] = {}
    for curve in series:
        groups.setdefault(tuple(sorted(curve.key.items())), []).append(curve)
    look: Look = "dots" if len(series) > MANY else "points"
    places = np.concatenate([curve.x for curve in series])
    placed = places[np.isfinite(places)]
    gathered = []
    for group in groups.values():
        whole = merged(group)
        if placed.size and np.isnan(whole.x).all():
            gathered += [horizontal(curve, placed) for curve in group]
            continue
        gathered.append(replace(whole.at(np.isfinite(whole.x) & np.isfinite(whole.y)), look=look))
    return gathered


def _polyline(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a run's inputs and its result as they are; `_ranged` puts them on their ranges."""
    names = _inputs(run)
    if any(isinstance(run.along(name).value, str) for name in names):
        return  # a case beside the axes
    for piece in _results(run, ask):
        result = np.atleast_1d(piece.values)
        if not np.isfinite(result).all():
            continue
        values = np.array([*(float(run.along(name).value) for name in names), float(result[0])])
        marks = [Mark(float(at), _head(run, name)) for at, name in enumerate(names)]
        marks.append(Mark(float(len(names)), f"{piece.scale.words}|{piece.scale.units}"))
        key = {n: label for n, label in piece.key.items() if n not in run.place}
        colour = Label(float(result[0]), f"{result[0]:.4g} {typeset(piece.scale.units)}".strip())
        places = np.arange(len(values), dtype=float)
        key |= {"result": colour}
        yield Series(key, places, values, Scale("", "1"), piece.scale, "hairline", marks=tuple(marks))


def _head(run: Run, name: str) -> str:
    return f"{run.words.get(name, name.replace('_', ' '))}|{run.units.get(name, '1')}"


def _ranged(series: list[Series]) -> list[Series]:
    """Put every axis on its own range; its words and its ends stand above it."""
    table = np.array([curve.y for curve in series])
    low, high = table.min(axis=0), table.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    marks = tuple(
        Mark(mark.x, f"{words}\n{a:.3g} … {b:.3g} {typeset(units)}".rstrip())
        for mark, a, b in zip(series[0].marks, low, high, strict=True)
        for words, _, units in [mark.text.partition("|")]
    )
    return [replace(curve, y=(curve.y - low) / width, up=SHARE, marks=marks) for curve in series]


SCATTER = Kind(
    name="scatter",
    title="",
    shows="one point a run: a result y (at the last wear state) over an input or another result x",
    needs=("life",),
    dims=(),
    series=_points,
    roles=(("hue", "flank"), ("hue", "member"), ("cols", "mesh")),
    all_cases=True,
    over_sweeps=True,
    joined=_gathered,
    y="life",
)
PARALLEL = Kind(
    name="parallel-coordinates",
    title="Inputs and result of every run",
    shows="one line a run across all inputs and the result y, coloured by the result",
    needs=("life",),
    dims=(),
    series=_polyline,
    roles=(("hue", "result"), ("cols", "flank"), ("cols", "mesh")),
    all_cases=True,
    one_flank=True,
    joined=_ranged,
    y="life",
)

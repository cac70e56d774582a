"""Numbers of runs: beside their names, over inputs, ranked by influence.

Cases named ``what: value`` differ in this ``what`` alone from the case without a colon
in its name; other cases stand each for themselves. A sweep is an influence: the mean
result at each of its places over all others. So is a sampled input: the mean result in
bins of equally many runs.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import plot, runs, wording
from wearlab.figures.kind import (
    FigureError,
    FigureRequest,
    Run,
    Slice,
    companion,
    kind,
    labels_of_roles,
    lone,
    shown,
    slices,
)
from wearlab.figures.plot import Mark, Scale, Series, flat, grouped
from wearlab.nearest import choices

DEPTH = "max_wear_depth"
MAX_NAMES = 80
"""Runs that can be listed by name."""
MAX_POINTS = 60
"""Points that are drawn large."""
MAX_PLACES = 20
"""Places of an axis that are shown one by one."""
COUNTERS = ("seed", "sample", "run")
"""Axes that only count runs."""
RANK = Scale("order of influence", "1")


def _numbers(run: Run, request: FigureRequest) -> Iterator[Series]:
    """One number of every run, at its last wear state, beside the run's name.

    Yield a run's number, at its last wear state where none is selected, named by its
    place in the grid.
    """
    texts = dict.fromkeys(label.text for label in run.place.values())
    name = ", ".join(texts) or "run"
    for piece in slices(run.at_states([-1]), request.y[0], request):
        key = plot.without(piece.key, *run.place, "update")
        key["run"] = wording.Label(name, name)
        yield Series(
            key=key,
            x=np.atleast_1d(piece.values),
            y=np.zeros(1),
            x_scale=piece.scale,
            y_scale=Scale("run", "1"),
            style="points",
            x_error=piece.error,
        )


def listed(series: list[Series]) -> list[Series]:
    """Join the numbers that differ in the run alone, one below the other.

    In the order of the file.

    Parameters
    ----------
    series : one number each

    Raises
    ------
    FigureError : more names than can be read
    """
    names = tuple(dict.fromkeys(curve.key["run"].text for curve in series))
    if len(names) > MAX_NAMES:
        raise FigureError(
            f"cases: {len(names)} runs cannot be told by name (at most {MAX_NAMES}): "
            "narrow them with select, or take histogram or scatter"
        )
    numbers = []
    for curve in series:
        place = np.array([1.0 + names.index(curve.key["run"].text)])
        key = plot.without(curve.key, "run")
        numbers.append(replace(curve, key=key, y=place, names=names))
    rows = [plot.merged(group) for group in grouped(numbers).values()]

    if len(rows) == 1 and len(names) > 1:
        first = rows[0]
        y, x = flat((0.5, len(names) + 0.5), first.x[0])
        reference = Series(
            key={},
            x=x,
            y=y,
            x_scale=first.x_scale,
            y_scale=first.y_scale,
            style="reference",
            text=names[0],
            names=names,
        )
        rows.append(reference)
    return rows


CASES = kind(
    "cases",
    "",
    (DEPTH,),
    roles=(("hue", "*"),),
    all_cases=True,
    ranks=True,
    y=DEPTH,
    titled="{}",
    joined=listed,
    along_x=True,
)(_numbers)


def _points(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield one point for each run."""
    for piece in slices(run.at_states([-1]), request.y[0], request):
        abscissa = _abscissa(run, request, piece)
        key = plot.without(piece.key, *run.place, "update")
        key |= labels_of_roles(run.along, request)
        point = piece._replace(key=key)
        yield point.over(
            abscissa.values, abscissa.scale, "points", case_x=abscissa.case_value
        )


class _Abscissa(NamedTuple):
    """Where a run stands on x: its value, and that of a case beside a sweep."""

    values: Array
    scale: Scale
    case_value: float | None


def _inputs(run: Run) -> list[str]:
    """Return the axes, and what advances with them, without those that count runs."""
    names = [name for name in run.along if name != "case"]
    return [name for name in names if name not in ("sample", "scene")] or names


def _abscissa(run: Run, request: FigureRequest, piece: Slice) -> _Abscissa:
    """Return where a run stands on x: along an axis, or by another result."""
    inputs = _inputs(run)
    name = request.x or next(iter(inputs), None)
    if name is None:
        raise request.error(
            f"x must name an axis or a result; {choices('', run.data.data_vars)}"
        )
    if name in run.along:
        x, case_value = run.abscissa(name)
        return _Abscissa(np.array([x]), run.scales[name], case_value)
    if name not in run.data.variables:
        raise request.error(
            f"x = {name!r} is not there; {choices(name, [*inputs, *run.data])}"
        )
    values, scale = companion(run.at_states([-1]), name, piece.place, request)
    value, scale = lone(values, scale, name, request)
    return _Abscissa(value, scale, None)


def _gathered(series: list[Series]) -> list[Series]:
    """Join the points that nothing tells apart.

    A case without a place on x becomes a level.
    """
    if len(series) <= MAX_POINTS:
        return plot.gathered(series)
    return [
        replace(curve, style="dots") if curve.style == "points" else curve
        for curve in plot.gathered(series)
    ]


def _polyline(run: Run, request: FigureRequest) -> Iterator[Series]:
    """One line a run across all inputs and the result y, coloured by the result.

    Yield a run's inputs and its result as they are; `_ranged` puts them on their
    ranges.
    """
    names = _inputs(run)
    if any(isinstance(run.along[name].value, str) for name in names):
        return  # a case beside the axes
    inputs = [float(run.along[name].value) for name in names]
    for piece in slices(run.at_states([-1]), request.y[0], request):
        result = np.atleast_1d(piece.values)
        if not np.isfinite(result).all():
            continue

        scales = [*(run.scales[name] for name in names), piece.scale]
        marks = [Mark(float(at), "|".join(scale)) for at, scale in enumerate(scales)]
        text = f"{result[0]:.4g} {wording.typeset(piece.scale.units)}".strip()
        key = plot.without(piece.key, *run.place, "update")
        key["result"] = wording.Label(float(result[0]), text)
        yield Series(
            key=key,
            x=np.arange(len(scales), dtype=float),
            y=np.array([*inputs, float(result[0])]),
            x_scale=Scale("", "1"),
            y_scale=piece.scale,
            style="hairline",
            marks=tuple(marks),
        )


def _ranged(series: list[Series]) -> list[Series]:
    """Put every axis on its own range; its words and its ends stand above it."""
    table = np.array([curve.y for curve in series])
    low = table.min(axis=0)
    high = table.max(axis=0)
    width = np.where(high > low, high - low, 1.0)

    marks = []
    for mark, minimum, maximum in zip(series[0].marks, low, high, strict=True):
        words, _, units = mark.text.partition("|")
        ends = f"{minimum:.3g} … {maximum:.3g} {wording.typeset(units)}"
        marks.append(Mark(mark.x, f"{words}\n{ends}".rstrip()))
    scale = Scale("share of each range", "1")
    return [
        replace(curve, y=(curve.y - low) / width, y_scale=scale, marks=tuple(marks))
        for curve in series
    ]


SCATTER = kind(
    "scatter",
    "",
    ("life",),
    roles=(("hue", "flank"), ("hue", "member"), ("cols", "mesh")),
    all_cases=True,
    over_sweeps=True,
    joined=_gathered,
    y="life",
    shows="one point a run: a result y (at the last wear state) over an input or "
    "another result x",
)(_points)
PARALLEL = kind(
    "parallel-coordinates",
    "Inputs and result of every run",
    ("life",),
    roles=(("hue", "result"), ("cols", "flank"), ("cols", "mesh")),
    all_cases=True,
    one_flank=True,
    joined=_ranged,
    y="life",
)(_polyline)


def _case(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield a run's value as one point.

    `ranked` puts the points of one influence on one line.
    """
    name = request.y[0]
    values, scale = shown(run.data[name], name, request)
    value, scale = lone(values, scale, name, request)
    if not np.isfinite(value).all():
        return

    influence = _influence_of(run)
    key = {"influence": wording.Label(influence, influence)}
    if not influence:
        # a case that is broadcast stands nowhere along the axes; keys that advance with
        # an axis stand for it
        axes = plot.without(run.along, "case").items()
        places = {run.scales[axis].label: label for axis, label in axes}
        key = {**places, **key}
    yield Series(
        key=key,
        x=value.reshape(1),
        y=np.zeros(1),
        x_scale=scale,
        y_scale=RANK,
        style="line-points",
    )


def _influence_of(run: Run) -> str:
    """Return what a case varies: its label before the colon, "" for the base."""
    case = run.place.get("case")
    label = runs.BASE if case is None else str(case.value)
    influence, colon, _ = label.partition(": ")
    if colon:
        return influence
    return "" if label == runs.BASE else label


def ranked(series: list[Series]) -> list[Series]:
    """Join the points of every influence, the one with the widest range first.

    The base becomes a line.

    Parameters
    ----------
    series : a point for each run, its influence in its key

    Raises
    ------
    FigureError : nothing varies
    """
    cases: dict[str, list[float]] = defaultdict(list)
    for curve in series:
        cases[curve.key["influence"].text].append(float(curve.x[0]))
    base = _take_base(cases)
    level = [float(np.mean(base))] if base else []

    groups = {
        influence: np.array(values + level) for influence, values in cases.items()
    }
    groups |= _of_axes([curve for curve in series if not curve.key["influence"].text])
    groups = {
        influence: np.sort(values)
        for influence, values in groups.items()
        if len(values) > 1
    }
    if not groups:
        raise FigureError(
            "nothing varies in this result: sweeps, samples or cases are needed, such "
            "as [[case]] with "
            'label = "torque: 300 N·m"; or none of the runs has a finite result'
        )

    order = sorted(
        groups, key=lambda influence: np.ptp(groups[influence]), reverse=True
    )
    names = tuple(influence.replace("_", " ") for influence in order)
    x_scale = series[0].x_scale
    ranks = []
    for rank, influence in enumerate(order, 1):
        x = groups[influence]
        y = np.full(len(x), float(rank))
        ranks.append(Series({}, x, y, x_scale, RANK, "line-points", names=names))
    if level:
        y, x = flat((0.5, len(order) + 0.5), level[0])
        text = "base" if len(base) == 1 else "mean of the base runs"
        ranks.append(Series({}, x, y, x_scale, RANK, "reference", text))
    return ranks


def _take_base(cases: dict[str, list[float]]) -> list[float]:
    """Take the values of the base out of those of the cases.

    Without base runs, one case without a colon in its name is the base of the others.
    """
    base = cases.pop("", [])
    has_groups = any(len(values) > 1 for values in cases.values())
    if not base and len(cases) > 1 and has_groups:
        single = [name for name, values in cases.items() if len(values) == 1]
        return cases.pop(single[0]) if single else []
    return base


def _of_axes(outcomes: Sequence[Series]) -> dict[str, Array]:
    """Return the mean results along every axis and every key that advances with one."""
    values = np.array([float(outcome.x[0]) for outcome in outcomes])
    names: dict[str, None] = {}
    for outcome in outcomes:
        names |= dict.fromkeys(plot.without(outcome.key, "influence"))

    means = {}
    for name in names:
        labels = [outcome.key.get(name) for outcome in outcomes]
        places = [None if label is None else label.value for label in labels]
        distinct = list(dict.fromkeys(places))
        only_counts = len(distinct) == len(places) and name in COUNTERS
        if len(distinct) >= 2 and not only_counts:
            means[name] = _means_along(places, distinct, values)
    return means


def _means_along(places: list[Any], distinct: list[Any], values: Array) -> Array:
    """Return the mean value at every distinct place, or in bins of equal counts."""
    has_texts = any(isinstance(place, str) for place in distinct)
    if len(distinct) <= MAX_PLACES or has_texts:
        groups = [np.array([value == place for value in places]) for place in distinct]
    else:
        bins = min(8, len(values) // 4)
        groups = np.array_split(np.argsort(np.array(places, float)), bins)
    return np.array([values[group].mean() for group in groups], float)


SENSITIVITY = kind(
    "sensitivity",
    "Order of influence",
    ("life",),
    roles=(),
    all_cases=True,
    ranks=True,
    joined=ranked,
    titled="What moves the {}",
    along_x=True,
    shows="the range of one result over cases named 'what: value', over sweeps and "
    "over sampled inputs "
    "(means over all else), one line for each, widest first",
)(_case)

"""Numbers of runs: beside their names, over inputs, ranked by influence.

And how they scatter.

Cases named ``what: value`` differ in this ``what`` alone from the case without a colon
in its name; other cases stand each for themselves. A sweep is an influence: the mean
result at each of its places over all others. So is a sampled input: the mean result in
bins of equally many runs.

What scatters is a sample: all runs that differ in nothing that ``hue``, ``rows`` or
``cols`` names. Quantiles come with the confidence that order statistics give, whatever
the distribution.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import curves as curves_of_runs
from wearlab.figures import plot, runs, wording
from wearlab.figures.kind import (
    FigureError,
    FigureRequest,
    Run,
    Slice,
    companion,
    kind,
    lone,
    shown,
    slices,
)
from wearlab.figures.kinds.cycles import at_states, hours_a_cycle
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
CONFIDENCE = 0.95
TAIL = 0.5 * (1.0 - CONFIDENCE)
COUNT = Scale("runs", "1")
FEWEST = 3
"""Runs of a distribution, at least."""


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
        key |= _labels_of_roles(run.along, request)
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


class Quantile(NamedTuple):
    """A quantile of a sample, and its interval of `CONFIDENCE`."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class OfRun(Series):
    """What one run adds to a sample; ``x`` and ``y`` hold its values.

    Parameters
    ----------
    ended : what it counts as beyond its end
    """

    ended: curves_of_runs.Ended = "gone"


def quantile(values: Array, probability: float) -> Quantile:
    """Return a quantile of a sample with its distribution-free confidence interval.

    The number of values below the true quantile is binomial, so that two order
    statistics enclose it with a known probability; the innermost pair with at least
    `CONFIDENCE`, or the ends of the sample.

    Parameters
    ----------
    values : (n,) any unit
    probability : of staying below it
    """
    from scipy.stats import binom

    ordered = np.sort(values)
    n = len(values)
    low = int(binom.ppf(TAIL, n, probability)) - 1
    high = int(binom.ppf(1.0 - TAIL, n, probability))
    value = float(np.quantile(ordered, probability, method="median_unbiased"))
    return Quantile(
        value, float(ordered[max(low, 0)]), float(ordered[min(high, n - 1)])
    )


def histogram(values: Array) -> tuple[Array, Array]:
    """Return edges of bins and the numbers of values in them.

    The bins are as wide as Freedman and Diaconis have them, at most 60.

    Parameters
    ----------
    values : (n,) any unit
    """
    quartiles = np.quantile(values, [0.75, 0.25])
    width = 2.0 * float(np.subtract(*quartiles)) / np.cbrt(len(values))
    bins = 1
    if width > 0.0:
        bins = min(60, max(1, ceil(float(np.ptp(values)) / width)))
    counts, edges = np.histogram(values, bins)
    return edges, counts.astype(float)


def _one_number(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the one number of a run."""
    name = request.y[0]
    values, scale = shown(run.data[name], name, request)
    value, scale = lone(values, scale, name, request)
    key = _labels_of_roles(run.place, request)
    yield OfRun(key, value, np.zeros(1), scale, COUNT)


def _labels_of_roles(
    key: Mapping[str, wording.Label], request: FigureRequest
) -> dict[str, wording.Label]:
    """Return the labels along the dimensions that the figure names."""
    return {
        name: key[name]
        for name in (request.hue, request.rows, request.cols)
        if name is not None and name in key
    }


def _values(group: Sequence[Series]) -> Array:
    """Return the finite numbers of a sample, refuse too few."""
    values = np.concatenate([curve.x for curve in group])
    finite = values[np.isfinite(values)]
    if len(finite) < FEWEST:
        raise FigureError(
            f"a distribution needs at least {FEWEST} runs; there are {len(finite)}"
        )
    return finite


def _histograms(series: list[Series]) -> list[Series]:
    """Return the outline of every sample, its quantiles as marks, their confidence."""
    groups = grouped(series).values()
    curves: list[Series] = []
    for group in groups:
        values = _values(group)
        edges, counts = histogram(values)
        x, y = plot.bars(edges, counts)
        outline = Series(group[0].key, x, y, group[0].x_scale, COUNT, "area")
        curves.append(outline)
        for probability in (0.05, 0.5, 0.95):
            curves += _quantile_curves(
                outline, values, probability, is_single=len(groups) == 1
            )
    return curves


def _quantile_curves(
    outline: Series, values: Array, probability: float, is_single: bool
) -> list[Series]:
    """Return a quantile of a histogram as a line, its confidence as a strip above.

    A single sample has the quantile's name at the line, and its numbers in the legend.
    """
    number = quantile(values, probability)
    name = f"{100 * probability:g} %"
    top = float(outline.y.max())
    low = 1.03 * top
    high = 1.08 * top
    x, y = plot.band(
        np.array([number.low, number.high]), np.full(2, low), np.full(2, high)
    )
    line_y, line_x = flat((0.0, high), number.value)

    text = ""
    marks: tuple[Mark, ...] = ()
    if is_single:
        text = f"{name}: {_quantile_text(number, outline.x_scale.units)}"
        marks = (Mark(number.value, name),)
    return [
        replace(outline, x=x, y=y, text=text),
        replace(outline, x=line_x, y=line_y, style="hairline", marks=marks),
    ]


def _quantile_text(number: Quantile, units: str) -> str:
    """Return a quantile and its interval in words, large counts in thousands."""
    divisor = 1.0
    words = wording.joined(units)
    if units == "1" and number.value >= 1e6:
        divisor = 1e6
        words = " million"
    elif units == "1" and number.value >= 1e4:
        divisor = 1e3
        words = " thousand"
    value, low, high = (f"{part / divisor:.3g}" for part in number)
    return f"{value} ({low}–{high}){words}".rstrip()


def _probabilities(series: list[Series]) -> list[Series]:
    """Return every sample over the scores of its ranks, and its log-normal law.

    Hazen's places ``(i − ½)/n``. The law has the mean and standard deviation of the
    logarithms; the limits hold each order statistic of such a sample with `CONFIDENCE`
    (a beta distribution of its rank).
    """
    curves: list[Series] = []
    for group in grouped(series).values():
        curves += _probability_curves(group[0], np.log10(np.sort(_values(group))))
    return curves


def _probability_curves(first: Series, logs: Array) -> list[Series]:
    """Return a sample's logarithms over their scores, the limits, and the law."""
    from scipy.stats import beta, norm

    count = len(logs)
    rank = np.arange(1, count + 1)
    scores = norm.ppf((rank - 0.5) / count)
    mean = float(logs.mean())
    spread = float(logs.std(ddof=1))
    limits = [
        mean + spread * norm.ppf(beta.ppf(share, rank, count + 1 - rank))
        for share in (TAIL, 1.0 - TAIL)
    ]

    label, unit = first.x_scale
    in_units = f" in {unit}" if unit != "1" else ""
    sample = Series(
        key=first.key,
        x=logs,
        y=scores,
        x_scale=Scale(f"log₁₀ of {label}{in_units}", "1"),
        y_scale=Scale("standard score of the share of runs", "1"),
        style="dots",
    )
    limit_scores, limit_logs = plot.band(scores, *limits)
    ends = scores[[0, -1]]
    return [
        sample,
        replace(sample, x=limit_logs, y=limit_scores, style="area"),
        replace(sample, x=mean + spread * ends, y=ends, style="line"),
    ]


def _over_life(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable over the life of a run."""
    name = request.y[0]
    for piece in slices(run, name, request, "update"):
        x, x_scale = at_states(run, request, piece)
        yield OfRun(
            key=_labels_of_roles(piece.key, request),
            x=x,
            y=piece.values,
            x_scale=x_scale,
            y_scale=piece.scale,
            hours=hours_a_cycle(run, request),
            ended=curves_of_runs.ended_of(name),
        ).known


def _bands(series: list[Series]) -> list[Series]:
    """Return median and bands of every sample.

    A run at its limit counts as deeper, not as flat.

    Between its wear states a run is taken as straight. A line ends where it would tell
    the value of a run that has ended; a remaining life ends at zero.
    """
    curves: list[Series] = []
    for group in grouped(series).values():
        if len(group) < FEWEST:
            raise FigureError(
                f"a distribution needs at least {FEWEST} runs; there are {len(group)}"
            )
        curves += curves_of_runs.banded(group, getattr(group[0], "ended", "gone"))
    return curves


HISTOGRAM = kind(
    "histogram",
    "Distribution of the life",
    ("life",),
    joined=_histograms,
    titled="Distribution of the {}",
    along_x=True,
    shows="how one number of each run is distributed, with its 5, 50 and 95 % "
    "quantiles and their "
    "95 % confidence",
)(_one_number)
PROBABILITY = kind(
    "probability",
    "Log-normal probability plot",
    ("life",),
    joined=_probabilities,
    titled="Log-normal probability plot: {}",
    along_x=True,
    shows="one number of each run in order against the score of its rank, beside the "
    "log-normal law with the "
    "same mean and spread of the logarithms; 95 % of each rank of such a sample lies "
    "in the band",
)(_one_number)
QUANTILE_BANDS = kind(
    "quantile-bands",
    "Largest wear depth of all runs",
    ("max_wear_depth", "cycle"),
    ("update",),
    one_flank=True,
    joined=_bands,
    titled="{} of all runs",
    shows="median, 25–75 % and 5–95 % bands of a variable over the cycles, of all "
    "runs; a run "
    "at its limit counts as deeper",
)(_over_life)

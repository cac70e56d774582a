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
from wearlab.figures import curves as of_samples
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
from wearlab.figures.plot import LineStyle, Mark, Scale, Series, flat, grouped
from wearlab.nearest import choices

DEPTH = "max_wear_depth"


def _numbers(run: Run, request: FigureRequest) -> Iterator[Series]:
    """One number of every run, at its last wear state, beside the run's name.

    Yield a run's number, at its last wear state where none is selected, named by its
    place in the grid.
    """
    called = (
        ", ".join(dict.fromkeys(label.text for label in run.place.values())) or "run"
    )
    for piece in slices(run.at_states([-1]), request.y[0], request):
        named = plot.without(piece.key, *run.place, "update") | {
            "run": wording.Label(called, called)
        }
        values = np.atleast_1d(piece.values)
        scales = piece.scale, Scale("run", "1")
        yield Series(named, values, np.zeros(1), *scales, "points", x_error=piece.error)


def listed(series: list[Series]) -> list[Series]:
    """Join the numbers of what is not the run, one below the other in the order of the file.

    Raises
    ------
    FigureError : more names than can be read
    """
    names = tuple(dict.fromkeys(curve.key["run"].text for curve in series))
    if len(names) > 80:
        said = f"cases: {len(names)} runs cannot be told by name (at most 80)"
        raise FigureError(
            f"{said}: narrow them with select, or take histogram or scatter"
        )
    places = [np.array([1.0 + names.index(curve.key["run"].text)]) for curve in series]
    apart = [plot.without(curve.key, "run") for curve in series]
    told = [
        replace(c, key=k, y=y, names=names)
        for c, k, y in zip(series, apart, places, strict=True)
    ]
    rows = [plot.merged(group) for group in grouped(told).values()]
    if len(rows) == 1 and len(names) > 1:
        first = rows[0]
        level = flat((0.5, len(names) + 0.5), first.x[0])[::-1]
        rows.append(
            Series(
                {},
                *level,
                first.x_scale,
                first.y_scale,
                "reference",
                names[0],
                names=names,
            )
        )
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
    """One point a run: a result y (at the last wear state) over an input or another result x."""
    for piece in slices(run.at_states([-1]), request.y[0], request):
        x, x_scale, own = _abscissa(run, request, piece)
        key = plot.without(piece.key, *run.place, "update") | _kept(run.along, request)
        yield piece._replace(key=key).over(x, x_scale, "points", case_x=own)


def _inputs(run: Run) -> list[str]:
    """Return the axes, and what advances with them, those that only count runs apart."""
    names = [name for name in run.along if name != "case"]
    return [name for name in names if name not in ("sample", "scene")] or names


def _abscissa(
    run: Run, request: FigureRequest, piece: Slice
) -> tuple[Array, Scale, float | None]:
    inputs = _inputs(run)
    name = request.x or next(iter(inputs), None)
    if name is None:
        raise request.error(
            f"x must name an axis or a result; {choices('', run.data.data_vars)}"
        )
    if name in run.along:
        x, own = run.abscissa(name)
        return np.array([x]), run.scales[name], own
    if name not in run.data.variables:
        raise request.error(
            f"x = {name!r} is not there; {choices(name, [*inputs, *run.data])}"
        )
    return *lone(
        *companion(run.at_states([-1]), name, piece.place, request), name, request
    ), None


def _gathered(series: list[Series]) -> list[Series]:
    """Join the points that nothing tells apart.

    A case without a place on x becomes a level.
    """
    style: LineStyle = "dots" if len(series) > 60 else "points"
    return [
        replace(c, style=style) if c.style == "points" else c
        for c in plot.gathered(series)
    ]


def _polyline(run: Run, request: FigureRequest) -> Iterator[Series]:
    """One line a run across all inputs and the result y, coloured by the result.

    Yield a run's inputs and its result as they are; `_ranged` puts them on their
    ranges.
    """
    names = _inputs(run)
    if any(isinstance(run.along[name].value, str) for name in names):
        return  # a case beside the axes
    for piece in slices(run.at_states([-1]), request.y[0], request):
        result = np.atleast_1d(piece.values)
        if not np.isfinite(result).all():
            continue
        values = np.array(
            [*(float(run.along[name].value) for name in names), float(result[0])]
        )
        scales = [*(run.scales[name] for name in names), piece.scale]
        marks = [Mark(float(at), "|".join(scale)) for at, scale in enumerate(scales)]
        key = plot.without(piece.key, *run.place, "update")
        text = f"{result[0]:.4g} {wording.typeset(piece.scale.units)}".strip()
        key |= {"result": wording.Label(float(result[0]), text)}
        places = np.arange(len(values), dtype=float)
        yield Series(
            key,
            places,
            values,
            Scale("", "1"),
            piece.scale,
            "hairline",
            marks=tuple(marks),
        )


def _ranged(series: list[Series]) -> list[Series]:
    """Put every axis on its own range; its words and its ends stand above it."""
    table = np.array([curve.y for curve in series])
    low = table.min(axis=0)
    high = table.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    marks = []
    for mark, a, b in zip(series[0].marks, low, high, strict=True):
        words, _, units = mark.text.partition("|")
        marks.append(
            Mark(
                mark.x, f"{words}\n{a:.3g} … {b:.3g} {wording.typeset(units)}".rstrip()
            )
        )
    told: Any = {"y_scale": Scale("share of each range", "1"), "marks": tuple(marks)}
    return [replace(curve, y=(curve.y - low) / width, **told) for curve in series]


SCATTER = kind(
    "scatter",
    "",
    ("life",),
    roles=(("hue", "flank"), ("hue", "member"), ("cols", "mesh")),
    all_cases=True,
    over_sweeps=True,
    joined=_gathered,
    y="life",
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


RANK = Scale("order of influence", "1")


def _case(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield a run's value as one point.

    `ranked` puts the points of one influence on one line.
    """
    name = request.y[0]
    values, scale = lone(*shown(run.data[name], name, request), name, request)
    if not np.isfinite(values).all():
        return
    case = run.place.get("case")
    label = runs.BASE if case is None else str(case.value)
    what, between, _ = label.partition(": ")
    what = what if between else "" if label == runs.BASE else label
    # a case that is broadcast stands nowhere along the axes; keys that advance with an
    # axis stand for it
    axes = (
        {}
        if what
        else {
            run.scales[n].label: x for n, x in plot.without(run.along, "case").items()
        }
    )
    key = {**axes, "influence": wording.Label(what, what)}
    yield Series(key, values.reshape(1), np.zeros(1), scale, RANK, "line-points")


def ranked(series: list[Series]) -> list[Series]:
    """Join the points of every influence, the one with the widest range first.

    The base becomes a line.

    Raises
    ------
    FigureError : nothing varies
    """
    cases: dict[str, list[float]] = defaultdict(list)
    for curve in series:
        cases[curve.key["influence"].text].append(float(curve.x[0]))
    base = cases.pop("", [])
    if len(base) == 0 and len(cases) > 1 and any(len(v) > 1 for v in cases.values()):
        # one case without a colon in its name is the base of the others
        alone = [name for name, values in cases.items() if len(values) == 1]
        base = cases.pop(alone[0]) if alone else []
    level = [float(np.mean(base))] if base else []
    groups = {what: np.array(values + level) for what, values in cases.items()}
    groups |= _of_axes([curve for curve in series if not curve.key["influence"].text])
    groups = {
        what: np.sort(values) for what, values in groups.items() if len(values) > 1
    }
    if not groups:
        raise FigureError(
            "nothing varies in this result: sweeps, samples or cases are needed, such "
            "as [[case]] with "
            'label = "torque: 300 N·m"; or none of the runs has a finite result'
        )
    order = sorted(groups, key=lambda what: np.ptp(groups[what]), reverse=True)
    names = tuple(what.replace("_", " ") for what in order)
    scales = (series[0].x_scale, RANK)
    lines = [
        (groups[what], np.full(len(groups[what]), float(rank)))
        for rank, what in enumerate(order, 1)
    ]
    ranks = [Series({}, *line, *scales, "line-points", names=names) for line in lines]
    if level:
        words = "base" if len(base) == 1 else "mean of the base runs"
        ranks.append(
            Series(
                {},
                *flat((0.5, len(order) + 0.5), level[0])[::-1],
                *scales,
                "reference",
                words,
            )
        )
    return ranks


def _of_axes(outcomes: Sequence[Series]) -> dict[str, Array]:
    """Return the mean results along every axis and every key that advances with one."""
    values = np.array([float(outcome.x[0]) for outcome in outcomes])
    spread = {}
    for name in dict.fromkeys(
        name for each in outcomes for name in plot.without(each.key, "influence")
    ):
        at = [
            outcome.key[name].value if name in outcome.key else None
            for outcome in outcomes
        ]
        distinct = list(dict.fromkeys(at))
        if len(distinct) < 2 or (
            len(distinct) == len(at) and name in ("seed", "sample", "run")
        ):
            continue
        if len(distinct) <= 20 or any(isinstance(x, str) for x in distinct):
            means = [values[[x == place for x in at]].mean() for place in distinct]
        else:  # too many to be shown one by one
            bins = min(8, len(values) // 4)
            means = [
                values[some].mean()
                for some in np.array_split(np.argsort(np.array(at, float)), bins)
            ]
        spread[name] = np.array(means, float)
    return spread


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


CONFIDENCE = 0.95
TAIL = 0.5 * (1.0 - CONFIDENCE)
COUNT = Scale("runs", "1")
FEWEST = 3


class Quantile(NamedTuple):
    """A quantile of a sample: its estimate, and the interval that holds the true one with `CONFIDENCE`."""

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

    ended: of_samples.Ended = "gone"


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
    """Return edges and numbers of values in bins as wide as Freedman and Diaconis have them."""
    width = (
        2.0
        * float(np.subtract(*np.quantile(values, [0.75, 0.25])))
        / np.cbrt(len(values))
    )
    bins = min(60, max(1, ceil(float(np.ptp(values)) / width))) if width > 0.0 else 1
    counts, edges = np.histogram(values, bins)
    return edges, counts.astype(float)


def _one_number(run: Run, request: FigureRequest) -> Iterator[Series]:
    name = request.y[0]
    values, scale = lone(*shown(run.data[name], name, request), name, request)
    yield OfRun(_kept(run.place, request), values, np.zeros(1), scale, COUNT)


def _kept(
    key: Mapping[str, wording.Label], request: FigureRequest
) -> dict[str, wording.Label]:
    """Return the labels that tell samples apart: those along the dimensions that the figure names."""
    return {
        name: key[name]
        for name in (request.hue, request.rows, request.cols)
        if name is not None and name in key
    }


def _values(group: Sequence[Series]) -> Array:
    values = np.concatenate([curve.x for curve in group])
    held = values[np.isfinite(values)]
    if len(held) < FEWEST:
        raise FigureError(
            f"a distribution needs at least {FEWEST} runs; there are {len(held)}"
        )
    return held


def _histograms(series: list[Series]) -> list[Series]:
    """Return the outline of every sample, its quantiles as marks and their confidence above it."""
    groups = grouped(series).values()
    curves: list[Series] = []
    for group in groups:
        values = _values(group)
        key = group[0].key
        scales = (group[0].x_scale, COUNT)
        edges, counts = histogram(values)
        top = float(counts.max())
        units = scales[0].units
        curves.append(Series(key, *plot.bars(edges, counts), *scales, "area"))
        for probability in (0.05, 0.5, 0.95):
            mark = quantile(values, probability)
            name = f"{100 * probability:g} %"
            # its confidence is a strip above the bars
            low = 1.03 * top
            high = 1.08 * top
            strip = plot.band(
                np.array([mark.low, mark.high]), np.full(2, low), np.full(2, high)
            )
            alone = len(groups) == 1
            said = f"{name}: {_said(mark, units)}" if alone else ""
            curves.append(Series(key, *strip, *scales, "area", said))
            marks = (Mark(mark.value, name),) if alone else ()
            curves.append(
                Series(
                    key,
                    *flat((0.0, high), mark.value)[::-1],
                    *scales,
                    "hairline",
                    marks=marks,
                )
            )
    return curves


def _said(marked: Quantile, units: str) -> str:
    """Return a quantile and its interval in words, large counts in thousands or millions."""
    counted = (1e6, " million") if marked.value >= 1e6 else (1e3, " thousand")
    size, words = (
        counted
        if units == "1" and marked.value >= 1e4
        else (1.0, wording.joined(units))
    )
    value, low, high = (f"{number / size:.3g}" for number in marked)
    return f"{value} ({low}–{high}){words}".rstrip()


def _probabilities(series: list[Series]) -> list[Series]:
    """Return every sample in order over the scores of its ranks, and the log-normal law through it.

    Hazen's places ``(i − ½)/n``. The law has the mean and standard deviation of the
    logarithms; the limits hold each order statistic of such a sample with `CONFIDENCE`
    (a beta distribution of its rank).
    """
    from scipy.stats import beta, norm

    curves: list[Series] = []
    for group in grouped(series).values():
        logs = np.log10(np.sort(_values(group)))
        first = group[0]
        label, unit = first.x_scale
        x_scale = Scale(
            f"log₁₀ of {label}" + (f" in {unit}" if unit != "1" else ""), "1"
        )
        n = len(logs)
        rank = np.arange(1, n + 1)
        scores = norm.ppf((rank - 0.5) / n)
        mean = float(logs.mean())
        spread = float(logs.std(ddof=1))
        limits = [
            mean + spread * norm.ppf(beta.ppf(p, rank, n + 1 - rank))
            for p in (TAIL, 1.0 - TAIL)
        ]
        ends = scores[[0, -1]]
        scales = (x_scale, Scale("standard score of the share of runs", "1"))
        curves.append(Series(first.key, logs, scores, *scales, "dots"))
        curves.append(
            Series(first.key, *plot.band(scores, *limits)[::-1], *scales, "area")
        )
        curves.append(Series(first.key, mean + spread * ends, ends, *scales))
    return curves


def _over_life(run: Run, request: FigureRequest) -> Iterator[Series]:
    name = request.y[0]
    for piece in slices(run, name, request, "update"):
        (x, x_scale) = at_states(run, request, piece)
        hours = hours_a_cycle(run, request)
        scales = (x_scale, piece.scale)
        ended = of_samples.ended_of(name)
        yield OfRun(
            _kept(piece.key, request),
            x,
            piece.values,
            *scales,
            hours=hours,
            ended=ended,
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
        curves += of_samples.banded(group, getattr(group[0], "ended", "gone"))
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

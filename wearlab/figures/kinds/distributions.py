"""How numbers of runs scatter: histograms, probability plots, bands over the life.

What scatters is a sample: all runs that differ in nothing that ``hue``, ``rows`` or
``cols`` names. A run that ended before its limit is censored where it ended. Quantiles
come with the confidence that order statistics give, whatever the distribution.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
import xarray as xr

from wearlab import schema
from wearlab.arrays import Array
from wearlab.figures import censoring, plot, wording
from wearlab.figures import curves as curves_of_runs
from wearlab.figures.censoring import TAIL, Quantile, Sample
from wearlab.figures.kind import (
    FigureError,
    FigureRequest,
    Run,
    kind,
    labels_of_roles,
    lone,
    shown,
    slices,
)
from wearlab.figures.kinds.cycles import at_states, hours_a_cycle
from wearlab.figures.plot import Mark, Scale, Series, flat, grouped

COUNT = Scale("runs", "1")
FEWEST = 3
"""Runs of a distribution that reached their limit, at least."""
PROBABILITIES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class OfRun(Series):
    """What one run adds to a sample; ``x`` and ``y`` hold its values.

    Parameters
    ----------
    ended : what it counts as beyond its end
    is_censored : whether ``x`` is where it ended before its limit
    """

    ended: curves_of_runs.Ended = "gone"
    is_censored: bool = False


def histogram(sample: Sample) -> tuple[Array, Array]:
    """Return edges of bins and the numbers of values in them.

    The bins are as wide as Freedman and Diaconis have them, at most 60, and reach over
    censored runs, too.

    Parameters
    ----------
    sample : one number of each run
    """
    values, ends = sample
    quartiles = np.quantile(values, [0.75, 0.25])
    width = 2.0 * float(np.subtract(*quartiles)) / np.cbrt(len(values))
    everything = np.concatenate([values, ends])
    bins = 1
    if width > 0.0:
        bins = min(60, max(1, ceil(float(np.ptp(everything)) / width)))
    edges = np.histogram_bin_edges(everything, bins)
    counts, _ = np.histogram(values, edges)
    return edges, counts.astype(float)


def _one_number(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the one number of a run, or what it came to before its limit."""
    name = request.y[0]
    is_censored = name not in run.data and run.end is not None
    variable = run.data[name] if name in run.data else _end_of(run, name)
    values, scale = shown(variable, name, request)
    value, scale = lone(values, scale, name, request)
    key = labels_of_roles(run.place, request)
    yield OfRun(key, value, np.zeros(1), scale, COUNT, is_censored=is_censored)


def _end_of(run: Run, name: str) -> xr.DataArray:
    """Return what a run came to before its limit, as a life or a service life."""
    value = np.nan
    if run.end is not None:
        value = run.end.cycle if name == "life" else run.end.seconds
    return xr.DataArray(value, attrs=schema.attributes(name))


def _is_censored(curve: Series) -> bool:
    """Say whether a curve tells where a run ended before its limit."""
    return isinstance(curve, OfRun) and curve.is_censored


def _sample(group: Sequence[Series]) -> Sample:
    """Return the finite numbers of a sample, refuse too few."""
    values: list[Array] = [np.zeros(0)]
    ends: list[Array] = [np.zeros(0)]
    for curve in group:
        numbers = ends if _is_censored(curve) else values
        numbers.append(curve.x[np.isfinite(curve.x)])
    sample = Sample(np.concatenate(values), np.concatenate(ends))

    count = len(sample.values)
    if count < FEWEST:
        end = f" of {sample.size}, the others ended before" if len(sample.ends) else ""
        limit = " that reached their limit" if len(sample.ends) else ""
        raise FigureError(
            f"a distribution needs at least {FEWEST} runs{limit}; there are "
            f"{count}{end}"
        )
    return sample


def _noted(curves: list[Series], series: Sequence[Series], text: str) -> list[Series]:
    """Return curves with a caveat that counts the censored runs among series.

    Parameters
    ----------
    curves : as they are drawn
    series : one for each run
    text : what was made of censored runs
    """
    reasons = [curve.ended_by for curve in series if _is_censored(curve)]
    if not reasons:
        return curves
    caveat = (
        f"{len(reasons)} of {len(series)} runs ended before their limit "
        f"({censoring.listed_reasons(reasons)}): {text}."
    )
    return [replace(curves[0], caveat=caveat), *curves[1:]]


def _histograms(series: list[Series]) -> list[Series]:
    """Return the outline of every sample, its quantiles as marks, their confidence."""
    groups = grouped(series).values()
    curves: list[Series] = []
    for group in groups:
        sample = _sample(group)
        edges, counts = histogram(sample)
        x, y = plot.bars(edges, counts)
        outline = Series(group[0].key, x, y, group[0].x_scale, COUNT, "area")
        curves.append(outline)
        if len(sample.ends):
            ends, _ = np.histogram(sample.ends, edges)
            x, y = plot.bars(edges, ends.astype(float))
            text = "ended before the limit"
            curves.append(replace(outline, x=x, y=y, style="hairline", text=text))

        top = max(float(curve.y.max()) for curve in curves if curve.key == outline.key)
        for probability in PROBABILITIES:
            curves += _quantile_curves(
                outline, sample, probability, top, is_single=len(groups) == 1
            )
    return _noted(
        curves,
        series,
        "censored there; quantiles by Kaplan and Meier, no bar where the runs do not "
        "enclose 95 %",
    )


def _quantile_curves(
    outline: Series, sample: Sample, probability: float, top: float, is_single: bool
) -> list[Series]:
    """Return a quantile of a histogram as a line, its confidence as a strip above.

    A single sample has the quantile's name at the line, and its numbers in the legend.
    A quantile that the sample does not enclose has no strip; one that its runs do not
    reach has no line.

    Parameters
    ----------
    outline : bars of the histogram
    sample : one number of each run
    probability : of staying below the quantile
    top : of the highest bar
    is_single : whether there is no other sample
    """
    number = censoring.quantile(sample, probability)
    if not np.isfinite(number.value):
        return []
    name = f"{100 * probability:g} %"
    low = 1.03 * top
    high = 1.08 * top
    line_y, line_x = flat((0.0, high), number.value)

    text = ""
    marks: tuple[Mark, ...] = ()
    if is_single:
        text = f"{name}: {_quantile_text(number, outline.x_scale.units)}"
        marks = (Mark(number.value, name),)
    line = replace(outline, x=line_x, y=line_y, style="hairline", marks=marks)
    if not number.is_enclosed:
        return [replace(line, text=text)]

    ends = np.array([number.low, number.high])
    x, y = plot.band(ends, np.full(2, low), np.full(2, high))
    return [replace(outline, x=x, y=y, text=text), line]


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
    interval = f" ({low}–{high})" if number.is_enclosed else ""
    return f"{value}{interval}{words}".rstrip()


def _probabilities(series: list[Series]) -> list[Series]:
    """Return every sample over the scores of its shares, and its log-normal law."""
    curves: list[Series] = []
    for group in grouped(series).values():
        values, ends = _sample(group)
        logs = Sample(np.log10(values), np.log10(ends))
        curves += _probability_curves(group[0], logs)
    return _noted(
        curves,
        series,
        "censored there; shares by Kaplan and Meier, the law by maximum likelihood",
    )


def _probability_curves(first: Series, logs: Sample) -> list[Series]:
    """Return a sample's logarithms over their scores, the limits, and the law.

    The limits hold each order statistic of a sample of the law with
    `censoring.CONFIDENCE` (a beta distribution of its rank), where no censored run
    leaves the rank open.
    """
    from scipy.stats import beta, norm

    values, shares = censoring.plotting_positions(logs)
    scores = norm.ppf(shares)
    law = censoring.log_normal(logs)

    rank = np.arange(1, len(values) + 1)
    is_known = np.isclose(shares * logs.size + 0.5, rank, rtol=0.0, atol=1e-6)
    limits = []
    for tail in (TAIL, 1.0 - TAIL):
        chance = beta.ppf(tail, rank, logs.size + 1 - rank)
        limits.append(law.mean + law.spread * norm.ppf(chance))

    label, unit = first.x_scale
    in_units = f" in {unit}" if unit != "1" else ""
    points = Series(
        key=first.key,
        x=values,
        y=scores,
        x_scale=Scale(f"log₁₀ of {label}{in_units}", "1"),
        y_scale=Scale("standard score of the share of runs", "1"),
        style="dots",
    )
    known_scores = scores[is_known]
    limit_scores, limit_logs = plot.band(
        known_scores, *(limit[is_known] for limit in limits)
    )
    score_ends = scores[[0, -1]]
    law_ends = law.mean + law.spread * score_ends
    return [
        points,
        replace(points, x=limit_logs, y=limit_scores, style="area"),
        replace(points, x=law_ends, y=score_ends, style="line"),
    ]


def _over_life(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable over the life of a run."""
    name = request.y[0]
    for piece in slices(run, name, request, "update"):
        x, x_scale = at_states(run, request, piece)
        yield OfRun(
            key=labels_of_roles(piece.key, request),
            x=x,
            y=piece.values,
            x_scale=x_scale,
            y_scale=piece.scale,
            hours=hours_a_cycle(run, request),
            ended=curves_of_runs.ended_of(name),
        ).known


def _ended(curve: Series) -> curves_of_runs.Ended:
    """Return what a run counts as beyond its end."""
    return curve.ended if isinstance(curve, OfRun) else "gone"


def _bands(series: list[Series]) -> list[Series]:
    """Return median and bands of every sample.

    A run at its limit counts as deeper, not as flat; one that ended before it counts no
    longer.

    Between its wear states a run is taken as straight. A line ends where it would tell
    the value of a run that has ended; a remaining life ends at zero.
    """
    curves: list[Series] = []
    for group in grouped(series).values():
        if len(group) < FEWEST:
            raise FigureError(
                f"a distribution needs at least {FEWEST} runs; there are {len(group)}"
            )
        curves += curves_of_runs.banded(group, _ended(group[0]))
    note = curves_of_runs.censored_note(series, _ended(series[0]))
    return [replace(curves[0], caveat=note), *curves[1:]]


HISTOGRAM = kind(
    "histogram",
    "Distribution of the life",
    ("life",),
    joined=_histograms,
    titled="Distribution of the {}",
    along_x=True,
    takes_censored=True,
    shows="how one number of each run is distributed, with its 5, 50 and 95 % "
    "quantiles and their 95 % confidence where the runs enclose it; runs that ended "
    "before their limit are censored",
)(_one_number)
PROBABILITY = kind(
    "probability",
    "Log-normal probability plot",
    ("life",),
    joined=_probabilities,
    titled="Log-normal probability plot: {}",
    along_x=True,
    takes_censored=True,
    shows="one number of each run in order against the score of its share, beside the "
    "log-normal law with the same mean and spread of the logarithms; 95 % of each rank "
    "of such a sample lies in the band; runs that ended before their limit are "
    "censored",
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
    "runs; a run at its limit counts as deeper, one that ended before it no longer",
)(_over_life)

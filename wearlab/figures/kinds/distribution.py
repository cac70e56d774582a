"""What a campaign's runs have in common and how they scatter: histogram, probability plot, quantile bands.

A sample is all runs that differ in nothing that ``hue``, ``rows`` or ``cols`` names. Quantiles come with the
confidence that order statistics give, whatever the distribution.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.curves import Ended, banded, ended_of
from wearlab.figures.kind import Ask, FigureError, Run, kind, lone, shown, slices
from wearlab.figures.kinds.cycles import at_states, hours_a_cycle
from wearlab.figures.plot import Mark, Scale, Series, band, bars, flat, grouped
from wearlab.figures.wording import Label, joined

CONFIDENCE = 0.95
TAIL = 0.5 * (1.0 - CONFIDENCE)
QUANTILES = (0.05, 0.5, 0.95)
MOST_BINS = 60
COUNT = Scale("runs", "1")
SCORE = Scale("standard score of the share of runs", "1")
FEWEST = 3
COUNT_WORDS = {0: "", 3: " thousand", 6: " million"}
STRIP = (1.03, 1.08)  # where the confidence of a quantile is drawn, times the highest bar


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

    ended: Ended = "gone"


def quantile(values: Array, probability: float) -> Quantile:
    """Return a quantile of a sample with its distribution-free confidence interval.

    The number of values below the true quantile is binomial, so that two order statistics enclose it with a
    known probability; the innermost pair with at least `CONFIDENCE`, or the ends of the sample.

    Parameters
    ----------
    values : (n,) any unit
    probability : of staying below it
    """
    from scipy.stats import binom

    ordered, n = np.sort(values), len(values)
    low = int(binom.ppf(TAIL, n, probability)) - 1
    high = int(binom.ppf(1.0 - TAIL, n, probability))
    value = float(np.quantile(ordered, probability, method="median_unbiased"))
    return Quantile(value, float(ordered[max(low, 0)]), float(ordered[min(high, n - 1)]))


def histogram(values: Array) -> tuple[Array, Array]:
    """Return edges and numbers of values in bins as wide as Freedman and Diaconis have them."""
    spread = float(np.subtract(*np.quantile(values, [0.75, 0.25])))
    width = 2.0 * spread / np.cbrt(len(values))
    bins = min(MOST_BINS, max(1, ceil(float(np.ptp(values)) / width))) if width > 0.0 else 1
    counts, edges = np.histogram(values, bins)
    return edges, counts.astype(float)


def _one_number(run: Run, ask: Ask) -> Iterator[Series]:
    name = ask.y[0]
    values, scale = lone(*shown(run.data[name], name, ask), name, ask)
    yield OfRun(_kept(run.place, ask), values, np.zeros(1), scale, COUNT)


def _kept(key: Mapping[str, Label], ask: Ask) -> dict[str, Label]:
    """Return the labels that tell samples apart: those along the dimensions that the figure names."""
    return {name: key[name] for name in (ask.hue, ask.rows, ask.cols) if name is not None and name in key}


def _values(group: Sequence[Series]) -> Array:
    values = np.concatenate([curve.x for curve in group])
    held = values[np.isfinite(values)]
    if len(held) < FEWEST:
        raise FigureError(f"a distribution needs at least {FEWEST} runs; there are {len(held)}")
    return held


def _histograms(series: list[Series]) -> list[Series]:
    """Return the outline of every sample, its quantiles as marks and their confidence above it."""
    groups = grouped(series).values()
    curves: list[Series] = []
    for group in groups:
        values, key, scales = _values(group), group[0].key, (group[0].across, COUNT)
        edges, counts = histogram(values)
        top, units = float(counts.max()), scales[0].units
        curves.append(Series(key, *bars(edges, counts), *scales, "area"))
        for probability in QUANTILES:
            mark, name = quantile(values, probability), f"{100 * probability:g} %"
            low, high = top * STRIP[0], top * STRIP[1]  # its confidence is a strip above the bars
            strip = band(np.array([mark.low, mark.high]), np.full(2, low), np.full(2, high))
            alone = len(groups) == 1
            said = f"{name}: {_said(mark, units)}" if alone else ""
            curves.append(Series(key, *strip, *scales, "area", said))
            marks = (Mark(mark.value, name),) if alone else ()
            curves.append(Series(key, *flat((0.0, high), mark.value)[::-1], *scales, "hairline", marks=marks))
    return curves


def _said(marked: Quantile, units: str) -> str:
    """Return a quantile and its interval in words, large counts in thousands or millions."""
    power = 0 if units != "1" or marked.value < 1e4 else 3 if marked.value < 1e6 else 6
    value, low, high = (f"{number / 10**power:.3g}" for number in marked)
    return f"{value} ({low}–{high}){joined(units) if units != '1' else COUNT_WORDS[power]}"


def _probabilities(series: list[Series]) -> list[Series]:
    """Return every sample in order over the scores of its ranks, and the log-normal law through it.

    Hazen's places ``(i − ½)/n``. The law has the mean and standard deviation of the logarithms; the limits
    hold each order statistic of such a sample with `CONFIDENCE` (a beta distribution of its rank).
    """
    from scipy.stats import beta, norm

    curves: list[Series] = []
    for group in grouped(series).values():
        logs, first = np.log10(np.sort(_values(group))), group[0]
        label, unit = first.across
        across = Scale(f"log₁₀ of {label}" + (f" in {unit}" if unit != "1" else ""), "1")
        n = len(logs)
        rank = np.arange(1, n + 1)
        scores = norm.ppf((rank - 0.5) / n)
        mean, spread = float(logs.mean()), float(logs.std(ddof=1))
        limits = [mean + spread * norm.ppf(beta.ppf(p, rank, n + 1 - rank)) for p in (TAIL, 1.0 - TAIL)]
        ends, scales = scores[[0, -1]], (across, SCORE)
        curves.append(Series(first.key, logs, scores, *scales, "dots"))
        curves.append(Series(first.key, *band(scores, *limits)[::-1], *scales, "area"))
        curves.append(Series(first.key, mean + spread * ends, ends, *scales))
    return curves


def _over_life(run: Run, ask: Ask) -> Iterator[Series]:
    name = ask.y[0]
    for piece in slices(run, name, ask, "update"):
        (x, across), hours = at_states(run, ask, piece), hours_a_cycle(run, ask)
        scales, ended = (across, piece.scale), ended_of(name)
        yield OfRun(_kept(piece.key, ask), x, piece.values, *scales, hours=hours, ended=ended).known


def _bands(series: list[Series]) -> list[Series]:
    """Return median and bands of every sample; a run at its limit counts as deeper, not as flat.

    Between its wear states a run is taken as straight. A line ends where it would tell the value of a run
    that has ended; a remaining life ends at zero.
    """
    curves: list[Series] = []
    for group in grouped(series).values():
        if len(group) < FEWEST:
            raise FigureError(f"a distribution needs at least {FEWEST} runs; there are {len(group)}")
        curves += banded(group, getattr(group[0], "ended", "gone"))
    return curves


HISTOGRAM = kind(
    "histogram", "Distribution of the life", ("life",), joined=_histograms,
    titled="Distribution of the {}", along_x=True,
    shows="how one number of each run is distributed, with its 5, 50 and 95 % quantiles and their "
    "95 % confidence",
)(_one_number)  # fmt: skip
PROBABILITY = kind(
    "probability", "Log-normal probability plot", ("life",), joined=_probabilities,
    titled="Log-normal probability plot: {}", along_x=True,
    shows="one number of each run in order against the score of its rank, beside the log-normal law with the "
    "same mean and spread of the logarithms; 95 % of each rank of such a sample lies in the band",
)(_one_number)  # fmt: skip
QUANTILE_BANDS = kind(
    "quantile-bands", "Largest wear depth of all runs", ("max_wear_depth", "cycle"), ("update",),
    one_flank=True, joined=_bands, titled="{} of all runs",
    shows="median, 25–75 % and 5–95 % bands of a variable over the cycles, of all runs; a run "
    "at its limit counts as deeper",
)(_over_life)  # fmt: skip

"""Samples of runs: what the statistics promise, and what becomes of a figure's runs."""

import numpy as np
import pytest

from wearlab.figures import FigureError
from wearlab.figures.censoring import CONFIDENCE, Sample, quantile
from wearlab.figures.kinds.distributions import (
    HISTOGRAM,
    PROBABILITY,
    QUANTILE_BANDS,
    OfRun,
    histogram,
)
from wearlab.figures.plot import Scale, Series
from wearlab.figures.wording import Label

LIFE = Scale("life", "1")
NONE = np.zeros(0)


def sample(values, hue=None):
    key = {} if hue is None else {"speed": Label(hue, hue)}
    return [
        Series(key, np.array([v]), np.zeros(1), LIFE, Scale("runs", "1"))
        for v in values
    ]


@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95])
def test_intervals_hold_the_true_quantile_as_often_as_they_say(probability):
    random = np.random.default_rng(1)
    held = []
    for _ in range(2000):
        found = quantile(Sample(random.random(100), NONE), probability)
        assert found.low <= found.value <= found.high
        held.append(found.low <= probability <= found.high)
    assert CONFIDENCE - 0.015 < np.mean(held) < 0.995


def test_few_values_do_not_enclose_a_quantile():
    """Were the ends of the sample, which hold a 5 % quantile of 10 in 40 % of cases."""
    found = quantile(Sample(np.array([3.0, 1.0, 2.0]), NONE), 0.5)
    assert found == (2.0, -np.inf, np.inf) and not found.is_enclosed


def test_every_value_is_counted_once():
    values = np.random.default_rng(2).lognormal(size=500)
    edges, counts = histogram(Sample(values, NONE))
    assert counts.sum() == 500 and len(edges) == len(counts) + 1
    width = 2.0 * np.subtract(*np.quantile(values, [0.75, 0.25])) / np.cbrt(500)
    assert len(counts) == 60 or edges[1] - edges[0] == pytest.approx(width, rel=0.05)
    assert histogram(Sample(np.full(5, 2.0), NONE))[1].sum() == 5  # no scatter at all


def test_a_histogram_shows_its_runs_and_their_quantiles():
    values = 1e6 * np.arange(1.0, 102.0)
    outline, *rest = HISTOGRAM.joined(sample(values))
    edges = outline.x[::2]
    counts = outline.y[1:-1:2]
    assert outline.style == "area" and counts.sum() == 101
    np.testing.assert_array_equal(edges[[0, -1]], [1e6, 101e6])
    marks = [mark for one in rest for mark in one.marks]
    assert [mark.text for mark in marks] == ["5 %", "50 %", "95 %"] and marks[
        1
    ].x == 51e6
    assert rest[2].text == "50 %: 51 (41–61) million"
    bands = [one for one in rest if one.style == "area"]
    assert all(
        one.y.min() > outline.y.max() for one in bands
    )  # no band is taken for a bar
    assert all(
        low.x.min() <= mark.x <= low.x.max()
        for low, mark in zip(bands, marks, strict=True)
    )


def test_samples_stay_apart_by_hue():
    found = HISTOGRAM.joined(
        sample(np.arange(9.0), "slow") + sample(np.arange(9.0) + 20.0, "fast")
    )
    outlines = [one for one in found if one.style == "area" and len(one.x) > 4]
    assert [one.key["speed"].text for one in outlines] == ["slow", "fast"]
    assert outlines[0].x.max() == 8.0 and outlines[1].x.min() == 20.0
    assert not any(one.marks for one in found)


def test_a_log_normal_sample_lies_on_its_line_and_in_its_band():
    values = np.exp(14.0 + 0.3 * np.random.default_rng(3).normal(size=400))
    points, band, line = PROBABILITY.joined(sample(values))
    np.testing.assert_allclose(np.sort(np.log10(values)), points.x)
    slope = np.ptp(line.y) / np.ptp(line.x)
    assert slope == pytest.approx(np.log(10.0) / 0.3, rel=0.1)
    low = band.x[:400]
    high = band.x[:399:-1]
    assert np.mean((low <= points.x) & (points.x <= high)) > 0.95
    bent = PROBABILITY.joined(sample(np.random.default_rng(3).random(400)))
    low = bent[1].x[:400]
    high = bent[1].x[:399:-1]
    assert (
        np.mean((low <= bent[0].x) & (bent[0].x <= high)) < 0.7
    )  # uniform values are none


@pytest.mark.parametrize("ended", ["above", "kept"])
def test_bands_of_runs_that_end_at_a_limit(ended):
    """Depths v·n up to 1 at rates 1…99: the median rate is 50, the 5 % one 5.3."""
    rates = np.arange(1.0, 100.0)
    depth = Scale("depth", "um")
    ends = np.array([0.0, 1.0])
    runs = [
        OfRun({}, np.array([0.0, 1.0 / v]), ends, LIFE, depth, ended=ended)
        for v in rates
    ]
    wide, narrow, median = QUANTILE_BANDS.joined(runs)
    np.testing.assert_allclose(median.y, np.minimum(1.0, 50.0 * median.x), atol=1e-12)
    half = len(wide.x) // 2
    x = wide.x[:half]
    low = wide.y[:half]
    high = wide.y[: half - 1 : -1]
    early = x < 0.009
    np.testing.assert_allclose(low[early], 5.3 * x[early], rtol=0.01)
    np.testing.assert_allclose(high[early], 95.0 * x[early], rtol=0.01)
    assert (high == 1.0).any() and low[-1] == pytest.approx(1.0, abs=0.05)
    assert (
        narrow.y.max() <= 1.0 and x[-1] < 0.3
    )  # the slowest 5 % of the runs are not waited for
    assert (median.x[-1] < 0.025) == (
        ended == "above"
    )  # where the median run has reached its limit


@pytest.mark.parametrize("kind", [HISTOGRAM, PROBABILITY, QUANTILE_BANDS])
def test_two_runs_are_no_distribution(kind):
    with pytest.raises(FigureError, match="at least 3 runs; there are 2"):
        kind.joined(sample([1.0, 2.0]))


def test_kinds_draw_from_a_store(plot):
    (panel,) = plot(kind="histogram", y="life").panels
    assert [curve.style for curve in panel.curves] == ["area", *3 * ["hairline"]]
    (panel,) = plot(kind="quantile-bands").panels
    assert [curve.style for curve in panel.curves] == ["area", "area", "line"]
    with pytest.raises(FigureError, match="not one number per run"):
        plot(kind="histogram", y="max_wear_depth")

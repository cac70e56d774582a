"""Runs that ended before their limit count as censored: by hand, and by simulation."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import Axis, Campaign, Case, put, run
from scipy.optimize import minimize
from scipy.stats import norm

from wearlab.figures import FigureError
from wearlab.figures.censoring import (
    Sample,
    log_normal,
    plotting_positions,
    quantile,
    shares_below,
)
from wearlab.figures.curves import banded
from wearlab.figures.kind import read
from wearlab.figures.kinds.distributions import HISTOGRAM, PROBABILITY, OfRun
from wearlab.figures.plot import Scale, Series
from wearlab.figures.plotting import plotted
from wearlab.schema import attributes
from wearlab.store import Store

CYCLES = Scale("wear cycles", "1")
DEPTH = Scale("depth", "um")
COUNT = 30
LIMIT = 62e6


def lives(count=COUNT):
    """Return lives of which half lie beyond 62 million cycles."""
    return 1e6 * np.linspace(33.0, 95.0, count)


def test_kaplan_and_meier_by_hand():
    """Seven lives, three of them censored.

    1: 6/7 go on. 2: 5/7; censored at 2.5. 3: 5/7 · 3/4. 4: 5/7 · 3/4 · 2/3.
    """
    sample = Sample(np.array([3.0, 1.0, 4.0, 2.0]), np.array([2.5, 5.0, 5.0]))
    shares = shares_below(sample)
    going_on = [6 / 7, 5 / 7, 15 / 28, 5 / 14]
    np.testing.assert_allclose(1.0 - shares.after, going_on)
    np.testing.assert_allclose(1.0 - shares.before, [1.0, *going_on[:3]])
    assert quantile(sample, 0.5).value == 4.0  # 15/28 go on just before
    assert quantile(sample, 0.25).value == 2.0
    assert np.isnan(quantile(sample, 0.7).value)  # 5/14 never end


def test_a_share_that_is_met_exactly_lies_between_two_values():
    sample = Sample(np.array([1.0, 2.0, 3.0, 5.0]), np.array([6.0, 6.0]))
    assert quantile(sample, 0.5).value == 4.0
    whole = Sample(np.array([1.0, 2.0, 3.0, 5.0, 6.0, 6.5]), np.zeros(0))
    assert quantile(whole, 0.5).value == pytest.approx(4.0)


@pytest.mark.parametrize("count", [8, 20, 40, 100])
@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("censored", ["none", "at one cycle", "anywhere"])
def test_intervals_hold_the_true_quantile(count, probability, censored):
    """Were the ends of a small sample: 5 % of 8 runs were held in 34 % of cases."""
    random = np.random.default_rng(4)
    held = []
    for _ in range(400):
        numbers = random.random(count)
        limits = {
            "none": np.full(count, 2.0),
            "at one cycle": np.full(count, 0.7),
            "anywhere": 1.5 * random.random(count),
        }[censored]
        is_early = limits < numbers
        found = quantile(Sample(numbers[~is_early], limits[is_early]), probability)
        assert not found.value < found.low and not found.value > found.high
        held.append(found.low <= probability <= found.high)
    assert np.mean(held) > 0.95 - 0.03


def test_the_law_is_that_of_maximum_likelihood():
    random = np.random.default_rng(5)
    logs = 7.8 + 0.1 * random.normal(size=60)
    sample = Sample(logs[logs < 7.85], np.full(int(np.sum(logs >= 7.85)), 7.85))

    def against(law):
        reached = norm.logpdf(sample.values, law[0], np.exp(law[1])).sum()
        return -reached - norm.logsf(sample.ends, law[0], np.exp(law[1])).sum()

    best = minimize(against, [7.8, np.log(0.1)], method="Nelder-Mead", tol=1e-10).x
    law = log_normal(sample)
    assert law.mean == pytest.approx(best[0], abs=1e-4)
    assert law.spread == pytest.approx(np.exp(best[1]), rel=1e-3)
    assert log_normal(Sample(sample.values, np.zeros(0))).mean < law.mean - 0.02


def test_without_censored_runs_the_places_are_hazen_s():
    values = np.array([4.0, 2.0, 2.0, 9.0])
    ordered, shares = plotting_positions(Sample(values, np.zeros(0)))
    assert ordered.tolist() == [2.0, 2.0, 4.0, 9.0]
    np.testing.assert_allclose(shares, [0.125, 0.375, 0.625, 0.875])


def of_sample(values, ends):
    key = {}
    zero = np.zeros(1)
    reached = [OfRun(key, np.array([v]), zero, CYCLES, DEPTH) for v in values]
    early = [
        OfRun(
            key,
            np.array([v]),
            zero,
            CYCLES,
            DEPTH,
            ended_by="cycles",
            is_censored=True,
        )
        for v in ends
    ]
    return [*reached, *early]


def test_a_probability_plot_of_censored_lives():
    """The dots stand at their ranks among all runs, the law is not that of the short
    lives alone.
    """
    whole = np.exp(14.0 + 0.3 * np.random.default_rng(3).normal(size=400))
    limit = np.median(whole)
    series = of_sample(whole[whole < limit], np.full(200, limit))
    dots, band, law = PROBABILITY.joined(series)
    assert dots.y.max() == pytest.approx(norm.ppf(199.5 / 400))
    middle = np.interp(0.0, law.y, law.x, right=np.nan)
    slope = np.ptp(law.y) / np.ptp(law.x)
    assert slope == pytest.approx(np.log(10.0) / 0.3, rel=0.1)
    assert np.isnan(middle) or middle == pytest.approx(np.log10(limit), abs=0.01)
    assert len(band.x) == 2 * 200
    assert dots.caveat.startswith("200 of 400 runs ended before their limit (200 by cy")


def test_a_run_censored_early_leaves_the_ranks_after_it_without_limits():
    values = np.linspace(1.0, 2.0, 20)
    _, band, _ = PROBABILITY.joined(of_sample(values, [1.499]))
    assert len(band.x) == 2 * 10


def test_too_few_lives_that_reached_their_limit():
    with pytest.raises(FigureError, match="3 runs that reached their limit; there are"):
        HISTOGRAM.joined(of_sample([1.0, 2.0], [3.0, 3.0]))


def straight(rate, end, ended_by=""):
    x = np.array([0.0, end])
    return Series({}, x, rate * x, CYCLES, DEPTH, ended_by=ended_by)


def test_runs_on_one_curve_that_end_at_different_cycles_have_no_band():
    """Was a wide band: an early end counted as deeper than all that went on."""
    curves = [straight(2.0, end, "cycles") for end in np.linspace(1.0, 3.0, 30)]
    wide, narrow, median = banded(curves, "above")
    assert np.ptp(wide.y - 2.0 * wide.x) < 1e-9 and np.ptp(narrow.y / narrow.x[1]) > 0.0
    np.testing.assert_allclose(median.y, 2.0 * median.x, atol=1e-12)
    assert median.x[-1] == pytest.approx(2.0, abs=0.05)


def test_bands_under_random_censoring_are_those_of_all_runs():
    """The rate does not decide where a run is stopped: the median is not moved."""
    random = np.random.default_rng(6)
    rates = np.exp(0.3 * random.normal(size=4000))
    stops = 0.3 + 3.0 * random.random(4000)
    whole = [straight(rate, 1.0 / rate) for rate in rates]
    some = [
        straight(rate, min(stop, 1.0 / rate), "cycles" if stop < 1.0 / rate else "")
        for rate, stop in zip(rates, stops, strict=True)
    ]
    *_, of_all = banded(whole, "above")
    *_, of_some = banded(some, "above")
    assert of_some.x[-1] == pytest.approx(of_all.x[-1], rel=0.02)
    np.testing.assert_allclose(
        np.interp(of_some.x, of_all.x, of_all.y), of_some.y, rtol=0.03, atol=1e-3
    )


def ended(index):
    """Return a run to 62 million cycles, or to its limit before."""
    life = float(lives()[index])
    data = run(1000.0 + index)
    end = min(life, LIMIT)
    cycle = end * np.array([0.0, 0.4, 1.0])
    data = data.assign_coords(cycle=("update", cycle, data["cycle"].attrs))
    is_worn_out = life <= LIMIT
    data["life"] = ((), life if is_worn_out else np.nan, data["life"].attrs)
    seconds = 60.0 * end / 1000.0
    data["operating_hours"] = (
        "update",
        60.0 * cycle / 1000.0,
        data["operating_hours"].attrs,
    )
    data["service_life"] = (
        (),
        seconds if is_worn_out else np.nan,
        data["service_life"].attrs,
    )
    left = (life if is_worn_out else np.nan) - cycle
    attrs = data["remaining_useful_life"].attrs
    data["remaining_useful_life"] = ("update", left, attrs)
    reason = "depth" if is_worn_out else "cycles"
    data["end_reason"] = xr.DataArray(reason, attrs=attributes("end_reason"))
    return data


@pytest.fixture(scope="module")
def figure(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("censored") / "store")
    store.archive.create()
    for index in range(COUNT):
        put(store, f"{index:032d}", ended(index))
    order = np.random.default_rng(1).permutation(COUNT)
    axis = Axis(
        "sample", tuple(1e-15 * (1.0 + order)), "m^2/N", "wear.coefficient.value"
    )
    cases = [Case("base", f"{i:032d}", {"sample": i}) for i in range(COUNT)]
    grid = store.open(Campaign(tuple(cases), (axis,)))
    return lambda **wishes: plotted(grid, read(SimpleNamespace(**wishes), 1, None))[0]


@pytest.mark.parametrize("y", ["life", "service_life"])
def test_censored_runs_do_not_vanish(figure, y):
    """The median of those that reached the limit alone is 47 million cycles."""
    reached = int(np.sum(lives() <= LIMIT))
    plot = figure(kind="histogram", y=y)
    early = COUNT - reached
    note = f"{early} of {COUNT} runs ended before their limit"
    assert any(text.startswith(f"{note} ({early} by cycles)") for text in plot.notes)
    bars, ends = plot.panels[0].curves[:2]
    assert bars.y[1:-1:2].sum() == reached and ends.y[1:-1:2].sum() == early
    texts = [entry.text for entry in plot.legend]
    assert not any(text.startswith("50 %") for text in texts)  # not half of them
    plot = figure(kind="probability", y=y)
    assert len(plot.panels[0].curves[0].x) == reached
    assert any(text.startswith(note) for text in plot.notes)


@pytest.mark.parametrize("kind", ["scatter", "parallel-coordinates", "sensitivity"])
def test_kinds_that_cannot_show_them_say_so(figure, kind):
    notes = figure(kind=kind).notes
    assert any(note.startswith("Not drawn: 16 of 30 runs that ended") for note in notes)


def test_bands_count_them_in_the_note(figure):
    notes = figure(kind="quantile-bands").notes
    assert any("16 of 30 runs ended before their limit" in note for note in notes)
    notes = figure(kind="max-wear").notes
    assert any("16 of 30 runs ended before their limit" in note for note in notes)
    notes = figure(kind="quantile-bands", y="remaining_useful_life").notes
    assert any(note.startswith("Not drawn: 16 of 30 runs that ended") for note in notes)

"""The grid against closed forms: linear wear with Gaussian errors is conjugate.

So is a normal-gamma sd.
"""

import time
from dataclasses import replace

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.campaign.distributions import read_distribution
from wearlab.updating.answers import answer_of
from wearlab.updating.data_blocks import inspections_of
from wearlab.updating.grids import Posterior
from wearlab.updating.likelihood import ParameterBatch, log_likelihood
from wearlab.updating.lives import Answer
from wearlab.updating.sampling import draw

P = np.array([0.001, 0.05, 0.25, 0.5, 0.75, 0.95, 0.999])
CYCLES = np.array([1e5, 2e5, 3e5, 4.5e5, 6e5, 8e5])
SD = 4e-4


def weighings(seed=1, factor=1.3, cycles=CYCLES, sd=SD):
    rng = np.random.default_rng(seed)
    return RATE * factor * cycles + sd * rng.standard_normal(len(cycles))


def conjugate(values, mean, sd, cycles=CYCLES, noise=SD):
    """Return the normal posterior of the factor."""
    slope = RATE * cycles
    precision = 1.0 / sd**2 + np.sum(slope**2) / noise**2
    return stats.norm(
        (mean / sd**2 + np.sum(slope * values) / noise**2) / precision, precision**-0.5
    )


@pytest.mark.parametrize("sd", [0.02, 0.1, 0.19])
def test_linear_wear_with_known_errors_is_conjugate(sd):
    seen = (observed(CYCLES, weighings(), ErrorModel(SD)),)
    prior = {"normal": {"mean": 1.2, "sd": sd}, "truncate": [1e-3, 10.0]}
    run = history(seen)
    answer = answer_of(study(prior, seen), [run], blocks(seen))
    exact = conjugate(weighings(), 1.2, sd)
    assert answer.factor(P) == pytest.approx(exact.ppf(P), rel=1e-6)
    assert answer.life(P) == pytest.approx(0.03 / RATE / exact.ppf(1.0 - P), rel=1e-6)
    total = stats.multivariate_normal(
        1.2 * RATE * CYCLES,
        SD**2 * np.eye(6) + sd**2 * RATE**2 * np.outer(CYCLES, CYCLES),
    )
    assert answer.posterior.evidence == pytest.approx(
        total.logpdf(weighings()), abs=1e-6
    )


def test_an_offset_of_one_inspection_is_conjugate_and_ignoring_it_halves_the_width():
    """Sixteen teeth at one time: their mean is as uncertain as the
    offset, however many they are.
    """
    cycles = np.full(16, 5e5)
    offset = SD * np.sqrt(3.0 / 16.0)
    values = weighings(4, cycles=cycles)
    seen = (observed(cycles, values, ErrorModel(SD, 0.0, offset)),)
    prior = {"normal": {"mean": 1.2, "sd": 0.1}, "truncate": [1e-3, 10.0]}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    slope = RATE * cycles
    cov = SD**2 * np.eye(16) + offset**2
    precision = 1.0 / 0.1**2 + slope @ np.linalg.solve(cov, slope)
    mean = (1.2 / 0.1**2 + slope @ np.linalg.solve(cov, values)) / precision
    exact = stats.norm(mean, precision**-0.5)
    assert answer.factor(P) == pytest.approx(exact.ppf(P), rel=1e-6)
    without = (observed(cycles, values, ErrorModel(SD)),)
    ignored = answer_of(study(prior, without), [history(without)], blocks(without))
    width = np.ptp(answer.factor(np.array([0.05, 0.95])))
    narrow = np.ptp(ignored.factor(np.array([0.05, 0.95])))
    assert narrow == pytest.approx(0.5 * width, rel=0.02)


def test_an_accumulating_drift_is_conjugate():
    drift, sd = 1.5e-3, 2e-4
    rng = np.random.default_rng(2)
    steps = np.diff(CYCLES, prepend=0.0)
    walk = np.cumsum(drift * np.sqrt(steps / 1e6) * rng.standard_normal(6))
    values = 1.3 * RATE * CYCLES + walk + sd * rng.standard_normal(6)
    seen = (observed(CYCLES, values, ErrorModel(sd, drift=drift)),)
    prior = {"normal": {"mean": 1.2, "sd": 0.1}, "truncate": [1e-3, 10.0]}
    answer = answer_of(
        study(prior, seen, "accumulating"),
        [history(seen)],
        blocks(seen, accumulating=True),
    )
    cov = sd**2 * np.eye(6) + drift**2 * np.minimum.outer(CYCLES, CYCLES) / 1e6
    slope = RATE * CYCLES
    precision = 1.0 / 0.1**2 + slope @ np.linalg.solve(cov, slope)
    exact = stats.norm(
        (1.2 / 0.1**2 + slope @ np.linalg.solve(cov, values)) / precision,
        precision**-0.5,
    )
    assert answer.factor(P) == pytest.approx(exact.ppf(P), rel=1e-6)
    total = stats.multivariate_normal(
        1.2 * slope, cov + 0.1**2 * np.outer(slope, slope)
    )
    assert answer.posterior.evidence == pytest.approx(total.logpdf(values), abs=1e-6)


def test_an_unknown_error_gives_students_law():
    """With flat priors of factor and ln sd the factor has a t distribution of n − 1
    degrees of freedom.
    """
    values = weighings(5)
    wide = read_distribution({"loguniform": ["1e-6 g", "1e5 g"]}, "sd")
    seen = (observed(CYCLES, values, ErrorModel(wide)),)
    prior = {"uniform": [1e-3, 5.0]}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    slope = RATE * CYCLES
    best = slope @ values / (slope @ slope)
    scale = np.sqrt(np.sum((values - best * slope) ** 2) / 5 / (slope @ slope))
    inner = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    assert answer.factor(inner) == pytest.approx(
        stats.t(5, best, scale).ppf(inner), rel=1e-6
    )


def test_two_unknowns_agree_with_emcee():
    emcee = pytest.importorskip("emcee")
    values = weighings(6)
    seen = (
        observed(
            CYCLES,
            values,
            ErrorModel(read_distribution({"loguniform": ["0.05 g", "5 g"]}, "sd")),
        ),
    )
    prior = {"lognormal": {"median": 1.0, "cov": 1.0}}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))

    def log_probability(theta):
        u, v = theta
        if not np.log(5e-5) < v < np.log(5e-3):
            return -np.inf
        own = -0.5 * u**2 / np.log(2.0)
        return (
            own
            - 0.5 * np.sum(((values - np.exp(u) * RATE * CYCLES) / np.exp(v)) ** 2)
            - 6 * v
        )

    rng = np.random.default_rng(0)
    start = np.array([np.log(1.3), np.log(4e-4)]) + 1e-3 * rng.standard_normal((16, 2))
    sampler = emcee.EnsembleSampler(16, 2, log_probability)
    sampler._random.seed(1)
    sampler.run_mcmc(start, 12_000)
    chain = np.exp(sampler.get_chain(discard=500, thin=10, flat=True)[:, 0])
    inner = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    spread = chain.std()
    assert (
        np.abs(answer.factor(inner) - np.quantile(chain, inner)).max() < 0.08 * spread
    )


def test_halving_the_grid_changes_nothing(monkeypatch):
    values = weighings(7)
    unknown = read_distribution({"loguniform": ["0.01 g", "5 g"]}, "sd")
    seen = (observed(CYCLES, values, ErrorModel(unknown)),)
    prior = {"lognormal": {"median": 1.0, "cov": 14.0}}
    whole = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    monkeypatch.setattr(
        "wearlab.updating.grids.NODES", 2 * len(whole.posterior.nodes[0]) - 1
    )
    monkeypatch.setattr("wearlab.updating.grids.SPREADS", 81)
    finer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    assert finer.posterior.place.shape[1] > whole.posterior.place.shape[1]
    inner = np.array([0.05, 0.5, 0.95])
    assert whole.factor(inner) == pytest.approx(finer.factor(inner), rel=1e-6)
    edge = whole.posterior.density[0, [0, -1]] / whole.posterior.density.max()
    assert edge.max() < 1e-6


def test_six_depths_take_a_moment():
    seen = (observed(CYCLES, weighings(), ErrorModel(SD)),)
    run = history(seen)
    asked = study({"lognormal": {"median": 1.0, "cov": 14.0}}, seen)
    clock = time.process_time()
    answer_of(asked, [run], blocks(seen)).life(P)
    assert time.process_time() - clock < 0.3


@pytest.mark.parametrize("n", [10_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_hundred_thousand_values_are_one_average(n):
    cycles = np.linspace(1e3, 8e5, n)
    values = weighings(8, cycles=cycles)
    seen = (observed(cycles, values, ErrorModel(SD)),)
    prior = {"lognormal": {"median": 1.0, "cov": 14.0}}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    slope = RATE * cycles
    best = slope @ values / (slope @ slope)
    sd = SD / np.sqrt(slope @ slope)
    assert answer.factor(np.array([0.5]))[0] == pytest.approx(best, rel=1e-6)
    assert np.ptp(answer.factor(np.array([0.05, 0.95]))) == pytest.approx(
        3.2897 * sd, rel=1e-4
    )


@pytest.mark.parametrize("values", [[], [0.013]])
def test_few_values_leave_the_prior_wide(values):
    seen = (observed(CYCLES[: len(values)], values, ErrorModel(SD)),)
    prior = {"lognormal": {"median": 1.0, "cov": 1.0}}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    law = stats.lognorm(np.sqrt(np.log(2.0)))
    if not values:
        assert answer.factor(P) == pytest.approx(law.ppf(P), rel=1e-6)
    else:
        assert answer.factor(np.array([0.5]))[0] == pytest.approx(
            0.013 / (RATE * 1e5), rel=0.01
        )


def test_runs_are_weighted_by_their_evidence():
    """Two runs whose rates differ: the weights are those of two models, k integrated
    out in closed form.
    """
    values = weighings(9)
    seen = (observed(CYCLES, values, ErrorModel(SD)),)
    runs = [history(seen, rate=RATE, run="a"), history(seen, rate=1.5 * RATE, run="b")]
    prior = {"normal": {"mean": 1.0, "sd": 0.1}, "truncate": [1e-3, 10.0]}
    answer = answer_of(study(prior, seen), runs, blocks(seen))
    logs = []
    for rate in (RATE, 1.5 * RATE):
        slope = rate * CYCLES
        law = stats.multivariate_normal(
            slope, SD**2 * np.eye(6) + 0.1**2 * np.outer(slope, slope)
        )
        logs.append(law.logpdf(values))
    expected = np.exp(logs - np.logaddexp(*logs))
    assert answer.posterior.weight == pytest.approx(expected, abs=1e-6)
    assert answer.life_below(answer.life(np.array([0.3])))[0] == pytest.approx(
        0.3, abs=1e-6
    )


@pytest.mark.parametrize("error", ["known", "unknown", "drift", "gain", "many"])
@pytest.mark.parametrize("later", [1.0, 1.2])
def test_runs_judged_at_once_are_as_each_alone(error, later):
    """Evidence of each run, and innovations of draws.

    Of runs that were measured at other cycles, too.
    """
    unknown = read_distribution({"lognormal": {"median": SD, "cov": 0.5}}, "error")
    model = {
        "known": ErrorModel(SD),
        "many": ErrorModel(SD),
        "unknown": ErrorModel(unknown),
        "drift": ErrorModel(SD, drift=unknown),
        "gain": ErrorModel(SD, gain_sd=0.2),
    }[error]
    cycles = np.linspace(1e5, 8e5, 5000 if error == "many" else 6)
    seen = (observed(cycles, weighings(cycles=cycles), model),)
    some = blocks(seen, accumulating=True)
    prior = read_distribution({"lognormal": {"median": 1.0, "cov": 0.3}}, "factor")
    runs = [history(seen, rate=rate * RATE) for rate in (1.0, 1.1, 0.9)]
    runs[1] = replace(
        runs[1], points=(runs[1].points[0]._replace(cycle=later * cycles),)
    )
    whole = Posterior(runs, some, prior)
    each = [Posterior([run], some, prior) for run in runs]
    assert whole.log_evidence == pytest.approx([one.evidence for one in each], abs=2e-6)
    if error == "many":
        return
    draws = draw(Answer(whole, 8e5, None), 30, np.random.default_rng(0))
    steps = draws.filtered(0, draws.inspections(0)).steps
    for i, run in enumerate(runs):
        mine = np.flatnonzero(draws.run == i)
        lanes = ParameterBatch(
            draws.factor[mine], draws.sd[0][mine], draws.drift[0][mine]
        )
        own = log_likelihood(
            some[0], run, 0, lanes, inspections_of(some[0], run, 0)
        ).steps
        for one, of_all in zip(own, steps, strict=True):
            assert of_all.surprise[mine] == pytest.approx(one.surprise, rel=1e-12)
            assert of_all.variance[mine] == pytest.approx(one.variance, rel=1e-12)

"""Scores of what was foreseen: by their definitions, and beside simple rules."""

import numpy as np
import pytest
from made import LIMIT, RATE, ErrorModel, blocks, history, observed, study
from scipy import stats
from scipy.integrate import quad
from units import law, unit

from wearlab.updating.answers import answer_of
from wearlab.updating.calibration import calibrated
from wearlab.updating.fleet import joint_draws, states_now
from wearlab.updating.population import fit_population
from wearlab.updating.scores import (
    EVEN,
    crps,
    interval_score,
    replayed,
    scored,
    scores_of,
)

CYCLES = np.array([1e5, 2e5, 4e5, 6e5, 8e5, 1e6])


@pytest.mark.parametrize("truth", [-1.0, 0.3, 2.5])
def test_the_ranked_probability_score_is_that_of_its_definition(truth):
    law = stats.norm(0.5, 0.8)
    exact = quad(
        lambda x: (law.cdf(x) - (x >= truth)) ** 2, -8.0, 8.0, points=[truth], limit=200
    )[0]
    assert crps(law.ppf(EVEN), truth) == pytest.approx(exact, rel=5e-3)


def test_the_interval_score_is_proper():
    """The interval's own quantiles score best."""
    law = stats.norm(0.0, 1.0)
    rng = np.random.default_rng(0)
    draws = rng.standard_normal(100_000)
    means = [interval_score(-z, z, draws).mean() for z in (1.2, law.ppf(0.95), 2.2)]
    assert means[1] == min(means)
    assert interval_score(0.0, 1.0, np.array([1.5]))[0] == pytest.approx(
        1.0 + 20.0 * 0.5
    )


@pytest.mark.slow
def test_scores_are_those_of_a_library():
    """scoringrules compiles for three seconds when it is imported: an update cannot
    wait for it.
    """
    library = pytest.importorskip("scoringrules")
    rng = np.random.default_rng(1)
    quantile = np.sort(rng.standard_normal((20, len(EVEN))), axis=1)
    truth = 2.0 * rng.standard_normal(20)
    mine = np.array([scores_of(q, y) for q, y in zip(quantile, truth, strict=True)])
    assert mine[:, 0] == pytest.approx(library.crps_quantile(truth, quantile, EVEN))
    low, high = np.array([np.interp([0.05, 0.95], EVEN, q) for q in quantile]).T
    assert mine[:, 1] == pytest.approx(library.interval_score(truth, low, high, 0.1))
    one = unit("a", [1e4], [1.3e-3])
    states = states_now(
        found := fit_population([one], law(), 0), joint_draws(found, 400, rng)
    )
    mean, sd = states[0].measured(2e4)
    draws = mean + sd * np.random.default_rng(2).standard_normal(len(mean))
    theirs = float(library.crps_ensemble(2e-3, draws))
    assert states[0].crps(2e4, 2e-3, np.random.default_rng(2)) == pytest.approx(theirs)


def made(seed):
    rng = np.random.default_rng(seed)
    values = 1.3 * RATE * CYCLES + 4e-4 * rng.standard_normal(len(CYCLES))
    seen = (observed(CYCLES, values, ErrorModel(4e-4)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen)
    return asked, answer_of(asked, [history(seen)], blocks(seen)).posterior, values


def test_a_replay_is_scored_beside_simple_rules():
    asked, post, values = made(1)
    end = LIMIT.value / (1.3 * RATE)
    found = replayed(asked, post, end)
    ratio = CYCLES * LIMIT.value / values - CYCLES
    assert found["by_the_ratio"].values == pytest.approx(ratio)
    slope, at = np.polyfit(CYCLES[1:4], values[1:4], 1)
    assert found["by_the_last_three"].values[3] == pytest.approx(
        (LIMIT.value - at) / slope - CYCLES[3]
    )
    assert np.isnan(found["by_the_last_three"].values[:2]).all()
    score = scored(found, end)
    assert float(score["replay_error_by_the_ratio"]) == pytest.approx(
        np.mean(np.abs(ratio - (end - CYCLES)) / (end - CYCLES))
    )
    some = found.isel(inspection=slice(2, None))  # those that have a line through three
    here = scored(some, end)["replay_mean_error"]
    assert float(score["replay_own_by_the_last_three"]) == pytest.approx(float(here))
    assert float(score["replay_own_by_the_ratio"]) == pytest.approx(
        float(score["replay_mean_error"])
    )
    assert float(score["replay_error_by_the_prior"]) > 2.0 * float(
        score["replay_mean_error"]
    )
    assert 0.0 < float(score["replay_crps"]) < float(score["replay_interval_score"])


def test_twins_tell_what_measurements_save():
    asked, post, _ = made(2)
    assert 0.8 < float(calibrated(asked, post, 40)["life_skill"]) < 1.0


def test_twins_are_scored_beside_simple_rules_as_twins_of_one_s_own_are():
    rng = np.random.default_rng(8)
    n = 4000
    sd = 4e-4
    seen = (observed(CYCLES, np.zeros(len(CYCLES)), ErrorModel(sd)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 0.3}}, seen)
    found = calibrated(
        asked, answer_of(asked, [history(seen)], blocks(seen)).posterior, 300
    )
    factor = np.exp(np.sqrt(np.log1p(0.09)) * rng.standard_normal(n))
    values = RATE * factor[:, None] * CYCLES + sd * rng.standard_normal(
        (n, len(CYCLES))
    )
    life = LIMIT.value / (RATE * factor)
    now = CYCLES[-1]
    line = np.polyfit(CYCLES[-3:], values[:, -3:].T, 1)
    fitted = values @ CYCLES / (CYCLES @ CYCLES)  # the prior adds next to nothing
    rules = {
        "life_error": LIMIT.value / fitted,
        "life_error_by_the_ratio": now * LIMIT.value / values[:, -1],
        "life_error_by_the_last_three": (LIMIT.value - line[1]) / line[0],
        "life_error_by_the_prior": np.full(n, LIMIT.value / RATE),
    }
    ahead = life > now
    for name, told in rules.items():
        own = np.abs(told - life)[ahead].sum() / (life - now)[ahead].sum()
        assert float(found[name]) == pytest.approx(own, rel=0.15), name
    assert 0.5 < float(found["life_interval_skill"]) < 1.0


def test_scores_of_a_normal_law_are_its_closed_forms():
    """Over its own values: 1/√π of the ranked probability, 2
    φ(1.645)/0.05 of the 90 % interval.
    """
    known = stats.norm.ppf(EVEN)
    ranked, interval = np.mean(
        [scores_of(known, z) for z in stats.norm.ppf((np.arange(2000) + 0.5) / 2000)], 0
    )
    assert ranked == pytest.approx(np.pi**-0.5, rel=0.005)
    assert interval == pytest.approx(2.0 * stats.norm.pdf(1.6449) / 0.05, rel=0.01)

"""A Wiener drift: the life is a first passage, against paths that are marched."""

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.updating.answers import answer_of, outcome_of
from wearlab.updating.lives import first_passage
from wearlab.updating.sampling import draw, replicated

CYCLES = np.array([1e5, 2e5, 3e5, 4.5e5, 6e5, 8e5])
TIGHT = {"normal": {"mean": 1.3, "sd": 1e-6}, "truncate": [1.2, 1.4]}


def test_first_passages_are_inverse_gaussian():
    t = np.array([0.2, 0.7, 1.0, 1.6, 4.0])
    for shape in (0.3, 2.0, 40.0, 3e4):
        exact = stats.invgauss(1.0 / shape, scale=shape)
        found = [first_passage(x, np.array([1.0]), np.array([shape]))[0] for x in t]
        assert found == pytest.approx(exact.cdf(t), abs=1e-9)


def test_lives_with_a_drift_agree_with_marched_paths():
    drift, sd = 2e-3, 1e-7
    values = 1.3 * RATE * CYCLES
    seen = (observed(CYCLES, values, ErrorModel(sd, drift=drift)),)
    answer = answer_of(
        study(TIGHT, seen, "accumulating"),
        [history(seen)],
        blocks(seen, accumulating=True),
    )
    rng = np.random.default_rng(0)
    step, n = 500.0, 4000
    level = np.full(n, values[-1])
    now = np.full(n, CYCLES[-1])
    alive = np.ones(n, bool)
    for _ in range(4000):
        before = level.copy()
        level[alive] += 1.3 * RATE * step + drift * np.sqrt(
            step / 1e6
        ) * rng.standard_normal(alive.sum())
        # a path may have crossed and come back within a step: the bridge's probability
        # of that
        gap = np.maximum(0.03 - before, 0.0) * np.maximum(0.03 - level, 0.0)
        crossed = np.exp(-2.0 * gap / (drift**2 / 1e6 * step)) > rng.random(n)
        now[alive] += step
        alive &= ~((level >= 0.03) | crossed)
        if not alive.any():
            break
    assert not alive.any()
    p = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    spread = np.std(now)
    assert np.abs(answer.life(p) - np.quantile(now, p)).max() < 0.08 * spread
    lives = draw(answer, 4000, rng).life
    assert np.abs(answer.life(p) - np.quantile(lives, p)).max() < 0.08 * spread


def test_an_end_that_is_over_is_said():
    values = 1.3 * RATE * CYCLES * 2.5
    seen = (observed(CYCLES, values, ErrorModel(1e-5)),)
    prior = {"lognormal": {"median": 3.0, "cov": 1.0}}
    answer = answer_of(study(prior, seen), [history(seen)], blocks(seen))
    assert (
        answer.passed == pytest.approx(1.0)
        and answer.remaining(np.array([0.95]))[0] == 0.0
    )


def test_a_drift_widens_what_the_prior_leads_to_expect():
    """The last value lies 2.2 standard deviations of drift and error
    off, which is told two-sided.
    """
    drift, sd = 2e-3, 1e-3
    whole = np.sqrt(sd**2 + drift**2 * CYCLES[-1] / 1e6)
    values = 1.3 * RATE * CYCLES + 2.2 * whole
    seen = (observed(CYCLES, values, ErrorModel(sd, drift=drift)),)
    asked = study(TIGHT, seen, "accumulating", draws=40_000)
    found = outcome_of(asked, (history(seen),)).stats["prior_predictive_p"]
    assert found == pytest.approx(2.0 * stats.norm.sf(2.2), abs=4e-3)


@pytest.mark.parametrize(
    ("since", "passed"), [(None, CYCLES), ("previous", np.diff(CYCLES, prepend=0.0))]
)
def test_replicas_stray_as_far_as_a_drift_says(since, passed):
    """Of values since the inspection before, replicas had no drift."""
    drift, sd = 2e-3, 1e-4
    made = RATE * CYCLES if since is None else RATE * passed
    seen = (observed(CYCLES, made, ErrorModel(sd, drift=drift), since=since),)
    found = answer_of(
        study(TIGHT, seen, "accumulating"),
        [history(seen)],
        blocks(seen, accumulating=True),
    )
    rng = np.random.default_rng(1)
    values, strayed = replicated(draw(found, 4000, rng), 0, rng, conditional=False)
    expected = np.hypot(sd, drift * np.sqrt(passed / 1e6))
    assert values.std(axis=0) == pytest.approx(expected, rel=0.05)
    assert strayed.std() == pytest.approx(drift * np.sqrt(passed[-1] / 1e6), rel=0.05)
    if since is not None:  # given what was measured, too: each step is new
        again, _ = replicated(draw(found, 4000, rng), 0, rng)
        assert again.std(axis=0) == pytest.approx(expected, rel=0.05)

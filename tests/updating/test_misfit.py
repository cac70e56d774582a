"""What is wrong with a model or its errors is said, and what is right is not."""

from dataclasses import replace

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.campaign.distributions import read_distribution
from wearlab.updating.answers import answer_of, outcome_of
from wearlab.updating.doubts import sound_probability
from wearlab.updating.misfit import _probability
from wearlab.updating.sampling import ALARM, checks, draw
from wearlab.updating.sheet_doubts import DOUBT, SCALE

WIDE = {"lognormal": {"median": 1.0, "cov": 14.0}}
UNKNOWN = read_distribution({"lognormal": {"median": "0.05 g", "cov": 1.0}}, "sd")


def judged(cycles, values, error, seed=0, draws=300, prior=WIDE):
    """Return whether any inspection, and whether the course of all, is called."""
    seen = (observed(cycles, values, error),)
    answer = answer_of(study(prior, seen), [history(seen, end=4e6)], blocks(seen))
    each, courses = checks(draw(answer, draws, np.random.default_rng(seed)))
    return any(check.p < ALARM / len(each) for check in each), courses.get(
        0, 1.0
    ) < ALARM


def test_a_curve_of_another_law_is_called_though_the_sd_is_unknown():
    """Was 0 of 23: sixteen residuals above, then six below, the sd 33
    times its prior median.
    """
    cycles = np.linspace(5e4, 1.15e6, 23)
    called = 0
    for seed in range(20):
        noise = 5e-5 * np.random.default_rng(seed).standard_normal(23)
        called += judged(
            cycles,
            RATE * 1.15e6 * (cycles / 1.15e6) ** 0.6 + noise,
            ErrorModel(UNKNOWN),
        )[1]
    assert called >= 18


@pytest.mark.parametrize("n", [3000, 20_000])
def test_a_rate_that_changes_among_thousands_of_depths_is_called(n):
    """Above 2,000 observations the checks had vanished without a word."""
    cycles = np.linspace(1e3, 1e6, n)
    values = RATE * np.where(cycles < 5e5, cycles, 5e5 + 4.0 * (cycles - 5e5))
    values += 4e-4 * np.random.default_rng(1).standard_normal(n)
    assert any(judged(cycles, values, ErrorModel(4e-4)))
    assert any(judged(cycles, values, ErrorModel(UNKNOWN)))
    clean = RATE * cycles + 4e-4 * np.random.default_rng(2).standard_normal(n)
    assert not any(judged(cycles, clean, ErrorModel(4e-4)))


@pytest.mark.parametrize(
    "error",
    [ErrorModel(4e-4), ErrorModel(UNKNOWN), ErrorModel(1e-4, 0.05)],
    ids=["known", "unknown", "relative"],
)
def test_clean_twins_are_not_called(error):
    """Fewer than one in twenty, of 60."""
    cycles = np.linspace(1e5, 1.2e6, 12)
    alarms = 0
    for seed in range(60):
        rng = np.random.default_rng([7, seed])
        factor = np.exp(0.3 * rng.standard_normal())
        own = 1e-4 if error.sd != 4e-4 else 4e-4
        sd = np.hypot(own, error.relative * RATE * factor * cycles)
        alarms += any(
            judged(
                cycles,
                RATE * factor * cycles + sd * rng.standard_normal(12),
                error,
                seed,
            )
        )
    assert alarms <= stats.binom(60, 0.05).ppf(0.95)


def test_wear_does_not_come_back_is_not_said_of_sound_data():
    """Was said in 5 of 12 clean sets of 3,000 depths: three
    deviations a pair, however many pairs.
    """
    cycles = np.linspace(1e3, 1e6, 3000)
    for seed in range(6):
        values = RATE * cycles + 4e-4 * np.random.default_rng(seed).standard_normal(
            3000
        )
        seen = (observed(cycles, values, ErrorModel(4e-4)),)
        assert outcome_of(study(WIDE, seen, draws=50), (history(seen),)).notes == ()


def test_a_narrow_prior_far_from_the_truth_gives_way():
    """Prior 1 ± 5 %, truth 8: it had ended at seven deviations, 2.02 ± 0.01 %, a life
    four times too long.
    """
    cycles = np.linspace(1e5, 6e5, 6)
    sd = np.log1p(0.05**2) ** 0.5
    values = 8.0 * RATE * cycles
    seen = (observed(cycles, values, ErrorModel(1e-5)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 0.05}}, seen)
    found = outcome_of(asked, (history(seen, end=8e6),))
    grid = np.linspace(np.log(7.9), np.log(8.1), 200_001)
    logs = (
        -0.5 * (grid / sd) ** 2
        - 0.5
        * np.sum((values - np.exp(grid)[:, None] * RATE * cycles) ** 2, axis=1)
        / 1e-10
    )
    below = np.cumsum(np.exp(logs - logs.max()))
    p = np.array([0.05, 0.5, 0.95])
    assert found.answer.factor(p) == pytest.approx(
        np.exp(np.interp(p, below / below[-1], grid)), rel=2e-6
    )
    assert any("the prior hardly allows these data" in note for note in found.notes)


def test_draws_of_an_unknown_sd_follow_no_staircase():
    """Quantiles were 1.3 % off, interpolated between the points of a grid."""
    cycles = np.linspace(1e5, 8e5, 6)
    values = 1.3 * RATE * cycles + 4e-4 * np.random.default_rng(5).standard_normal(6)
    wide = read_distribution({"loguniform": ["1e-6 g", "1e5 g"]}, "sd")
    seen = (observed(cycles, values, ErrorModel(wide)),)
    answer = answer_of(
        study({"uniform": [1e-3, 5.0]}, seen), [history(seen)], blocks(seen)
    )
    sd = draw(answer, 40_000, np.random.default_rng(0)).sd[0]
    slope = RATE * cycles
    rest = np.sum((values - slope * (slope @ values) / (slope @ slope)) ** 2)
    p = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    exact = np.sqrt(rest / stats.chi2(5).ppf(1.0 - p))
    assert np.quantile(sd, p) == pytest.approx(exact, rel=0.012)
    assert stats.kstest(rest / sd**2, stats.chi2(5).cdf).pvalue > 1e-3
    assert len(np.unique(sd)) == len(sd)


def test_an_unknown_sd_far_from_its_prior_is_said():
    cycles = np.linspace(5e4, 1.15e6, 23)
    values = RATE * 1.15e6 * (cycles / 1.15e6) ** 0.6
    seen = (observed(cycles, values, ErrorModel(UNKNOWN)),)
    found = outcome_of(study(WIDE, seen, draws=300), (history(seen),))
    assert any("times the median of its prior" in note for note in found.notes)


def test_few_effective_runs_of_few_are_said():
    """Eight runs with an effective sample of five raised no warning."""
    cycles = np.linspace(1e5, 6e5, 6)
    values = 1.3 * RATE * cycles + 4e-4 * np.random.default_rng(3).standard_normal(6)
    seen = (observed(cycles, values, ErrorModel(4e-4)),)
    runs = tuple(
        history(seen, rate=RATE * f, run=str(f)) for f in np.linspace(1.25, 1.35, 8)
    )
    found = outcome_of(replace(study(None, seen, draws=100)), runs)
    assert 1.5 < found.stats["effective_runs"] < 8.0
    assert any("runs carry the answer" in note for note in found.notes)


def two_weighings(second):
    """Return two weighings in a file each, 1 % each, the second so much higher."""
    cycle = np.array([5e5])
    return [
        observed(cycle, RATE * f * cycle, ErrorModel(1e-4), number=n)
        for n, f in ((1, 1.0), (2, second))
    ]


def by_quadrature(second):
    """Return 5, 50 and 95 % of the factor by them, and how probably both are sound."""
    u = np.arange(-1.0, 1.5, 5e-4)
    prior = stats.norm(0.0, np.sqrt(np.log1p(14.0**2))).pdf(u)
    first_at, second_at = (stats.norm.pdf(f, np.exp(u), 0.01) for f in (1.0, second))
    away = stats.cauchy.pdf(u[:, None] - u, scale=SCALE) * (u[1] - u[0])
    sound = (1.0 - 2.0 * DOUBT) * first_at * second_at
    first_off = DOUBT * (away @ first_at) * second_at
    second_off = DOUBT * (away @ second_at) * first_at
    density = prior * (sound + first_off + second_off)
    below = np.cumsum(density) / density.sum()
    quantiles = np.exp(np.interp([0.05, 0.5, 0.95], below, u))
    return quantiles, float(np.sum(prior * sound) / density.sum())


@pytest.mark.parametrize("second", [1.0, 1.01, 1.03, 1.05, 1.2])
def test_each_source_may_have_a_scale_of_its_own(second):
    """Two weighings 20 % apart, 1 % each: the answer had stayed 1 % wide; and at three
    standard deviations it was switched from one law to another.
    """
    ones = two_weighings(second)
    found = outcome_of(study(WIDE, ones, draws=300), (history(ones),))
    exact, sound = by_quadrature(second)
    assert found.answer.factor(np.array([0.05, 0.5, 0.95])) == pytest.approx(
        exact, rel=1e-3
    )
    assert sound_probability(found.posterior) == pytest.approx(sound, abs=5e-3)
    without = [one.factor(np.array([0.5]))[0] for one in found.sources.values()]
    assert without == pytest.approx([second, 1.0], rel=1e-3)
    said = any("may have a scale of its own" in note for note in found.notes)
    assert said == (second > 1.04)


def test_draws_know_the_scale_of_a_doubted_source():
    ones = two_weighings(1.2)
    found = outcome_of(study(WIDE, ones, draws=4000), (history(ones),))
    draws = found.draws
    seen = np.array([draws.factor_of(n) for n in (0, 1)])
    assert seen[0] == pytest.approx(np.ones(4000), abs=0.05)
    assert seen[1] == pytest.approx(np.full(4000, 1.2), abs=0.05)
    first_is_right = np.abs(draws.factor - 1.0) < 0.05
    assert np.mean(first_is_right) == pytest.approx(0.5, abs=0.1)
    assert draws.scales[1][first_is_right] == pytest.approx(np.log(1.2), abs=0.05)


@pytest.mark.parametrize("n", [12, 300])
def test_a_gain_of_its_own_is_no_misfit(n):
    """Of more than 200 inspections the gain was taken for 1.

    The weighing says which k it is.
    """
    rng = np.random.default_rng(4)
    cycles = np.linspace(1e5, 1.2e6, n)
    weighed = observed([1.2e6], [RATE * 1.2e6], ErrorModel(1e-5))
    heard = RATE * 1.3 * cycles + 4e-4 * rng.standard_normal(n)
    sensor = observed(
        cycles, heard, ErrorModel(4e-4, gain_sd=0.2), number=2, where="planet"
    )
    seen = (weighed, sensor)
    answer = answer_of(study(WIDE, seen), [history(seen, end=4e6)], blocks(seen))
    each, courses = checks(draw(answer, 300, rng))
    assert min(check.p for check in each) > ALARM / len(each) and courses[1] > ALARM


def test_inspections_told_in_groups_surprise_as_chance_does():
    """A thousand inspections that each share an offset are told in
    two hundred groups.
    """
    rng = np.random.default_rng(4)
    cycles = np.linspace(1e4, 1.2e6, 1000)
    values = RATE * cycles + np.hypot(2e-4, 3e-4) * rng.standard_normal(1000)
    seen = (observed(cycles, values, ErrorModel(2e-4, 0.0, 3e-4)),)
    answer = answer_of(study(WIDE, seen), [history(seen)], blocks(seen))
    each, _ = checks(draw(answer, 100, rng))
    assert len(each) == 200 and all(check.count == 5 for check in each)
    assert np.std([check.surprise for check in each]) == pytest.approx(1.0, abs=0.15)


def test_columns_that_tell_nothing_call_nothing():
    slope = np.array([0.0, 0.0, 0.0, 1.0])
    columns = np.stack([slope, 0.5 * slope])
    assert _probability(np.array([0.1, -0.2, 0.3, 0.1]), slope, columns) == 1.0

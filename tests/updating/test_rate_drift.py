"""A wear rate that drifts: its courses, what is known with them, and misfits."""

from dataclasses import replace

import numpy as np
import pytest
from dense import Drifts, Quadrature, least_mean_width
from laws import (
    ERRORS,
    LAST,
    LAWS,
    LIFE,
    PRIOR,
    SD,
    TIMES,
    f_test,
    misfit_of,
    posteriors,
    told,
)
from made import LIMIT, RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.campaign.update_options import UpdateBlock
from wearlab.updating import grids, rate_drift
from wearlab.updating.answers import outcome_of
from wearlab.updating.lives import Answer
from wearlab.updating.misfit import ALARM
from wearlab.updating.run_curves import Course
from wearlab.updating.scenarios import changed_clock

WIDE = {"lognormal": {"median": 1.0, "cov": 14.0}}
DRIFTING = "drifting-rate"
P = np.array([0.05, 0.25, 0.5, 0.75, 0.95])


def test_it_is_the_default():
    assert UpdateBlock.model_fields["discrepancy"].default == DRIFTING


def test_courses_are_those_of_closed_forms():
    x = np.array([0.0, 0.2, 0.5, 1.0, 2.0])
    passed = rate_drift.wear_passed
    assert passed("power", np.log(1.5), 1.0, x) == pytest.approx(x**1.5)
    doubled = np.array([0.0, 0.2, 0.6, 1.6, 3.6]) / 1.6
    assert passed("change", np.log(2.0), 0.4, x) == pytest.approx(doubled)
    early = passed("running-in", np.log(5.0), 0.1, x)
    extra = 0.4 * (1.0 - np.exp(-10.0 * x))
    assert early == pytest.approx((x + extra) / (1.0 + extra[3]))
    for kind, place in (("power", 1.0), ("change", 0.4), ("running-in", 0.1)):
        assert passed(kind, 0.3, place, 1.0) == pytest.approx(1.0)
        assert passed(kind, 0.0, place, x) == pytest.approx(x)


def test_a_run_with_a_course_wears_by_it():
    """At the readings exactly, and beyond them, by the closed form."""
    seen = (observed(TIMES * LIFE, np.zeros(8), ErrorModel(SD)),)
    made = blocks(seen)
    run = history(seen, end=4e6)
    drifting = rate_drift.with_courses(run, [Course("power", np.log(1.5), 1.0)], made)[
        0
    ]
    last = LAST * LIFE
    wear = drifting.limit.at(drifting.equivalent_cycle(TIMES * LIFE, np.array(1.3)))
    expected = RATE * 1.3 * last * (TIMES / LAST) ** 1.5
    assert wear == pytest.approx(expected, rel=1e-12)
    life = last * (LIMIT.value / (RATE * 1.3 * last)) ** (1.0 / 1.5)
    assert float(drifting.life(np.array(1.3))) == pytest.approx(life, rel=2e-4)


def test_a_scenario_of_the_same_load_changes_no_life():
    """The rate drifts on, at a pace that is not the mean one."""
    seen = (observed(TIMES * LIFE, np.zeros(8), ErrorModel(SD)),)
    run = history(seen, end=4e6)
    for course in (Course("power", np.log(1.5), 1.0), Course("change", 0.7, 0.4)):
        drifting = rate_drift.with_courses(run, [course], blocks(seen))[0]
        clock = changed_clock(drifting, run, LAST * LIFE, 1.0)
        same = replace(drifting, clock=clock)
        life = float(drifting.life(np.array(1.0)))
        assert float(same.life(np.array(1.0))) == pytest.approx(life, rel=2e-3)


@pytest.mark.parametrize("known", ["known", "unknown"])
@pytest.mark.parametrize(
    "name",
    ["cycles, as the model", "cycles^1.5", "load doubled at 0.4 of life"],
)
def test_lives_are_those_of_a_dense_quadrature(name, known):
    """Within a tenth of the 90 % interval in the mean of six sets, hardly biased."""
    dense = Quadrature(Drifts())
    off = []
    for seed in range(6):
        value = LAWS[name].drawn(seed)
        _, drifting = posteriors(value, ERRORS[known])
        mine = Answer(drifting, LAST * LIFE, None).life(P) / LIFE
        theirs = dense.lives(value, known, P)
        off.append((mine - theirs) / (theirs[-1] - theirs[0]))
    assert np.abs(off).mean(axis=0).max() < 0.1
    assert np.abs(np.mean(off, axis=0)).max() < 0.06


@pytest.mark.parametrize("known", ["known", "unknown"])
@pytest.mark.parametrize(
    "name",
    [
        "cycles^0.6",
        "cycles^1.5",
        "load doubled at 0.4 of life",
        "running-in, a quarter of the wear",
    ],
)
def test_lives_of_other_laws_are_held(name, known):
    """Were held in none of 40 by a steady rate."""
    sets = 6
    pairs = [posteriors(LAWS[name].drawn(seed), ERRORS[known]) for seed in range(sets)]
    assert sum(told(steady).holds for steady, _ in pairs) <= 1
    held = sum(told(drifting).holds for _, drifting in pairs)
    assert held >= stats.binom(sets, 0.8).ppf(0.01)


def test_no_reading_switches_the_interval():
    """A fiftieth of an error moves no end by a tenth of the width, where all move most.

    Half as much moved it by a fifth: ranges of courses began at one of 41 sizes.
    """
    value = LAWS["cycles, as the model"].drawn(1)
    ends = []
    for off in np.arange(4.46, 5.16, 0.02) * SD:
        moved = value + off * (np.arange(8) == 6)
        _, drifting = posteriors(moved, ERRORS["known"])
        ends.append(told(drifting).quantile[:2])
    steps = np.abs(np.diff(ends, axis=0)).max(axis=1)
    width = np.diff(ends, axis=1)[:-1, 0]
    assert (steps / width).max() < 0.1


def test_what_is_known_before_has_the_probabilities_of_the_prior():
    seen = (observed(TIMES * LIFE, np.zeros(8), ErrorModel(SD)),)
    (block,) = blocks(seen)
    nothing = (replace(block, rows=block.rows[:0]),)
    runs = rate_drift.runs_with_drift(history(seen, end=4e6), nothing, PRIOR)
    posterior = grids.Posterior(runs, nothing, PRIOR)
    by_kind = dict.fromkeys(rate_drift.SHARE, 0.0)
    by_scatter = dict.fromkeys(rate_drift.SCATTER, 0.0)
    for run, weight in zip(runs, posterior.weight, strict=True):
        by_kind[run.course.kind if run.course else "steady"] += weight
        by_scatter[run.scatter] += weight
    assert by_kind == pytest.approx(rate_drift.SHARE, abs=0.03)
    assert by_scatter == pytest.approx(rate_drift.SCATTER, abs=0.03)


def test_few_that_are_drawn_evenly_stand_for_all():
    rng = np.random.default_rng(2)
    log_weight = np.sort(2.0 * rng.standard_normal(400))
    number, probability = rate_drift.drawn_evenly(log_weight, 40)
    assert len(number) == 40
    assert probability[-1] == 1.0  # the largest
    weight = np.exp(log_weight)
    place = np.linspace(0.0, 1.0, 400)
    whole = weight @ place / weight.sum()
    of_drawn = weight[number] / probability
    assert of_drawn.sum() == pytest.approx(weight.sum(), rel=0.02)
    assert of_drawn @ place[number] / of_drawn.sum() == pytest.approx(whole, abs=0.01)


@pytest.mark.parametrize(
    "name", ["cycles^0.6", "cycles^0.8", "cycles^1.2", "load doubled at 0.4 of life"]
)
def test_misfits_are_seen_as_by_an_f_test(name):
    """Within ten points of a test for one more power alone, whose false alarms are 2 %.

    The difference of as many sets strays by four points at most.
    """
    sets = 150
    found = []
    for seed in range(sets):
        value = LAWS[name].drawn(seed)
        steady, _ = steady_of(value)
        found.append((misfit_of(steady) < ALARM, f_test(value) < 0.02))
    mine, theirs = np.mean(found, axis=0)
    assert mine >= theirs - 0.1


def steady_of(value, error=None):
    seen = (observed(TIMES * LIFE, value, error or ERRORS["unknown"]),)
    made = blocks(seen)
    return grids.Posterior([history(seen, end=4e6)], made, PRIOR), seen


@pytest.mark.parametrize("known", ["known", "unknown"])
def test_misfits_of_clean_sets_are_not_said(known):
    alarms = 0
    sets = 400
    for seed in range(sets):
        value = LAWS["cycles, as the model"].drawn(1000 + seed)
        alarms += misfit_of(steady_of(value, ERRORS[known])[0]) < ALARM
    assert alarms <= stats.binom(sets, ALARM).ppf(0.99)


def test_what_the_data_read_as_is_said():
    """Which course, how probable, and the life if it is right."""
    for name, kinds in (
        ("cycles^1.5", ("power", "change")),
        ("load doubled at 0.4 of life", ("change",)),
        ("running-in, a quarter of the wear", ("running-in",)),
    ):
        _, seen = steady_of(LAWS[name].drawn(2), ERRORS["known"])
        asked = study(WIDE, seen, DRIFTING, draws=100)
        outcome = outcome_of(asked, (history(seen, end=4e6),))
        first = outcome.readings[0]
        assert first.kind in kinds
        assert first.life[0] < 1.05 * LIFE
        assert first.life[2] > 0.95 * LIFE
        assert outcome.misfits[0] < ALARM
        assert sum(r.probability for r in outcome.readings) == pytest.approx(
            1.0, abs=0.01
        )


def test_a_steady_rate_keeps_what_it_said_and_names_the_misfit():
    """discrepancy = none: the answer as before, with the readings beside it."""
    _, seen = steady_of(LAWS["cycles^1.5"].drawn(2), ERRORS["known"])
    outcome = outcome_of(study(WIDE, seen, draws=100), (history(seen, end=4e6),))
    steady, _ = posteriors(LAWS["cycles^1.5"].drawn(2), ERRORS["known"])
    expected = Answer(steady, LAST * LIFE, None).life(P)
    assert outcome.answer.life(P) == pytest.approx(expected, rel=1e-9)
    assert outcome.readings[0].kind in ("power", "change")


def test_many_readings_count_with_few_courses():
    """Twenty thousand depths that go faster and faster, in a few seconds."""
    rng = np.random.default_rng(4)
    cycles = np.linspace(1e3, LAST * LIFE, 20_000)
    wear = LIMIT.value * (cycles / LIFE) ** 1.2
    value = wear + SD * rng.standard_normal(len(cycles))
    seen = (observed(cycles, value, ErrorModel(SD)),)
    made = blocks(seen)
    runs = rate_drift.runs_with_drift(history(seen, end=4e6), made, PRIOR)
    assert len(runs) <= 1 + rate_drift.MAX_RUNS_OF_MANY
    posterior = grids.Posterior(runs, made, PRIOR)
    low, high = Answer(posterior, LAST * LIFE, None).life(P[[0, -1]]) / LIFE
    assert low < 1.005
    assert high > 0.995
    assert high - low < 0.05


def test_no_interval_is_narrower_than_what_all_powers_need():
    """Mean widths of clean sets, known sd: at least those that any intervals need."""
    lives = np.linspace(0.6, 2.5, 800)
    least = least_mean_width(0.8, lives)
    assert 1.4 < least < least_mean_width(0.9, lives) < 2.2
    dense = Quadrature(Drifts())
    steady = 2.0 * stats.norm.ppf(0.95) * SD / np.linalg.norm(TIMES) / LIMIT.value
    widths = []
    for seed in range(40):
        low, high = dense.lives(LAWS["cycles, as the model"].drawn(seed), "known")[:2]
        widths.append((high - low) / steady)
    assert least < np.mean(widths) < 2.5 * least

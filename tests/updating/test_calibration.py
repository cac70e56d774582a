"""Twins: intervals hold the truth as often as they say.

With the wrong errors they do not, and it shows.
"""

from dataclasses import replace

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.campaign.distributions import read_distribution
from wearlab.campaign.update_options import TrueModel
from wearlab.updating.answers import answer_of
from wearlab.updating.calibration import calibrated

CYCLES = np.array([1e5, 2e5, 3e5, 4.5e5, 6e5, 8e5])
PRIOR = {"lognormal": {"median": 1.0, "cov": 0.6}}
N = 200


def bounds(width):
    return stats.binom(N, width).ppf([0.001, 0.999]) / N


def checked(error, discrepancy="none", told=None):
    seen = (observed(CYCLES, np.zeros(6), error),)
    asked = study(PRIOR, seen, discrepancy)
    made = blocks(seen, accumulating=discrepancy != "none")
    answer = answer_of(asked, [history(seen)], made)
    wrong = None if told is None else blocks((observed(CYCLES, np.zeros(6), told),))
    return calibrated(asked, answer.posterior, N, believed=wrong)


@pytest.mark.parametrize(
    "error",
    [
        ErrorModel(4e-4),
        ErrorModel(
            read_distribution({"lognormal": {"median": "0.4 g", "cov": 0.8}}, "sd")
        ),
        ErrorModel(1e-4, relative=0.1),
    ],
    ids=["known", "unknown", "relative"],
)
def test_intervals_of_twins_hold_the_truth_as_often_as_they_say(error):
    found = checked(error)
    for name in ("factor", "life"):
        for width in (0.5, 0.9):
            low, high = bounds(width)
            assert low <= float(found[f"{name}_coverage_{100 * width:.0f}"]) <= high
        assert stats.kstest(found[f"{name}_rank"].values, "uniform").pvalue > 1e-3


def test_twins_whose_rate_drifts_are_those_of_the_prior_of_courses():
    """Lives were held in 66 of 100, courses of the twins being mixed up."""
    found = checked(ErrorModel(4e-4), "drifting-rate")
    for name in ("factor", "life"):
        for width in (0.5, 0.9):
            low, high = bounds(width)
            assert low <= float(found[f"{name}_coverage_{100 * width:.0f}"]) <= high


def test_twins_of_so_many_exact_values_that_no_course_counts_are_made():
    """Their draws were of more runs than the posterior has: an IndexError."""
    cycles = np.linspace(1e3, 8e5, 6000)
    rng = np.random.default_rng(5)
    error = ErrorModel(1e-6)
    values = RATE * cycles + 1e-6 * rng.standard_normal(6000)
    seen = (observed(cycles, values, error),)
    asked = study(PRIOR, seen, "drifting-rate")
    answer = answer_of(asked, [history(seen)], blocks(seen))
    assert len(answer.posterior.histories) == 1
    found = calibrated(asked, answer.posterior, 3)
    assert found["factor_rank"].shape == (3,)


def test_wrong_errors_are_seen():
    """Errors three times those told: half of the intervals' truths are outside."""
    found = checked(ErrorModel(1.2e-3), told=ErrorModel(4e-4))
    low, _ = bounds(0.9)
    assert float(found["factor_coverage_90"]) < low
    assert stats.kstest(found["factor_rank"].values, "uniform").pvalue < 1e-3


def test_a_drift_taken_for_independent_errors_is_seen():
    drifting = ErrorModel(1e-4, drift=3e-3)
    found = checked(drifting, "accumulating", told=ErrorModel(1e-4))
    assert float(found["factor_coverage_90"]) < bounds(0.9)[0]


@pytest.mark.slow
def test_twins_with_a_drift_are_calibrated():
    found = checked(ErrorModel(1e-4, drift=3e-3), "accumulating")
    for name in ("factor", "life"):
        for width in (0.5, 0.9):
            low, high = bounds(width)
            assert low <= float(found[f"{name}_coverage_{100 * width:.0f}"]) <= high


def with_truth(error, believed, power=1.0):
    """Return what ``--check`` says of a study that believes one error model where
    another is true.
    """
    seen = (observed(np.repeat(CYCLES, 4), np.zeros(24), believed),)
    asked = study(PRIOR, seen)
    true = TrueModel(None if error is None else (error,), power)
    asked = replace(asked, spec=asked.spec.model_copy(update={"check": true}))
    answer = answer_of(asked, [history(seen)], blocks(seen))
    return float(calibrated(asked, answer.posterior, 100)["factor_coverage_90"])


def test_check_fails_where_the_twins_have_errors_that_the_study_leaves_out():
    """Could not fail: its twins came from the very model that it checks."""
    offset = ErrorModel(2e-4, 0.0, 1e-3)
    assert with_truth(offset, ErrorModel(2e-4)) < 0.6
    assert with_truth(offset, offset) > 0.8
    assert (
        with_truth(ErrorModel(2e-4), offset) > 0.97
    )  # too wide: errors that are not there


def test_check_fails_where_the_twins_follow_another_law():
    assert with_truth(None, ErrorModel(2e-4), power=0.7) < 0.5
    assert with_truth(None, ErrorModel(2e-4), power=1.0) > 0.8

"""What a reader must know stands at the top: extremes of data and
priors, each in one sentence.
"""

from dataclasses import replace

import numpy as np
import pytest
from made import RATE, ErrorModel, history, observed, study

from wearlab.campaign.distributions import read_distribution
from wearlab.updating.answers import outcome_of
from wearlab.updating.calendar import Calendar, day_number

SD = 1e-4
WIDE = {"lognormal": {"median": 1.0, "cov": 14.0}}
CYCLES = np.array([1e5, 2e5, 3e5])


def notes(values, prior=WIDE, cycles=CYCLES, more=()):
    seen = (observed(cycles, values, ErrorModel(SD)), *more)
    runs = (history(seen),)
    return outcome_of(study(prior, seen, draws=200), runs).notes


@pytest.mark.parametrize(
    ("values", "options", "said"),
    [
        ([], {"cycles": np.zeros(0)}, "nothing was measured"),
        (RATE * CYCLES * [1.0, 1.0, -1.0], {}, "negative by more than its error"),
        (RATE * CYCLES * [1.0, 1.0, 0.3], {}, "less than before"),
        (
            RATE * CYCLES,
            {"prior": {"uniform": [0.01, 0.02]}},
            "the prior hardly allows these data (prior predictive p at most 0.005",
        ),
        (
            RATE * CYCLES[[0, 1, 1]],
            {"cycles": CYCLES[[0, 1, 1]]},
            "line 4 repeats another line, time and worn_mass",
        ),
        (RATE * CYCLES * 30, {"cycles": CYCLES * 30}, "lies beyond the stored runs"),
        (
            RATE * CYCLES * 10,
            {},
            "the end of life has passed with a probability of 100 %",
        ),
        (
            RATE * CYCLES,
            {"more": (observed(CYCLES, 3 * RATE * CYCLES, ErrorModel(SD), number=2),)},
            "two files contradict each other, weighings.csv (update.data[0], worn "
            "mass sun) and "
            "weighings.csv (update.data[1], worn mass sun): alone",
        ),
    ],
)
def test_the_extreme_is_said(values, options, said):
    assert any(said in note for note in notes(np.asarray(values, float), **options))


def test_nothing_is_said_of_sound_data():
    assert notes(RATE * CYCLES) == ()


def test_a_high_outlier_is_named_and_not_the_sound_value_after_it():
    values = RATE * np.array([1e5, 9e5, 3e5, 4e5])
    told = notes(values, cycles=np.array([1e5, 2e5, 3e5, 4e5]))
    assert any("line 3: worn_mass is more than afterwards" in note for note in told)
    assert not any("line 4" in note for note in told)


def test_values_are_judged_by_the_error_that_they_show():
    """Falls were said of sound values whose error is larger than was thought."""
    prior = read_distribution({"lognormal": {"median": SD, "cov": 1.0}}, "sd")
    rng = np.random.default_rng(5)
    cycles = np.linspace(1e5, 2e5, 12)
    said = 0
    for _ in range(20):
        values = RATE * cycles + 4.0 * SD * rng.standard_normal(12)
        seen = (observed(cycles, values, ErrorModel(prior)),)
        told = outcome_of(study(WIDE, seen, draws=200), (history(seen),)).notes
        said += any("does not come back" in note or "negative" in note for note in told)
    assert said == 0


def test_another_pace_of_the_calendar_stands_at_the_top():
    """Was silent: the limit came months too early, or too late."""
    day = day_number(["2024-01-01", "2026-06-25"])
    calendar = Calendar(day, np.array([0.0, 9000.0]), 8000.0)
    seen = (observed(CYCLES, RATE * CYCLES, ErrorModel(SD)),)
    asked = replace(study(WIDE, seen, draws=200), calendar=calendar)
    told = " ".join(outcome_of(asked, (history(seen),)).notes)
    assert "ran 3,628 hours a year until 2026-06-25" in told
    assert "write hours_per_year = 3628" in told

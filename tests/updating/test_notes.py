"""What a reader must know stands at the top: extremes of data and
priors, each in one sentence.
"""

import numpy as np
import pytest
from made import RATE, ErrorModel, history, observed, study

from wearlab.updating.answers import outcome_of

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

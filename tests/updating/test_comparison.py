"""Models beside each other: evidence and inspections left out,
against quadrature of its own.
"""

import numpy as np
import pytest
from made import RATE, ErrorModel, history, observed, study
from scipy import stats

from wearlab.updating.answers import outcome_of
from wearlab.updating.report_text import text_of_models
from wearlab.updating.scores import compared

CYCLES = np.array([2e5, 4e5, 6e5, 8e5])
SD = 5e-4
WIDE = {"lognormal": {"median": 1.0, "cov": 1.0}}


def made(rate, values, label, error=None):
    seen = (observed(CYCLES, values, error or ErrorModel(SD)),)
    asked = study(WIDE, seen, draws=200)
    object.__setattr__(asked, "label", label)
    return outcome_of(asked, (history(seen, rate=rate),))


def by_quadrature(rate, values):
    """Return ln evidence, and the sum of ln p of each value given the others."""
    u = np.linspace(-4.0, 4.0, 40_001)
    prior = stats.norm(0.0, np.sqrt(np.log(2.0))).logpdf(u)
    each = stats.norm(values[:, None], SD).logpdf(rate * np.exp(u) * CYCLES[:, None])

    def log_z(held):
        logs = prior + each[held].sum(axis=0)
        return np.log(np.trapezoid(np.exp(logs - logs.max()), u)) + logs.max()

    whole = log_z(np.ones(4, bool))
    return whole, sum(whole - log_z(np.arange(4) != i) for i in range(4))


def test_evidence_and_inspections_left_out_are_those_of_a_quadrature():
    values = 1.3 * RATE * CYCLES + SD * np.array([0.5, -1.0, 0.3, 0.8])
    found = compared(
        [made(RATE, values, "as it is"), made(5.0 * RATE, values, "five times")]
    )
    assert found["model"].values.tolist() == ["as it is", "five times"]
    for k, rate in enumerate((RATE, 5.0 * RATE)):
        evidence, alone = by_quadrature(rate, values)
        assert float(found["log_evidence"][k]) == pytest.approx(evidence, abs=1e-5)
        assert float(found["log_left_out"][k]) == pytest.approx(alone, abs=1e-5)
    assert (
        text_of_models(found)[-1] == "the data lean towards as it is against five times"
    )


def test_accumulating_noise_is_preferred_where_it_accumulates():
    rng = np.random.default_rng(0)
    walk = np.cumsum(2e-3 * rng.standard_normal(4))
    one = made(RATE, RATE * CYCLES + walk, "rig", ErrorModel(1e-4, 0.0, 0.0, 4e-3))
    found = compared([one])
    assert found["model"].values.tolist() == [
        "rig, accumulating noise",
        "rig, independent errors",
    ]
    assert (
        "strongly prefer rig, accumulating noise to rig, independent errors"
        in text_of_models(found)[-1]
    )


def test_a_single_model_is_not_compared():
    assert compared([made(RATE, RATE * CYCLES, "alone")]) is None

"""Answers against quadrature and twins that share no code with the
update (tests/benchmarks/updates.py).
"""

import numpy as np
import pytest
from outside import CASES, P, answer_to, coverage, measured, quantiles_of
from scipy import stats

N = 30


def a_twin(name):
    case = CASES[name]
    return case, measured(
        case, 1.3, case.sd[0], case.drift[0], np.random.default_rng(11)
    )


@pytest.mark.parametrize("name", list(CASES))
def test_quantiles_are_those_of_an_independent_quadrature(name):
    case, value = a_twin(name)
    assert answer_to(case, value).factor(P) == pytest.approx(
        quantiles_of(case, value), rel=1e-6
    )


@pytest.mark.parametrize("name", ["known", "offset", "gain", "below a limit"])
def test_intervals_hold_twins_drawn_outside(name):
    held, called = coverage(CASES[name], N)
    for (quantity, width), count in held.items():
        assert stats.binomtest(count, N, width / 100).pvalue > 1e-3, (
            quantity,
            width,
            count,
        )
    assert called <= stats.binom(N, 0.05).ppf(0.99)

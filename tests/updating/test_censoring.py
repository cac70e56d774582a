"""Values below a limit of detection that share an offset, or a drift:
against SciPy's multivariate normal.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from made import ErrorModel, blocks, history, observed
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm

from wearlab.updating.data_blocks import inspections_of
from wearlab.updating.kalman import below_limits
from wearlab.updating.likelihood import ParameterBatch, log_likelihood

SD, OFFSET, LIMIT = 0.3e-3, 0.5e-3, 1.0e-3


def weighed(cycle, value, under, error):
    value = np.array(value)
    value[under] = np.nan
    one = observed(np.array(cycle), value, error)
    return replace(one, below=np.where(np.isnan(value), LIMIT, np.nan))


def joint_normal(one, mean, drift):
    """Return the log likelihood: the density of those seen times the
    probability of the others below.
    """
    cycle = one.time
    hidden = np.isnan(one.value)
    covariance = SD**2 * np.eye(len(one)) + OFFSET**2 * (cycle[:, None] == cycle)
    covariance += drift**2 / 1e6 * np.minimum(cycle[:, None], cycle)
    under = np.flatnonzero(hidden)
    seen = np.flatnonzero(~hidden)
    onto = covariance[np.ix_(under, seen)] @ np.linalg.inv(
        covariance[np.ix_(seen, seen)]
    )
    shifted = mean[under] + onto @ (one.value[seen] - mean[seen])
    left = covariance[np.ix_(under, under)] - onto @ covariance[np.ix_(seen, under)]
    of_seen = multivariate_normal(mean[seen], covariance[np.ix_(seen, seen)]).logpdf(
        one.value[seen]
    )
    of_hidden = multivariate_normal(
        shifted, left, abseps=1e-9, releps=1e-9, maxpts=200_000
    )
    return of_seen + np.log(of_hidden.cdf(np.full(len(under), LIMIT)))


@pytest.mark.parametrize("under", [[0, 1], [1], [0, 1, 2]])
def test_the_likelihood_is_that_of_the_joint_normal(under):
    one = weighed(
        [5e4, 5e4, 5e4, 4e5],
        [0.8e-3, 1.1e-3, 1.4e-3, 8.2e-3],
        under,
        ErrorModel(SD, 0.0, OFFSET),
    )
    run = history((one,))
    (block,) = blocks((one,))
    factor = np.array([0.7, 1.0, 1.3])
    found = log_likelihood(
        block, run, 0, ParameterBatch(factor, np.array(SD), np.array(0.0))
    ).log_likelihood
    for f, mine in zip(factor, found, strict=True):
        mean = run.limit.at(run.equivalent_cycle(one.time, f))
        assert mine == pytest.approx(joint_normal(one, mean, 0.0), abs=2e-6)


@pytest.mark.parametrize("drift", [1e-3, 3e-3])
@pytest.mark.parametrize("under", [[0, 1], [0, 1, 2], [2]])
def test_with_a_drift_it_is_so_to_a_hundredth(under, drift):
    cycle = [2e4, 5e4, 9e4, 4e5, 6e5]
    value = [0.8e-3, 1.1e-3, 1.4e-3, 8.2e-3, 12.4e-3]
    one = weighed(cycle, value, under, ErrorModel(SD, 0.0, OFFSET, drift))
    run = history((one,))
    (block,) = blocks((one,), accumulating=True)
    factor = np.array([0.7, 1.0, 1.3])
    times = inspections_of(block, run, 0)
    found = log_likelihood(
        block, run, 0, ParameterBatch(factor, np.array(SD), np.array(drift)), times
    )
    assert found.log_likelihood == pytest.approx(
        sum(step.log_likelihood for step in found.steps)
    )
    for f, mine in zip(factor, found.log_likelihood, strict=True):
        mean = run.limit.at(run.equivalent_cycle(one.time, f))
        assert mine == pytest.approx(joint_normal(one, mean, drift), abs=1e-2)


def test_what_the_first_value_below_tells_of_the_drift_is_exact():
    drift, cycle = 4e-3, 1e5
    one = weighed([cycle], [np.nan], [0], ErrorModel(SD, 0.0, OFFSET, drift))
    run = history((one,))
    (block,) = blocks((one,), accumulating=True)
    found = log_likelihood(
        block, run, 0, ParameterBatch(np.array([1.0]), np.array(SD), np.array(drift))
    )
    model = run.limit.at(np.array([cycle]))[0]
    spread = drift * np.sqrt(cycle / 1e6)

    def moment(power):
        def density(w):
            room = (LIMIT - model - w) / np.hypot(SD, OFFSET)
            return w**power * norm.pdf(w, scale=spread) * norm.cdf(room)

        return quad(
            density, -9.0 * spread, 9.0 * spread, epsabs=0.0, epsrel=1e-11, limit=200
        )[0]

    mass, first, second = (moment(n) for n in range(3))
    assert found.log_likelihood[0] == pytest.approx(np.log(mass), abs=1e-8)
    assert found.mean[0] == pytest.approx(first / mass, rel=1e-7)
    assert found.variance[0] == pytest.approx(
        second / mass - (first / mass) ** 2, rel=1e-7
    )


def test_two_values_below_tell_the_same_as_the_integral_when_what_they_share_is_wide():
    offset = 100.0 * SD
    room = np.array([0.4 * SD, -3.0 * SD])
    found = below_limits(
        room, np.array([SD**2]), np.array([0, 1]), np.array(0.0), np.array(offset)
    )
    edges = [-9.0 * offset, -30.0 * SD, 0.0, 30.0 * SD, 9.0 * offset]

    def density(u):
        return norm.pdf(u, scale=offset) * np.prod(norm.cdf((room - u) / SD))

    mass = sum(
        quad(density, a, b, epsrel=1e-10, limit=200)[0] for a, b in pairwise(edges)
    )
    assert found[0] == pytest.approx(np.log(mass), abs=1e-5)

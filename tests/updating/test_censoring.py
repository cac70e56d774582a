"""Values below a limit of detection that share an offset: against SciPy's multivariate normal."""

from dataclasses import replace

import numpy as np
import pytest
from made import ErrorModel, blocks, history, observed
from scipy.stats import multivariate_normal

from wearlab.updating.likelihood import log_likelihood

SD, OFFSET, LIMIT = 0.3e-3, 0.5e-3, 1.0e-3


@pytest.mark.parametrize("below", [[0, 1], [1], [0, 1, 2]])
def test_the_likelihood_is_that_of_the_joint_normal(below):
    cycle, value = np.array([5e4, 5e4, 5e4, 4e5]), np.array([0.8e-3, 1.1e-3, 1.4e-3, 8.2e-3])
    value[below] = np.nan
    one = observed(cycle, value, ErrorModel(SD, 0.0, OFFSET))
    one = replace(one, below=np.where(np.isnan(value), LIMIT, np.nan))
    run, (block,) = history((one,)), blocks((one,))
    factor = np.array([0.7, 1.0, 1.3])
    found = log_likelihood(block, run, 0, factor, np.array(SD), np.array(0.0)).log_likelihood
    for f, mine in zip(factor, found, strict=True):
        mean = run.limit.at(run.own_cycle(cycle, f))
        covariance = SD**2 * np.eye(4) + OFFSET**2 * (cycle[:, None] == cycle)
        seen = np.flatnonzero(~np.isnan(value))
        inner = np.linalg.solve(covariance[np.ix_(seen, seen)], np.eye(len(seen)))
        onto = covariance[np.ix_(below, seen)] @ inner
        shifted = mean[below] + onto @ (value[seen] - mean[seen])
        left = covariance[np.ix_(below, below)] - onto @ covariance[np.ix_(seen, below)]
        joint = multivariate_normal(mean[seen], covariance[np.ix_(seen, seen)]).logpdf(value[seen])
        hidden = multivariate_normal(shifted, left, abseps=1e-9, releps=1e-9, maxpts=200_000)
        assert mine == pytest.approx(joint + np.log(hidden.cdf(np.full(len(below), LIMIT))), abs=2e-6)

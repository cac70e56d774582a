"""Inspections of a fleet whose errors are Student-t, in the Kalman filter.

Student's t law is a normal law whose variance is divided by λ, a gamma law with ν
degrees of freedom. Over ln λ the trapezoidal rule needs few points, so that each
inspection is a mixture of as many normal ones; afterwards W is replaced by the normal
law of equal mean and variance, which is exact without straying. The degrees of freedom
of a unit are one of `FREEDOMS`, equally probable before.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.special import logsumexp

from wearlab.arrays import Array
from wearlab.updating.kalman import Filtered, Innovation, StateUpdate

FREEDOMS = (2.0, 6.0)
STEP = 0.9  # of ln λ
LOWEST = {2.0: -5.0, 6.0: -2.7}  # of ln λ: further out an error hardly counts already
HIGHEST = 1.6


class Tails(NamedTuple):
    """A law of errors as a mixture of normal ones.

    Parameters
    ----------
    variance : (k,) of each, in parts of the told one
    log_weight : (k,) log of the probability of each
    """

    variance: Array
    log_weight: Array

    def mixed(self, updates: Sequence[StateUpdate]) -> StateUpdate:
        """Return what is known where one of several normal laws holds.

        Parameters
        ----------
        updates : of the state by each
        """
        logs = np.array(np.broadcast_arrays(*(one.log_likelihood for one in updates)))
        logs = logs + self.log_weight.reshape(-1, *np.ones(logs.ndim - 1, int))
        total = logsumexp(logs, axis=0)
        share = np.exp(logs - total)
        mean = _mean(share, [one.mean for one in updates])
        spread = [one.variance + (one.mean - mean) ** 2 for one in updates]
        return StateUpdate(
            surprise=_mean(share, [one.surprise for one in updates]),
            chi_square=_mean(share, [one.chi_square for one in updates]),
            log_likelihood=total,
            mean=mean,
            variance=_mean(share, spread),
        )


@cache
def tails_of(freedom: float) -> Tails:
    """Return Student's t law as a mixture of normal ones.

    Parameters
    ----------
    freedom : its degrees of freedom
    """
    log_precision = np.arange(LOWEST[freedom], HIGHEST, STEP)
    precision = np.exp(log_precision)
    law = stats.gamma(0.5 * freedom, scale=2.0 / freedom)
    logs = law.logpdf(precision) + log_precision
    return Tails(1.0 / precision, logs - logsumexp(logs))


def over_freedoms(by_freedom: Sequence[Filtered]) -> Filtered:
    """Return what the filter knows, whichever the degrees of freedom of a unit.

    Parameters
    ----------
    by_freedom : with each of them
    """
    so_far = [np.full((), -np.log(len(by_freedom))) for _ in by_freedom]
    before = np.zeros(())
    steps: list[Innovation] = []
    for innovations in zip(*(one.steps for one in by_freedom), strict=True):
        so_far = [
            log + one.log_likelihood
            for log, one in zip(so_far, innovations, strict=True)
        ]
        step = _mixed_innovation(so_far, innovations)
        total = step.log_likelihood
        steps.append(replace(step, log_likelihood=total - before))
        before = total

    logs = np.array([one.log_likelihood for one in by_freedom])
    logs = logs - np.log(len(by_freedom))
    total = logsumexp(logs, axis=0)
    share = np.exp(logs - total)
    mean = _mean(share, [one.mean for one in by_freedom])
    spread = [one.variance + (one.mean - mean) ** 2 for one in by_freedom]
    variance = _mean(share, spread)
    return Filtered(total, mean, variance, by_freedom[0].cycle, steps)


def _mixed_innovation(
    logs: Sequence[Array], innovations: Sequence[Innovation]
) -> Innovation:
    """Return an inspection whichever the degrees of freedom, with the whole likelihood.

    ``logs`` are those of all inspections until then by each.
    """
    all_logs = np.array(logs)
    total = logsumexp(all_logs, axis=0)
    share = np.exp(all_logs - total)
    mean = _mean(share, [one.mean for one in innovations])
    spread = [one.variance + (one.mean - mean) ** 2 for one in innovations]
    return Innovation(
        count=innovations[0].count,
        surprise=_mean(share, [one.surprise for one in innovations]),
        chi_square=_mean(share, [one.chi_square for one in innovations]),
        log_likelihood=total,
        mean=mean,
        variance=_mean(share, spread),
    )


def _mean(share: Array, values: Sequence[Array]) -> Array:
    """Return the mean of values by their shares."""
    pairs = zip(share, values, strict=True)
    return np.asarray(sum(part * value for part, value in pairs))

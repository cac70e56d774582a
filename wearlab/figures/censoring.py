"""Samples of which some runs ended before their limit: shares, quantiles, laws.

Such a run is right-censored: its life is longer than the cycles it ran. Left out it
would make lives look shorter than they are, counted as an end longer or shorter.
"""

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index

CONFIDENCE = 0.95
TAIL = 0.5 * (1.0 - CONFIDENCE)


class Sample(NamedTuple):
    """One number of each run.

    Parameters
    ----------
    values : (n,) of the runs that reached their limit, in any unit
    ends : (m,) of the other runs: what they came to without reaching it, same unit
    """

    values: Array
    ends: Array

    @property
    def size(self) -> int:
        """Number of runs, n + m."""
        return len(self.values) + len(self.ends)


class Quantile(NamedTuple):
    """A quantile of a sample, and its interval of `CONFIDENCE`.

    Parameters
    ----------
    value : NaN where too few runs reached their limit to know it
    low, high : ends of the interval, infinite where the sample does not enclose it
    """

    value: float
    low: float
    high: float

    @property
    def is_enclosed(self) -> bool:
        """Whether both ends of its interval are known."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))


class Shares(NamedTuple):
    """Share of runs below each value of a sample, by Kaplan and Meier.

    Parameters
    ----------
    values : (n,) distinct, ascending
    before, after : (n,) share of runs just before each value and just after it
    multiplicity : (n,) runs that have this value
    """

    values: Array
    before: Array
    after: Array
    multiplicity: Index


class LogNormal(NamedTuple):
    """A log-normal law: mean and standard deviation of the logarithms."""

    mean: float
    spread: float


def quantile(sample: Sample, probability: float) -> Quantile:
    """Return a quantile of a sample with its distribution-free confidence interval.

    The number of values below the true quantile is binomial, so that two order
    statistics enclose it with a known probability; they are the innermost with at most
    `TAIL` on either side. A censored run counts as ended for the lower one, and as
    never ending for the upper one, so that the interval holds whatever ended the run.
    Without censored runs the value is the median-unbiased quantile, else that of Kaplan
    and Meier.

    Parameters
    ----------
    sample : one number of each run
    probability : of staying below the quantile

    References
    ----------
    H. A. David, H. N. Nagaraja, Order Statistics, 3rd ed., Wiley 2003, section 7.1.
    """
    from scipy.stats import binom

    values, ends = sample
    low_rank = int(binom.ppf(TAIL, sample.size, probability))
    high_rank = int(binom.ppf(1.0 - TAIL, sample.size, probability)) + 1

    low = -np.inf
    if low_rank >= 1:
        at_least = np.sort(np.concatenate([values, ends]))
        low = float(at_least[low_rank - 1])

    high = np.inf
    if high_rank <= len(values):
        high = float(np.sort(values)[high_rank - 1])

    value = _kaplan_meier_quantile(sample, probability)
    if not len(ends):
        value = float(np.quantile(values, probability, method="median_unbiased"))
    return Quantile(value, low, high)


def _kaplan_meier_quantile(sample: Sample, probability: float) -> float:
    """Return the value below which a share of the runs stays, NaN where none does.

    Between two values it is their middle where the share is met exactly.
    """
    shares = shares_below(sample)
    is_met = np.isclose(shares.after, probability, rtol=0.0, atol=1e-12)
    reached = np.flatnonzero(is_met | (shares.after > probability))
    if not reached.size:
        return float("nan")

    first = int(reached[0])
    if is_met[first] and first + 1 < len(shares.values):
        return float(shares.values[first : first + 2].mean())
    return float(shares.values[first])


def shares_below(sample: Sample) -> Shares:
    """Return the share of runs below each value, by Kaplan and Meier.

    Parameters
    ----------
    sample : one number of each run

    References
    ----------
    E. L. Kaplan, P. Meier, J. Am. Stat. Assoc. 53 (1958) 457,
    doi:10.1080/01621459.1958.10501452.
    """
    from scipy.stats import CensoredData, ecdf

    runs = CensoredData(uncensored=sample.values, right=sample.ends)
    steps = ecdf(runs).cdf
    values, multiplicity = np.unique(sample.values, return_counts=True)
    after = steps.probabilities[np.searchsorted(steps.quantiles, values)]
    before = np.concatenate([np.zeros(1), after])[: len(values)]
    return Shares(values, before, np.asarray(after, float), multiplicity)


def plotting_positions(sample: Sample) -> tuple[Array, Array]:
    """Return every value in order, and the share of runs at the middle of its step.

    Without censored runs these are Hazen's places ``(i − ½)/n``.

    Parameters
    ----------
    sample : one number of each run
    """
    shares = shares_below(sample)
    steps = (shares.after - shares.before) / shares.multiplicity
    first = np.cumsum(shares.multiplicity) - shares.multiplicity
    within = np.arange(len(sample.values)) - np.repeat(first, shares.multiplicity)
    middle = (within + 0.5) * np.repeat(steps, shares.multiplicity)
    return np.sort(sample.values), np.repeat(
        shares.before, shares.multiplicity
    ) + middle


def log_normal(logs: Sample) -> LogNormal:
    """Return the log-normal law of a sample, by its logarithms.

    Without censored runs mean and standard deviation of the logarithms, else the law of
    maximum likelihood, to which a censored run adds the chance to last longer.

    Parameters
    ----------
    logs : logarithms of one number of each run
    """
    from scipy.stats import CensoredData, norm

    values, ends = logs
    mean = float(values.mean())
    spread = float(values.std(ddof=1))
    if not len(ends) or not spread > 0.0:
        return LogNormal(mean, spread)

    # the search begins at mean 0 and spread 1
    runs = CensoredData(
        uncensored=(values - mean) / spread, right=(ends - mean) / spread
    )
    shift, factor = norm.fit(runs, loc=0.0, scale=1.0)
    return LogNormal(mean + spread * float(shift), spread * float(factor))


def listed_reasons(reasons: Iterable[str]) -> str:
    """Return how many lives ended for which reason, in words.

    Parameters
    ----------
    reasons : why each life ended

    Examples
    --------
    >>> listed_reasons(["cycles", "work limit", "cycles"])
    '2 by cycles, 1 by work limit'
    """
    counts = Counter(reasons)
    return ", ".join(f"{count} by {reason}" for reason, count in counts.most_common())

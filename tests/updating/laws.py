"""Wear by laws that are not the model's, and what a drifting rate makes of it.

Eight readings until 0.6 of a life that ends at 1 (`LIFE` cycles). Baselines know no
model: a straight line, a gamma process and a Wiener process through the readings.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from made import LIMIT, ErrorModel, blocks, history, observed
from scipy import stats

from wearlab.campaign.distributions import read_distribution
from wearlab.updating import grids, misfit, rate_drift
from wearlab.updating.lives import Answer
from wearlab.updating.scores import EVEN

LIFE = 1.5e6  # cycles
LAST = 0.6  # of the life, at the last reading
SD = 1.5 / 80.0 * LIMIT.value  # 1.5 of 80 µm
PRIOR = read_distribution({"lognormal": {"median": 1.0, "cov": 14.0}}, "factor")
UNKNOWN = read_distribution(
    {"lognormal": {"median": f"{1e3 * SD} g", "cov": 1.0}}, "sd"
)
ERRORS = {"known": ErrorModel(SD), "unknown": ErrorModel(UNKNOWN)}
TIMES = LAST * np.arange(1, 9) / 8
CYCLES = 0.5 * LIFE * np.geomspace(1.0, 20.0, 1500)
QUANTILES = np.array([0.05, 0.95, *EVEN])


def power(b):
    return lambda x: x**b


def changed(ratio, at):
    whole = at + ratio * (1.0 - at)
    return lambda x: (np.minimum(x, at) + ratio * np.maximum(x - at, 0.0)) / whole


def running_in(share, time):
    ended = 1.0 - np.exp(-1.0 / time)
    return lambda x: share * (1.0 - np.exp(-x / time)) + (1.0 - share * ended) * x


def normal(wear, rng):
    return wear + SD * rng.standard_normal(len(wear))


def growing(wear, rng):
    """Errors whose sd goes with the wear."""
    sd = 0.3 * SD + 0.045 * wear
    return wear + sd * rng.standard_normal(len(wear))


def rounded(wear, rng):
    """Readings to 5 of 80 µm, their error a third of the sd that is told."""
    step = 5.0 / 80.0 * LIMIT.value
    return step * np.round((wear + SD / 3.0 * rng.standard_normal(len(wear))) / step)


@dataclass(frozen=True)
class Law:
    """How wear goes over the life, and how it is read."""

    wear: Callable
    read: Callable = normal

    def drawn(self, seed):
        rng = np.random.default_rng([58, seed])
        return self.read(LIMIT.value * self.wear(TIMES), rng)


LAWS = {
    "cycles, as the model": Law(power(1.0)),
    "cycles^0.6": Law(power(0.6)),
    "cycles^0.8": Law(power(0.8)),
    "cycles^0.9": Law(power(0.9)),
    "cycles^1.1": Law(power(1.1)),
    "cycles^1.2": Law(power(1.2)),
    "cycles^1.5": Law(power(1.5)),
    "running-in, a quarter of the wear": Law(running_in(0.25, 0.06)),
    "load doubled at 0.4 of life": Law(changed(2.0, 0.4)),
    "load halved at 0.4 of life": Law(changed(0.5, 0.4)),
    "load × 1.3 at 0.3 of life": Law(changed(1.3, 0.3)),
    "errors grow with the wear": Law(power(1.0), growing),
    "rounded to 5 of 80 µm": Law(power(1.0), rounded),
}


@dataclass(frozen=True)
class Told:
    """What is told by one set: quantiles of the life over the true one."""

    quantile: np.ndarray

    @property
    def holds(self):
        return bool(self.quantile[0] < 1.0 < self.quantile[1])

    @property
    def width(self):
        return float(self.quantile[1] - self.quantile[0])

    @property
    def crps(self):
        q = self.quantile[2:]
        return float(2.0 * np.mean(((q > 1.0) - EVEN) * (q - 1.0)))


def told(posterior):
    below = Answer(posterior, LAST * LIFE, None).life_below(CYCLES)
    rising = np.maximum.accumulate(below) + 1e-13 * np.arange(len(below))
    return Told(np.interp(QUANTILES, rising, CYCLES / LIFE))


def posteriors(value, error):
    """Return what is known with a steady rate, and with one that may drift."""
    seen = (observed(TIMES * LIFE, value, error),)
    made = blocks(seen)
    run = history(seen, end=4e6)
    steady = grids.Posterior([run], made, PRIOR)
    runs = rate_drift.runs_with_drift(run, made, PRIOR)
    return steady, grids.Posterior(runs, made, PRIOR)


def misfit_of(steady):
    return misfit.misfits(steady)[0]


def f_test(value):
    """Return the p of a plain F test for one more power of the cycles."""
    x = TIMES
    line = x * (x @ value) / (x @ x)
    columns = np.stack([x, x * x], axis=1)
    curve = columns @ np.linalg.lstsq(columns, value, rcond=None)[0]
    rest = np.sum((value - curve) ** 2)
    freedom = len(x) - 2
    ratio = (np.sum((value - line) ** 2) - rest) / (rest / freedom)
    return float(stats.f.sf(ratio, 1, freedom))


AHEAD = LAST * np.geomspace(1.0, 10.0, 300)


def _of_probabilities(below):
    rising = np.maximum.accumulate(below) + 1e-12 * np.arange(len(below))
    return Told(np.interp(QUANTILES, rising, AHEAD))


def straight_line(value):
    columns = np.stack([TIMES, np.ones(8)], axis=1)
    slope, intercept = np.linalg.lstsq(columns, value, rcond=None)[0]
    rest = value - columns @ [slope, intercept]
    covariance = np.linalg.inv(columns.T @ columns) * (rest @ rest) / 6.0
    ahead = np.stack([AHEAD, np.ones(len(AHEAD))], axis=1)
    sd = np.sqrt(np.einsum("ni,ij,nj->n", ahead, covariance, ahead))
    over = (slope * AHEAD + intercept - LIMIT.value) / sd
    return _of_probabilities(stats.t(6).cdf(over))


def gamma_process(value):
    rate = value[-1] / TIMES[-1]
    step = TIMES[0]
    off = np.diff(value, prepend=0.0) - rate * step
    scale = np.sum(off**2) / 7.0 / step / rate
    gap = max(LIMIT.value - value[-1], 1e-9)
    shape = np.maximum(AHEAD - TIMES[-1], 1e-9) * rate / scale
    return _of_probabilities(stats.gamma.sf(gap, shape, scale=scale))


def wiener_process(value):
    rate = value[-1] / TIMES[-1]
    step = TIMES[0]
    off = np.diff(value, prepend=0.0) - rate * step
    variance = np.sum(off**2) / 7.0 / step
    gap = max(LIMIT.value - value[-1], 1e-9)
    mean = gap / rate
    shape = gap**2 / variance
    law = stats.invgauss(mean / shape, scale=shape)
    return Told(TIMES[-1] + law.ppf(QUANTILES))


BASELINES = (straight_line, gamma_process, wiener_process)

__all__ = ["BASELINES", "ERRORS", "LAWS", "posteriors", "told"]

"""Values that were below a limit of detection, at inspections whose values share what they are off by.

Given what an inspection's values share, u (their offset, and how far the wear strays from the model's), they
are independent, those below their limits with probability Φ((limit − m − u)/σ). The others leave u normal,
so that

    p(y) = p(those seen) E[Π Φ((limit − m − u)/σ)],

one integral over u for each inspection. Afterwards u is no longer normal: a drift goes on with its mean and
variance (assumed density filtering), which is exact without a drift.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.arrays import Array, Flags

REACH = 7.0  # standard deviations of u that are integrated over
PANELS, POINTS = 14, 6
FINEST = 280  # panels for u that is spread far wider than the values


@dataclass(frozen=True)
class Hidden:
    """Values of which only a limit is known.

    Parameters
    ----------
    which : (n,) whether a value is one
    room : (…, n) limit of detection minus model; of others anything finite
    """

    which: Flags
    room: Array

    def among(self, values: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return those of an inspection's values that are hidden."""
        return values[self.which[values]]


def below(
    room: Array, variance: Array, values: NDArray[np.intp], mean: Array, spread: Array
) -> tuple[Array, Array, Array]:
    """Return log probability that all these values are below, and mean and variance of u given that.

    Parameters
    ----------
    room : (…, n) limits minus model
    variance : (…, n) or (…, 1) of the independent errors
    values : which of the n are meant
    mean, spread : (…) mean and standard deviation of u before
    """
    from scipy.special import log_ndtr, logsumexp

    own = [np.sqrt(variance[..., 0 if variance.shape[-1] == 1 else value]) for value in values]
    if len(values) == 1:
        return _one_below(room[..., values[0]], own[0], mean, spread)
    ratio = max(float(np.max(spread / row)) for row in own)
    z, log_weight = _rule(int(np.clip(PANELS * np.ceil(0.5 * ratio), PANELS, FINEST)))
    u = mean[..., None] + spread[..., None] * z
    logs = log_weight
    for value, sd in zip(values, own, strict=True):
        logs = logs + log_ndtr((room[..., value][..., None] - u) / sd[..., None])
    log_probability = logsumexp(logs, axis=-1)
    weight = np.exp(logs - log_probability[..., None])
    after = np.sum(weight * u, axis=-1)
    return log_probability, after, np.sum(weight * (u - after[..., None]) ** 2, axis=-1)


def _one_below(room: Array, own: Array, mean: Array, spread: Array) -> tuple[Array, Array, Array]:
    """Return the same of one value, in closed form."""
    from scipy.special import log_ndtr

    both = np.hypot(own, spread)
    a = (room - mean) / both
    log_probability = log_ndtr(a)
    hazard = np.exp(-0.5 * a * a - 0.5 * np.log(2.0 * np.pi) - log_probability)
    left = 1.0 - (spread / both) ** 2 * hazard * (a + hazard)
    return log_probability, mean - spread**2 / both * hazard, spread**2 * left


@cache
def _rule(panels: int) -> tuple[Array, Array]:
    """Return points of a standard normal variable and the logs of their probabilities."""
    nodes, weights = legendre.leggauss(POINTS)
    edges = np.linspace(-REACH, REACH, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    weight = (half * weights).ravel() * np.exp(-0.5 * z * z)
    return z, np.log(weight / weight.sum())

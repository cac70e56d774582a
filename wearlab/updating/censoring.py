"""Values that were below a limit of detection, at inspections whose values share one offset.

Given the offset o of an inspection its values are independent, those below their limits with probability
Φ((limit − m − o)/σ). The others leave o normal, so that

    p(y) = p(those seen) E[Π Φ((limit − m − o)/σ)],

one integral over o for each inspection. A drift would chain these integrals over all inspections: refused.
"""

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.updating.filtering import Inspection, filtered

Array = NDArray[np.float64]
REACH = 7.0  # standard deviations of the offset that are integrated over
PANELS, POINTS = 14, 6


def with_common_offset(
    residual: Array,
    variance: Array,
    room: Array,
    censored: NDArray[np.bool_],
    inspections: list[Inspection],
    offset_variance: float,
) -> Array:
    """Return the log likelihood of values of which some are known to be below a limit only.

    Parameters
    ----------
    residual : (…, n) measured minus model; of censored ones anything finite
    variance : (…, n) or (…, 1) of the independent errors
    room : (…, n) limit of detection minus model; of others anything
    censored : (n,) which values are below their limits
    inspections : which values share an offset
    offset_variance : of it
    """
    total = np.zeros(np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1]))
    none = np.zeros(total.shape)
    for one in inspections:
        seen, hidden = (one.values[censored[one.values] == state] for state in (False, True))
        precision, shift = np.full(total.shape, 1.0 / offset_variance), none
        if len(seen):
            told = [Inspection(one.cycle, seen)]
            total = (
                total + filtered(residual, variance, told, offset_variance, none, one.cycle).log_likelihood
            )
            weight = 1.0 / np.broadcast_to(_of(variance, seen), (*total.shape, len(seen)))
            precision = precision + weight.sum(axis=-1)
            shift = np.sum(residual[..., seen] * weight, axis=-1) / precision
        if len(hidden):
            total = total + _below(room, variance, hidden, shift, 1.0 / np.sqrt(precision))
    return np.asarray(total)


def _of(variance: Array, values: NDArray[np.intp]) -> Array:
    return variance if variance.shape[-1] == 1 else variance[..., values]


def _below(room: Array, variance: Array, hidden: NDArray[np.intp], mean: Array, spread: Array) -> Array:
    """Return the log of the probability that all hidden values are below, the offset integrated out."""
    from scipy.special import log_ndtr, logsumexp

    z, log_weight = _rule()
    offset = mean[..., None] + spread[..., None] * z
    logs = np.zeros(offset.shape) + log_weight
    for value in hidden:
        own = np.sqrt(variance[..., 0 if variance.shape[-1] == 1 else value])
        logs = logs + log_ndtr((room[..., value][..., None] - offset) / own[..., None])
    return np.asarray(logsumexp(logs, axis=-1))


@cache
def _rule() -> tuple[Array, Array]:
    """Return points of a standard normal variable and the logs of their probabilities."""
    nodes, weights = legendre.leggauss(POINTS)
    edges = np.linspace(-REACH, REACH, PANELS + 1)
    half = 0.5 * np.diff(edges)[:, None]
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    weight = (half * weights).ravel() * np.exp(-0.5 * z * z)
    return z, np.log(weight / weight.sum())

"""The likelihood of a block on the grids of its unknown errors, and sums over them by their logs."""

import numpy as np

from wearlab.arrays import Array
from wearlab.updating.filtering import Filtered
from wearlab.updating.history import RunHistory
from wearlab.updating.likelihood import Block, Lanes, Spread, log_likelihood
from wearlab.updating.quadrature import Quadrature


def conditional(
    history: RunHistory,
    block: Block,
    number: int,
    log_factor: Array,
    sd: Quadrature | None,
    drift: Quadrature | None,
) -> Array:
    """Return log p(y_b, ln sd, ln drift | factor) with the weights of the grids, (factors, sds, drifts)."""
    factors = on_grids(history, block, number, log_factor, sd, drift).log_likelihood
    return np.asarray(factors + log_prior(block.sd, sd)[:, None] + log_prior(block.drift, drift))


def on_grids(
    history: RunHistory,
    block: Block,
    number: int,
    log_factor: Array,
    sd: Quadrature | None,
    drift: Quadrature | None,
) -> Filtered:
    """Return the likelihood of a block and its drift at every point of the grids, (factors, sds, drifts)."""
    return log_likelihood(
        block,
        history,
        number,
        Lanes(
            np.exp(log_factor)[:, None, None],
            values(block.sd, sd)[None, :, None],
            values(block.drift, drift)[None, None, :],
        ),
    )


def values(spread: Spread | None, along: Quadrature | None) -> Array:
    """Return the values of a spread on its grid; the known one without it, 0 where there is none."""
    if spread is None:
        return np.zeros(1)
    return np.array([spread.known]) if along is None else np.exp(along.points)


def log_prior(spread: Spread | None, along: Quadrature | None) -> Array:
    """Return the logs of a spread's prior times the weights of its grid."""
    if spread is None or along is None:
        return np.zeros(1)
    return np.asarray(spread.log_density(np.exp(along.points)) + np.log(along.weights))


def log_sum(table: Array) -> Array:
    """Return the log of the sum of exponentials over all but the first dimension."""
    flat = table.reshape(len(table), -1)
    top = flat.max(axis=1)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(flat - top[:, None]).sum(axis=1)) + top)

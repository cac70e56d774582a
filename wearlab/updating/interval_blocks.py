"""Values of a fleet's unit that tell of its pace, not of where it stands.

Such are values that count from a time of their own (wear since the inspection before,
iron in an oil that was changed), and values with an unknown gain. What a block measures
is jointly normal,

    y ~ N(m, diag(v) + γ m mᵀ + ρ a² |(s_i, t_i] ∩ (s_j, t_j]|),

with m the model between s and t, v the errors, γ the variance of the gain, and a² ρ
that of the wear's straying in a unit of equal wear time: of intervals that overlap it
is common. The straying is the block's own: nothing passes between it and that of the
unit's other blocks.
"""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.updating import data_blocks, kalman, likelihood, measurements
from wearlab.updating.data_blocks import Block
from wearlab.updating.run_curves import RunHistory

MAX_VALUES = 60  # of a block of a unit, whose covariance is inverted
# of a value that is only known to lie below a limit of detection, over that limit
MIDDLE = 0.5
SPREAD = 12.0**-0.5
LEAST_SD = 1e-6  # of a value over its distance from the model


def stands_apart(block: Block) -> bool:
    """Whether a block tells of a unit's pace alone.

    Parameters
    ----------
    block : observations
    """
    return block.counts_since or block.data.error.gain_sd > 0.0


def refuse_many(block: Block) -> None:
    """Refuse more values than can be compared jointly.

    Parameters
    ----------
    block : observations of a unit

    Raises
    ------
    UpdateError : there are too many
    """
    if stands_apart(block) and len(block.rows) > MAX_VALUES:
        raise measurements.UpdateError(
            f"{block.data.place}: {len(block.rows)} values of one unit that count from "
            "a time of their own, or have an unknown gain, are compared jointly, at "
            f"most {MAX_VALUES}: thin them out, or take the mean of each inspection"
        )


def log_likelihoods(
    block: Block,
    run: RunHistory,
    number: int,
    shared: Any,
    factor: Array,
) -> list[Array]:
    """Return the log likelihood of each inspection, given those before it.

    Parameters
    ----------
    block, number : what was measured of the unit, and its place
    run : of the unit
    shared : what the units share, lanes (p, 1)
    factor : on the wear coefficient, (p, nodes)
    """
    points = run.points[number]
    order = np.argsort(points.cycle[block.rows], kind="stable")
    rows = block.rows[order]
    in_order = data_blocks.with_rows(block, rows)
    cycle = points.cycle[rows]
    since = data_blocks.cycles_since(in_order, run, number)

    def model_at(cycles: Array) -> Array:
        column = points.column[rows]
        return np.asarray(shared.mean(run, points, factor, cycles, column))

    model = model_at(cycle)
    if block.counts_since:
        model = model - model_at(since)
    seen = _with_middles(in_order, model, shared.sd[number])

    straying = shared.rate * shared.worn(run, points.curve, factor) ** 2
    ends = shared.equal(run.equal(cycle, points.clock))[:, 0]
    begins = shared.equal(run.equal(since, points.clock))[:, 0]
    overlap = np.minimum(ends[:, :, None], ends[:, None, :])
    overlap = overlap - np.maximum(begins[:, :, None], begins[:, None, :])
    covariance = straying[..., None, None] * np.maximum(overlap, 0.0)[:, None]

    error = block.data.error
    gain_variance = error.gain_sd**2
    covariance = covariance + gain_variance * model[..., :, None] * model[..., None, :]
    together = cycle[:, None] == cycle[None, :]
    covariance = covariance + error.offset_sd**2 * together
    diagonal = np.arange(len(rows))
    least = (LEAST_SD * seen.difference) ** 2
    covariance[..., diagonal, diagonal] += np.maximum(seen.variance, least)
    by_value = _log_of_each(seen.difference, covariance)
    counts = np.unique(cycle, return_counts=True)[1]
    ends_of_inspections = np.cumsum(counts)
    parts = np.split(by_value, ends_of_inspections[:-1], axis=-1)
    return [part.sum(axis=-1) for part in parts]


def _with_middles(block: Block, model: Array, sd: Array) -> kalman.Residuals:
    """Return values beside the model, those below a limit in the middle under it."""
    residuals = likelihood.compared(block, model, sd)
    observed = block.observed
    censored = observed.censored[block.rows]
    limit = np.where(censored, observed.below[block.rows], 0.0)
    difference = np.where(censored, MIDDLE * limit - model, residuals.difference)
    variance = residuals.variance + (SPREAD * limit) ** 2
    # a gain goes with the model, and so does an error in parts of what is measured
    if block.data.error.gain_sd and block.data.error.relative:
        variance = variance + (block.data.error.relative * model) ** 2
    return residuals._replace(difference=difference, variance=variance)


def _log_of_each(difference: Array, covariance: Array) -> Array:
    """Return the log density of each value given those before it, (…, n)."""
    root = np.linalg.cholesky(covariance)
    lanes = difference.shape[:-1]
    size = difference.shape[-1]
    roots = np.broadcast_to(root, (*lanes, size, size))
    standard = np.empty(difference.shape)
    for value in range(size):
        explained = np.sum(roots[..., value, :value] * standard[..., :value], axis=-1)
        left = difference[..., value] - explained
        standard[..., value] = left / roots[..., value, value]
    pivots = np.diagonal(roots, axis1=-2, axis2=-1)
    return -0.5 * (standard**2 + kalman.LOG_TWO_PI) - np.log(pivots)

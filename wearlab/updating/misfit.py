"""Whether wear bends away from the run's course, or breaks, whatever the error's sd.

Next to the model that fits best, m, with its slope J by ln of the factor, values may
follow one more power of the cycles, J x, or have broken at an inspection p, J max(1 −
p/x, 0), x being the share of the wear until now. Each is one more column of a weighted
regression, and its F grows with the share of the rest that it explains,

    (q·r)²/|r|² = F/(F + n − 2),

q being what is new in that column, of length 1. Of the probability of a false alarm the
power has `OF_POWER`, since most laws of wear bend, and all breaks together the rest:
the least of the columns' probabilities, each over its part, is compared with that of
random residuals. The sd drops out.
"""

import numpy as np
from scipy.stats import beta

from wearlab.arrays import Array
from wearlab.updating.data_blocks import Block, inspections_of, measured_blocks
from wearlab.updating.grids import Posterior
from wearlab.updating.likelihood import modelled
from wearlab.updating.run_curves import RunHistory

MIN_INSPECTIONS = 5
MOST_INSPECTIONS = 60  # of more, neighbouring ones are taken as one
ALARM = 0.015  # probability of a false alarm: in 200 clean sets mostly 4 or fewer
OF_POWER = 0.8  # of the probability of a false alarm, one more power; breaks the rest
RANDOM_SETS = 10_000  # of residuals, with which those of the data are compared
SEED = 58
NEARBY = 1e-4  # in ln factor, over which slopes are taken
STEPS = 4  # to the factor that fits best
SMALLEST = 1e-12  # of a column's length, below which nothing in it is new


def misfits(posterior: Posterior) -> dict[int, float]:
    """Return how probable a bend or break as clear is by chance, of each block.

    Only of blocks with inspections enough.

    Parameters
    ----------
    posterior : of runs, the first of which has a steady rate
    """
    found: dict[int, float] = {}
    run = posterior.histories[0]
    if posterior.prior is None:
        return found
    for number in measured_blocks(posterior.blocks):
        p = _misfit(posterior.blocks[number], run, number, posterior)
        if p is not None:
            found[number] = p
    return found


def _misfit(
    block: Block, run: RunHistory, number: int, posterior: Posterior
) -> float | None:
    """Return the probability of a bend or break as clear, None of too few."""
    observed = block.observed
    if observed.censored[block.rows].any():
        return None
    times = inspections_of(block, run, number, MOST_INSPECTIONS)
    if len(times) < MIN_INSPECTIONS:
        return None

    parts = [time.values for time in times]
    sd = float(np.exp(np.median(posterior.spreads[number][0][0])))
    model, slope = best_fit(block, run, number, sd, float(posterior.centre[0]))
    error = block.data.error
    relative = np.hypot(block.relative, run.scatter)
    variance = sd**2 + observed.sd[block.rows] ** 2 + (relative * model) ** 2
    weight = 1.0 / np.maximum(variance, 1e-300)

    def mean(values: Array) -> Array:
        """Return the weighted mean of values of each inspection."""
        sums = [np.sum(values[part] * weight[part]) for part in parts]
        return np.array(sums) / total

    total = np.array([weight[part].sum() for part in parts])
    rest = mean(observed.value[block.rows] - model)
    root = 1.0 / np.sqrt(1.0 / total + error.offset_sd**2)
    points = run.points[number]
    share = run.equal(np.array([time.cycle for time in times]), points.clock)
    columns = _columns(share / share[-1], mean(slope))
    return _probability(rest * root, mean(slope) * root, columns * root)


def best_fit(
    block: Block, run: RunHistory, number: int, sd: float, start: float
) -> tuple[Array, Array]:
    """Return the model that fits best and its slope by ln factor, of each value.

    Parameters
    ----------
    block, number : what was measured, and its place
    run : a stored run
    sd : standard deviation of a value [SI]
    start : ln of the factor to begin with
    """
    value = block.observed.value[block.rows]
    column_variance = block.observed.sd[block.rows] ** 2
    relative = np.hypot(block.relative, run.scatter)
    log_factor = start
    for _ in range(STEPS):
        model = modelled(block, run, number, np.exp(np.array(log_factor)))
        nearby = modelled(block, run, number, np.exp(np.array(log_factor + NEARBY)))
        slope = (nearby - model) / NEARBY
        variance = sd**2 + column_variance + (relative * model) ** 2
        weighted = slope / np.maximum(variance, 1e-300)
        step = np.sum(weighted * (value - model)) / np.sum(weighted * slope)
        log_factor += float(np.clip(step, -0.5, 0.5))
    return model, slope


def _columns(share: Array, slope: Array) -> Array:
    """Return what is added to the model: one more power, and breaks, (columns, n)."""
    last = len(share) - 2
    breaks = [
        np.maximum(1.0 - share[n] / np.maximum(share, share[0]), 0.0)
        for n in range(1, last)
    ]
    return np.stack([share, *breaks]) * slope


def _probability(rest: Array, slope: Array, columns: Array) -> float:
    """Return how probable it is that random residuals are explained as well.

    All are divided by the errors of inspections, up to a common scale.
    """
    along = slope / np.linalg.norm(slope)
    new = columns - np.outer(columns @ along, along)
    length = np.linalg.norm(new, axis=1)
    is_new = length > SMALLEST * np.linalg.norm(columns, axis=1)
    directions = new[is_new] / length[is_new, None]
    if not len(directions):
        return 1.0  # no column tells anything that the model does not
    part = _parts(len(columns))[is_new]
    part = part / part.sum()
    freedom = len(rest) - 2

    def explained(residuals: Array) -> Array:
        """Return the share that each column explains, (rows, columns)."""
        beside = residuals - np.outer(residuals @ along, along)
        squares = np.sum(beside**2, axis=1, keepdims=True)
        return np.asarray((beside @ directions.T) ** 2 / np.maximum(squares, 1e-300))

    of_columns = beta.sf(explained(rest[None])[0], 0.5, 0.5 * freedom)
    least = float(np.min(of_columns / part))
    as_clear = beta.isf(np.minimum(least * part, 1.0), 0.5, 0.5 * freedom)
    rng = np.random.default_rng(SEED)
    by_chance = explained(rng.standard_normal((RANDOM_SETS, len(rest))))
    simulated = (np.sum((by_chance >= as_clear).any(axis=1)) + 0.5) / RANDOM_SETS
    # what hardly any set has: no more than the sum of all columns' probabilities
    return float(min(simulated, least, 1.0))


def _parts(count: int) -> Array:
    """Return the part of each column in the probability of a false alarm, (count,)."""
    if count == 1:
        return np.ones(1)
    breaks = np.full(count - 1, (1.0 - OF_POWER) / (count - 1))
    return np.append(OF_POWER, breaks)

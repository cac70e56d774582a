"""How probable a block of observations is, for many coefficients and errors at once.

Very many values with independent errors are condensed first (`condensing`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import gammaln, log_ndtr, stdtr

from wearlab.arrays import Array
from wearlab.campaign.update_options import PREVIOUS
from wearlab.updating import condensing, kalman
from wearlab.updating.data_blocks import (
    Block,
    cycles_since,
    inspections_of,
    previous_inspection,
)
from wearlab.updating.run_curves import RunHistory

PER = 1e6  # cycles over which ``drift`` is said
VALUES_AT_ONCE = 2000  # that are summed together
DENSITIES_AT_ONCE = 2_000_000  # of Student's t, of all lanes


RunsWithLanes = Sequence[tuple[RunHistory, Any]]
"""Each run with its lanes: places of factors and errors along the first axis."""


class ParameterBatch(NamedTuple):
    """Parameters of the likelihood, any number of them at once: arrays that broadcast.

    Parameters
    ----------
    factor : on the wear coefficient [1]
    sd : standard deviation of a value [SI]
    drift : standard deviation of W in `PER` cycles [SI]
    """

    factor: Array
    sd: Array
    drift: Array

    @property
    def rate(self) -> Array:
        """Variance of W per cycle."""
        return np.asarray(self.drift**2 / PER)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of all arrays, broadcast."""
        shapes = (np.shape(self.factor), np.shape(self.sd), self.rate.shape)
        return np.broadcast_shapes(*shapes)


def modelled(block: Block, run: RunHistory, number: int, factor: Array) -> Array:
    """Return what the model says of each value that counts, (…, n) [SI].

    Parameters
    ----------
    block : observations
    run : a stored run
    number : place of the block in the run's points
    factor : on the wear coefficient, (…)
    """
    points = run.points[number]
    column = points.column[block.rows]
    factors = np.asarray(factor)[..., None]

    def wear_at(cycle: Array) -> Array:
        run_cycle = run.equivalent_cycle(cycle, factors, points.clock)
        return points.curve.at(run_cycle, column)

    cycle = points.cycle[block.rows]
    if not block.counts_since:
        return wear_at(cycle)
    return np.asarray(wear_at(cycle) - wear_at(cycles_since(block, run, number)))


def compared(
    block: Block, model: Array, sd: Array, scatter: Array | float = 0.0
) -> kalman.Residuals:
    """Return what was measured beside a model, as the filter takes it.

    Parameters
    ----------
    block : what was measured
    model : what is said of each value that counts, (…, n) [SI]
    sd : standard deviation of a value, (…) [SI]
    scatter : relative error besides, (…)
    """
    observed = block.observed
    rows = block.rows
    column_sd = observed.sd[rows]
    variance = np.asarray(sd**2)[..., None]
    variance = variance + column_sd**2 if column_sd.any() else variance
    relative = block.numerical if block.data.error.gain_sd else block.relative
    variance = variance + (relative * model) ** 2 if relative else variance
    if np.any(scatter):
        variance = variance + (np.asarray(scatter)[..., None] * model) ** 2

    censored = observed.censored[rows]
    difference = observed.value[rows] - model
    no_limit = np.full(len(rows), np.nan)
    if not censored.any():
        return kalman.Residuals(difference, variance, no_limit)
    limit = np.where(censored, observed.below[rows], no_limit)
    return kalman.Residuals(
        np.where(censored, 0.0, difference), variance, limit - model
    )


class LaneCycles(NamedTuple):
    """When the values of a block were measured, of each lane where runs differ.

    Parameters
    ----------
    cycle : (…, n) of each value
    start : from which wear counts
    elapsed : (…, n) since the inspection before, where wear is counted from it
    """

    cycle: Array
    start: Any
    elapsed: Array | None

    @property
    def last(self) -> Array:
        """The last inspection."""
        latest = self.cycle.max(axis=-1, initial=-np.inf)
        return np.asarray(np.maximum(latest, self.start))


def log_likelihood(
    block: Block,
    runs: RunHistory | RunsWithLanes,
    number: int,
    lanes: ParameterBatch,
    steps: kalman.Inspections = (),
) -> kalman.Filtered:
    """Return how probable the block is, and what is known of its drift or gain.

    Parameters
    ----------
    block, number : what was measured, and its place
    runs : the run; or several, each with its lanes along their first dimension
    lanes : coefficients and errors
    steps : inspections whose surprises are kept, each [none]
    """
    pairs: RunsWithLanes = [(runs, ...)] if isinstance(runs, RunHistory) else runs
    first_run = pairs[0][0]
    cycles = _cycles_of_lanes(block, pairs, number, lanes.shape)
    if not steps and condensing.condenses(block, first_run.points[number], lanes.sd):
        return _condensed_of_runs(block, pairs, number, lanes, cycles.last)

    model = np.empty((*np.shape(lanes.factor), len(block.rows)))
    for run, chosen in pairs:
        model[chosen] = modelled(block, run, number, lanes.factor[chosen])
    scatter = _by_lane([run.scatter for run, _ in pairs], pairs, lanes.shape)
    residuals = compared(block, model, lanes.sd, scatter)
    rate = lanes.rate
    if cycles.elapsed is not None:  # each value has a W of its own
        elapsed_variance = rate[..., None] * cycles.elapsed
        residuals = residuals._replace(variance=residuals.variance + elapsed_variance)
        rate = np.zeros_like(rate)

    error = block.data.error
    if error.gain_sd:
        measured = block.observed.value[block.rows]
        whole = kalman.Inspection(cycles.last, np.arange(len(block.rows)))
        times = steps or ([whole] if len(block.rows) else [])
        return kalman.with_gain(measured, model, residuals.variance, times, error)
    if not (steps or block.shares):
        freedoms = [run.freedom for run, _ in pairs]
        total = _independent(residuals, _by_lane(freedoms, pairs, lanes.shape))
        no_drift = np.zeros_like(total)
        return kalman.Filtered(total, no_drift, no_drift.copy(), cycles.last)

    times = steps or inspections_of(block, first_run, number)
    times = _times_of_lanes(times, cycles.cycle)
    since = block.data.since
    start = cycles.start if since in (None, PREVIOUS) else float(since)
    before_any = kalman.Filtered(cycle=start)
    return kalman.filtered(residuals, times, before_any, rate, steps=len(steps) > 0)


def _cycles_of_lanes(
    block: Block, pairs: RunsWithLanes, number: int, shape: tuple[int, ...]
) -> LaneCycles:
    """Return when the values of a block were measured, by the clock of each run."""
    cycles = [run.points[number].cycle[block.rows] for run, _ in pairs]
    begins = [run.begin(number) for run, _ in pairs]
    cycle = _by_lane(cycles, pairs, shape)
    elapsed = None
    if block.data.since == PREVIOUS:
        previous = list(map(previous_inspection, cycles, begins))
        elapsed = cycle - _by_lane(previous, pairs, shape)
    return LaneCycles(cycle, _by_lane(begins, pairs, shape), elapsed)


def _by_lane(items: Sequence[Any], pairs: RunsWithLanes, shape: tuple[int, ...]) -> Any:
    """Return what each run has, in its lanes; as it is where all are equal."""
    if all(np.array_equal(item, items[0]) for item in items[1:]):
        return items[0]
    inner = np.ones(len(shape) - 1, int)
    by_lane = np.empty((shape[0], *inner, *np.shape(items[0])))
    for (_, chosen), item in zip(pairs, items, strict=True):
        by_lane[chosen] = item
    return by_lane


def _times_of_lanes(times: kalman.Inspections, cycle: Array) -> kalman.Inspections:
    """Return inspections with the cycles of each lane."""
    return [
        time._replace(cycle=cycle[..., time.values[0]]) if len(time.values) else time
        for time in times
    ]


def _condensed_of_runs(
    block: Block,
    pairs: RunsWithLanes,
    number: int,
    lanes: ParameterBatch,
    last: Array,
) -> kalman.Filtered:
    """Return how probable very many values are, and what is known of their gain."""
    sums = np.empty((3, *lanes.shape))
    for run, chosen in pairs:
        factor = lanes.factor[chosen]
        sd = lanes.sd[chosen]
        sums[:, chosen] = condensing.condensed_log_likelihood(
            block, run, run.points[number], factor, sd
        )
    return kalman.Filtered(sums[0], sums[1], sums[2], last)


def _independent(residuals: kalman.Residuals, freedom: Array | float) -> Array:
    """Return the sum of the logs of independent densities, normal or Student's t.

    Of values below a limit of detection it has the probability to be there.
    """
    if np.isfinite(freedom).all():
        return _student(residuals, np.asarray(freedom)[..., None])
    difference, variance, room = residuals
    n = difference.shape[-1]
    hidden = kalman.censored_values(room)
    if variance.shape[-1] == 1 and not hidden.any():
        square = np.einsum("...i,...i->...", difference, difference)
        v = variance[..., 0]
        log_norm = n * (np.log(v) + kalman.LOG_TWO_PI)
        return np.asarray(-0.5 * (square / v + log_norm))

    lanes = np.broadcast_shapes(difference.shape[:-1], variance.shape[:-1])
    total = np.zeros(lanes)
    for begin in range(0, n, VALUES_AT_ONCE):
        part = slice(begin, begin + VALUES_AT_ONCE)
        r = difference[..., part]
        v = variance if variance.shape[-1] == 1 else variance[..., part]
        logs = -0.5 * (r**2 / v + np.log(v) + kalman.LOG_TWO_PI)
        if hidden[part].any():
            log_below = log_ndtr(room[..., part] / np.sqrt(v))
            logs = np.where(hidden[part], log_below, logs)
        total = total + logs.sum(axis=-1)
    return total


def _student(residuals: kalman.Residuals, freedom: Array) -> Array:
    """Return the sum of the logs of independent densities of Student's t law.

    Parameters
    ----------
    residuals : values beside the model, with the squares of their scales
    freedom : degrees of freedom, (…, 1)
    """
    difference, variance, room = residuals
    hidden = kalman.censored_values(room)
    lanes = np.broadcast_shapes(
        difference.shape[:-1], variance.shape[:-1], freedom.shape[:-1]
    )
    half = 0.5 * (freedom + 1.0)
    log_norm = gammaln(half) - gammaln(0.5 * freedom) - 0.5 * np.log(np.pi * freedom)
    total = np.zeros(lanes)
    at_once = max(DENSITIES_AT_ONCE // max(total.size, 1), 1)
    for begin in range(0, difference.shape[-1], at_once):
        part = slice(begin, begin + at_once)
        v = variance if variance.shape[-1] == 1 else variance[..., part]
        tail = half * np.log1p(difference[..., part] ** 2 / (freedom * v))
        logs = log_norm - 0.5 * np.log(v) - tail
        if hidden[part].any():
            below = stdtr(freedom, room[..., part] / np.sqrt(v))
            logs = np.where(hidden[part], np.log(np.maximum(below, 1e-300)), logs)
        total = total + logs.sum(axis=-1)
    return total

"""How probable a block of observations is, for many coefficients and errors at once.

Very many values with independent errors are condensed: between two states of a run the
model m is a cubic of the cycle, and the variance v of a value is smooth in it. What a
bin of values of neighbouring cycles adds to the likelihood is therefore known from
twelve cycles,

    Σ w (y − m)²/v + ln v = Σ_k (Y2_k − 2 d_k Y1_k + d_k² Y0_k)/v_k + N_k ln v_k,   d_k
    = m(t_k) − c,

with Y_n,k = Σ w (y − c)ⁿ L_k(t) over the values, L_k the Lagrange polynomials of those
cycles, N_k = Σ L_k, and c the bin's mean: exact where v does not change in a bin, to
1e-6 where the model changes by less than a tenth. A bin in which it changes by more, or
in which a state of the run falls, is compared value by value.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.special import log_ndtr

from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import PREVIOUS, Data, Limit
from wearlab.units import convert
from wearlab.updating import kalman, measurements
from wearlab.updating.run_curves import ObservationPoints, RunHistory

PER = 1e6  # cycles over which ``drift`` is said
MANY = 4000  # values from which independent ones are condensed
VALUES_AT_ONCE = 2000  # that are summed together
NUMBERS_AT_ONCE = 400_000  # of all factors and values, that are worked on together
MIN_BIN_SIZE = (
    128  # values; of more than its square, a bin has as many as there are bins
)
NODES = 12  # of a bin: exact for a cubic squared times a variance that goes with it
SMOOTH = 0.1  # relative change of the model in a bin up to which its variance is smooth
SURELY = 3.0  # standard deviations that a value is hardly off
MATTERS = 0.1  # numerical over measuring error from which it counts


class Spread(NamedTuple):
    """A standard deviation of the errors of one block.

    Parameters
    ----------
    name : what it is called in datasets
    known : its value, or the median of its prior [SI]
    prior : what is known of it, None where it is given
    scale : SI value of the prior's unit
    """

    name: str
    known: float
    prior: Distribution | None = None
    scale: float = 1.0


def largest_values(block: "Block") -> Array:
    """Return what values may be at most by their errors, (rows,) [SI].

    Parameters
    ----------
    block : observations
    """
    observed = block.observed
    value = np.where(observed.censored, observed.below, observed.value)[block.rows]
    relative = block.relative * value
    offset = block.data.error.offset_sd
    variance = block.sd.known**2 + observed.sd[block.rows] ** 2
    variance = variance + relative**2 + offset**2
    return np.asarray(value + SURELY * np.sqrt(variance))


def log_density(prior: Distribution, log_value: Array, scale: float = 1.0) -> Array:
    """Return the log of a prior's density per unit of ln value, however far out.

    Parameters
    ----------
    prior : of the value, in its own unit
    log_value : ln of the value [SI]
    scale : SI value of the prior's unit
    """
    log_in_unit = log_value - math.log(scale)
    return np.asarray(prior.log_density(np.exp(log_in_unit)) + log_in_unit)


RunsWithLanes = Sequence[tuple[RunHistory, Any]]
"""Each run with its lanes: places of factors and errors along the first axis."""


@dataclass(frozen=True)
class Block:
    """Observations with their errors, as the likelihood needs them.

    Parameters
    ----------
    observed : the observations
    rows : which of them count, (n,)
    sd, drift : spreads; a drift that is None is left out
    numerical : relative error of the runs, 0 where it is of no weight
    last_bins : memory of `bins`, of this block alone
    """

    observed: measurements.Observed
    rows: Index
    sd: Spread
    drift: Spread | None
    numerical: float = 0.0
    last_bins: dict[str, "RememberedBins"] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def data(self) -> Data:
        """What the file says of them."""
        return self.observed.data

    def measures(self, limit: Limit) -> bool:
        """Whether these are totals of what ends a life, at its place if one is named.

        Parameters
        ----------
        limit : what ends the life
        """
        data = self.data
        return (
            data.quantity == limit.quantity
            and limit.where in (None, data.where)
            and not self.counts_since
        )

    @property
    def counts_since(self) -> bool:
        """Whether values count from some later time than the first cycle."""
        return self.data.since is not None or self.observed.since is not None

    @property
    def shares(self) -> bool:
        """Whether values share an error."""
        return self.drift is not None or self.data.error.offset_sd > 0.0

    @property
    def relative(self) -> float:
        """The error of a value in parts of the model, numerical error included."""
        return math.hypot(self.data.error.relative, self.numerical)

    def drifting(self, drifts: bool) -> "Block":
        """Return the block with the drift that its file gives, or without one.

        Parameters
        ----------
        drifts : whether errors accumulate
        """
        return replace(
            block_of(self.observed, accumulating=drifts),
            rows=self.rows,
            numerical=self.numerical,
        )

    def bins(self, points: ObservationPoints, sd: float) -> tuple["Condensed", float]:
        """Return the values in bins, and the sum of the logs of their known variances.

        Without a column of errors all variances are one, and that sum is 0. The last
        bins are remembered: a posterior is made of many calls with the same points.

        Parameters
        ----------
        points : where the values stand on a run
        sd : standard deviation besides that of the column, where there is one [SI]
        """
        column_sd = self.observed.sd[self.rows]
        remembered_sd = sd if column_sd.any() else 0.0
        last = self.last_bins.get("bins")
        if last is not None and last.holds(points, remembered_sd):
            return last.bins, last.log_variances

        variance = column_sd**2 + sd**2 if column_sd.any() else np.ones(len(column_sd))
        bins = condensed(
            points.cycle[self.rows],
            points.column[self.rows],
            self.observed.value[self.rows],
            1.0 / variance,
        )
        log_variances = float(np.sum(np.log(variance)))
        self.last_bins["bins"] = RememberedBins(
            points.cycle, remembered_sd, bins, log_variances
        )
        return bins, log_variances


Blocks = Sequence[Block]


def measured_blocks(blocks: Blocks) -> list[int]:
    """Return the numbers of the blocks of which any value counts.

    Parameters
    ----------
    blocks : observations with their errors
    """
    return [n for n, block in enumerate(blocks) if len(block.rows)]


class UnknownError(NamedTuple):
    """An error of a block that is not known.

    Parameters
    ----------
    block : number of the block
    side : 0 of its standard deviation, 1 of its drift
    spread : the error
    prior : what is known of it before
    """

    block: int
    side: int
    spread: Spread
    prior: Distribution


def unknown_errors(blocks: Blocks) -> Iterator[UnknownError]:
    """Yield the unknown errors of blocks.

    Parameters
    ----------
    blocks : observations with their errors
    """
    for n, block in enumerate(blocks):
        for side, spread in enumerate((block.sd, block.drift)):
            if spread is not None and spread.prior is not None:
                yield UnknownError(n, side, spread, spread.prior)


def cycles_of(blocks: Blocks, run: RunHistory) -> Array:
    """Return the times of values that count in any block, rising [cycles].

    Parameters
    ----------
    blocks : observations
    run : a stored run that knows their cycles
    """
    return np.unique(
        [at for n, b in enumerate(blocks) for at in run.points[n].cycle[b.rows]]
    )


def select_by_cycle(
    blocks: Blocks, run: RunHistory, holds: Callable[..., Any], cycle: float
) -> tuple[Block, ...]:
    """Return blocks of those values whose cycles compare so with one.

    Parameters
    ----------
    blocks : observations
    run : a stored run that knows their cycles
    holds : comparison of cycles with one, such as ``np.less_equal``
    cycle : with which they are compared
    """
    pairs = zip(blocks, run.points, strict=True)
    return tuple(
        replace(b, rows=b.rows[holds(points.cycle[b.rows], cycle)])
        for b, points in pairs
    )


def block_of(observed: measurements.Observed, *, accumulating: bool) -> Block:
    """Return a block with all its observations.

    Parameters
    ----------
    observed : the observations
    accumulating : whether errors accumulate, where the file gives a drift
    """
    error = observed.data.error
    data = observed.data

    def spread(name: str, value: float | Distribution) -> Spread:
        if not isinstance(value, Distribution):
            return Spread(f"{name}_{data.label}", value)
        scale = 1.0 if value.unit is None else convert(1.0, value.unit, data.si)
        return Spread(f"{name}_{data.label}", value.at(0.5) * scale, value, scale)

    drift = (
        spread("drift", error.drift)
        if accumulating and error.drift is not None
        else None
    )
    return Block(
        observed,
        np.arange(len(observed)),
        spread("sd", 0.0 if error.sd is None else error.sd),
        drift,
    )


def numerical_share(block: Block, history: RunHistory) -> float:
    """Return the largest numerical error of the run over the smallest error of a value.

    Parameters
    ----------
    block : observations
    history : the run
    """
    error = block.data.error
    observed = block.observed
    sizes = np.abs(np.where(observed.censored, observed.below, observed.value))
    largest = np.nanmax(sizes, initial=0.0)

    sd = block.sd
    smallest_sd = sd.known if sd.prior is None else sd.prior.at(0.05) * sd.scale
    block_error = np.hypot(smallest_sd, error.relative * largest)
    errors = np.hypot(observed.sd, block_error)
    smallest_error = float(np.min(errors, initial=math.inf))
    if not smallest_error > 0.0:
        return 0.0
    relative = history.numerical_of(block.data.quantity)
    return float(relative * largest / smallest_error)


def inspections_of(
    block: Block, run: RunHistory, number: int, max_count: float = math.inf
) -> kalman.Inspections:
    """Return the inspections of a block: their times and the values of each.

    Values are numbered among those that count.

    Parameters
    ----------
    block : observations
    run : a stored run that knows their cycles
    number : place of the block in the run's points
    max_count : inspections from which on neighbouring ones are taken as one, in their
        middle; those that share an error are never
    """
    cycle = run.points[number].cycle[block.rows]
    offset_variance = block.data.error.offset_sd**2
    times, first = np.unique(np.sort(cycle), return_index=True)
    if not len(times):
        return []

    count = len(times) if block.shares else int(min(len(times), max_count))
    begins = np.linspace(0, len(times), count, endpoint=False).astype(np.intp)
    in_order = np.argsort(cycle, kind="stable")
    parts = np.split(in_order, first[begins][1:])
    sizes = np.diff(begins, append=len(times))
    middles = np.add.reduceat(times, begins) / sizes
    return [
        kalman.Inspection(float(middle), part, offset_variance)
        for middle, part in zip(middles, parts, strict=True)
    ]


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


def with_rows(block: Block, rows: Index) -> Block:
    """Return a block of which other values count.

    Parameters
    ----------
    block : observations
    rows : which of them
    """
    return replace(block, rows=rows)


def cycles_since(block: Block, run: RunHistory, number: int) -> Array:
    """Return the cycle from which each value counts, (n,).

    Parameters
    ----------
    block : observations
    run : a stored run
    number : place of the block in the run's points
    """
    points = run.points[number]
    cycle = points.cycle[block.rows]
    begin = run.begin(number)
    since = block.data.since
    if points.since is not None:
        # of a gear that is new, no earlier than it was
        return np.maximum(points.since[block.rows], begin)
    if since == PREVIOUS:
        return _previous_inspection(cycle, begin)
    return np.full_like(cycle, begin if since is None else float(since))


def compared(block: Block, model: Array, sd: Array) -> kalman.Residuals:
    """Return what was measured beside a model, as the filter takes it.

    Parameters
    ----------
    block : what was measured
    model : what is said of each value that counts, (…, n) [SI]
    sd : standard deviation of a value, (…) [SI]
    """
    observed = block.observed
    rows = block.rows
    column_sd = observed.sd[rows]
    variance = np.asarray(sd**2)[..., None]
    variance = variance + column_sd**2 if column_sd.any() else variance
    relative = block.numerical if block.data.error.gain_sd else block.relative
    variance = variance + (relative * model) ** 2 if relative else variance

    censored = observed.censored[rows]
    difference = observed.value[rows] - model
    no_limit = np.full(len(rows), np.nan)
    if not censored.any():
        return kalman.Residuals(difference, variance, no_limit)
    limit = np.where(censored, observed.below[rows], no_limit)
    return kalman.Residuals(
        np.where(censored, 0.0, difference), variance, limit - model
    )


def _previous_inspection(cycle: Array, start: float) -> Array:
    """Return the cycle of the inspection before each, ``start`` before the first."""
    times = np.unique(cycle)
    previous = np.append(start, times[:-1])
    return np.asarray(previous[np.searchsorted(times, cycle)])


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
    if not steps and condenses(block, first_run.points[number], lanes.sd):
        return _condensed_of_runs(block, pairs, number, lanes, cycles.last)

    model = np.empty((*np.shape(lanes.factor), len(block.rows)))
    for run, chosen in pairs:
        model[chosen] = modelled(block, run, number, lanes.factor[chosen])
    residuals = compared(block, model, lanes.sd)
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
        total = _independent(residuals)
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
        previous = list(map(_previous_inspection, cycles, begins))
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
        sums[:, chosen] = _condensed_log_likelihood(
            block, run, run.points[number], factor, sd
        )
    return kalman.Filtered(sums[0], sums[1], sums[2], last)


def _independent(residuals: kalman.Residuals) -> Array:
    """Return the sum of the logs of independent normal densities.

    Of values below a limit of detection it has the probability to be there.
    """
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


def condenses(block: Block, points: ObservationPoints, sd: Array) -> bool:
    """Whether the values are very many, and their errors differ by the model alone.

    Parameters
    ----------
    block : observations
    points : where they stand on a run
    sd : standard deviations of a value that are asked for [SI]
    """
    observed = block.observed
    rows = block.rows
    error = block.data.error
    bin_values = _bin_size(len(rows)) * points.curve.value.shape[-1]
    if len(rows) <= MANY or bin_values > len(rows):
        return False

    independent = (
        not block.shares
        and not block.counts_since
        and not observed.censored[rows].any()
    )
    variance_goes_with_gain = error.gain_sd and error.relative
    if not independent or variance_goes_with_gain:
        return False
    if not observed.sd[rows].any():
        return True
    return not block.relative and bool((sd == sd.flat[0]).all())


def one_by_one(block: Block, run: RunHistory, number: int) -> bool:
    """Whether values have to be compared one by one.

    They have where they share an error, or where their errors differ by more than the
    model says.

    Parameters
    ----------
    block : observations
    run : a stored run
    number : place of the block in the run's points
    """
    sds = [1.0] if block.sd.prior is None else [1.0, 2.0]
    return not condenses(block, run.points[number], np.array(sds))


def _bin_size(count: int) -> int:
    """Return how many values a bin has: as many as there are bins, if they are many."""
    return max(MIN_BIN_SIZE, math.isqrt(count))


class Condensed(NamedTuple):
    """Bins of values at neighbouring cycles and one place.

    The last of a place is filled up at weight 0.

    Parameters
    ----------
    column : (bins, 1) which column of the curve each is compared with
    cycle, value, weight : (bins, SIZE) of the values, cycles rising
    real : (bins, SIZE) 1, and 0 where a bin is filled up
    node : (bins, NODES) cycles at which the model is asked
    centre : (bins, 1) mean of the values
    moment : (3, bins, NODES) the sums Y0, Y1, Y2
    many : (bins, NODES) the sums N
    """

    column: Index
    cycle: Array
    value: Array
    weight: Array
    real: Array
    node: Array
    centre: Array
    moment: Array
    many: Array


class RememberedBins(NamedTuple):
    """The last bins of a block, and what they were made of.

    Parameters
    ----------
    cycle : of the values, the very array
    sd : standard deviation besides that of the column, 0 without a column [SI]
    bins : of the values
    log_variances : sum of the logs of their known variances
    """

    cycle: Array
    sd: float
    bins: Condensed
    log_variances: float

    def holds(self, points: ObservationPoints, sd: float) -> bool:
        """Whether the bins are of these points and this deviation."""
        return self.cycle is points.cycle and self.sd == sd


def condensed(cycle: Array, column: Index, value: Array, weight: Array) -> Condensed:
    """Return bins of values.

    Parameters
    ----------
    cycle : when, (n,)
    column : of the curve, with which each is compared, (n,)
    value : what was measured, (n,) [SI]
    weight : of its square, (n,)
    """
    order = np.lexsort((cycle, column))
    place, real = _bin_places(column, _bin_size(len(cycle)))
    place = order[place]
    cycles = cycle[place]
    values = value[place]
    weights = real * weight[place]

    low = cycles[:, :1]
    high = cycles[:, -1:]
    half = np.where(high > low, 0.5 * (high - low), 1.0)
    middle = 0.5 * (high + low)
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    polynomials = legendre.legvander((cycles - middle) / half, NODES - 1)
    lagrange = polynomials @ np.linalg.inv(legendre.legvander(nodes, NODES - 1))

    total = np.einsum("bs,bs->b", real, values)[:, None]
    centre = total / real.sum(axis=1, keepdims=True)
    powers = np.stack([(values - centre) ** n for n in range(3)])
    return Condensed(
        column=column[place[:, :1]],
        cycle=cycles,
        value=values,
        weight=weights,
        real=real,
        node=middle + 0.5 * (high - low) * nodes,
        centre=centre,
        moment=np.einsum("pbs,bs,bsk->pbk", powers, weights, lagrange),
        many=np.einsum("bs,bsk->bk", real, lagrange),
    )


def _bin_places(column: Index, size: int) -> tuple[Index, Array]:
    """Return which values of those in order are in each bin, and which are real.

    Bins hold values of one column; the last of a column is filled up with its last
    value.
    """
    counts = np.bincount(column)
    counts = counts[counts > 0]
    bins = -(-counts // size)
    ends = np.cumsum(counts)
    starts = [
        first + size * np.arange(count)
        for first, count in zip(ends - counts, bins, strict=True)
    ]
    end = np.repeat(ends, bins)[:, None]
    place = np.concatenate(starts)[:, None] + np.arange(size)
    return np.minimum(place, end - 1), (place < end).astype(float)


def _condensed_log_likelihood(
    block: Block, run: RunHistory, points: ObservationPoints, factor: Array, sd: Array
) -> Array:
    """Return the log likelihood of very many values, and mean and variance of the gain.

    Both are 0 without a gain. Factors go along the first of the lanes only.
    """
    bins, log_variances = block.bins(points, float(np.ravel(sd)[0]))
    sd = np.ones(1) if block.observed.sd[block.rows].any() else sd
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd))
    flat = np.ravel(factor)
    spread = np.broadcast_to(sd, shape).reshape(flat.size, -1)
    piece_count = max(flat.size * bins.node.size // NUMBERS_AT_ONCE, 1)
    pieces = np.array_split(np.arange(flat.size), piece_count)
    parts = [
        _piece_sums(bins, run, points, flat[chosen], spread[chosen], block)
        for chosen in pieces
    ]
    totals = np.concatenate(parts, axis=1).reshape(-1, *shape)
    gain_sd = block.data.error.gain_sd
    if not gain_sd:
        logs, chi = totals
        total = -0.5 * (chi + logs + log_variances)
        return np.stack([total, np.zeros(shape), np.zeros(shape)])
    sums = kalman.WeightedSums(
        square=totals[1],
        cross=totals[2],
        precision=totals[3],
        logs=totals[0] + log_variances,
    )
    state = kalman.update_state(1.0, gain_sd**2, sums)
    return np.stack([state.log_likelihood, state.mean, state.variance])


def _piece_sums(
    bins: Condensed,
    run: RunHistory,
    points: ObservationPoints,
    factor: Array,
    sd: Array,
    block: Block,
) -> Array:
    """Return sums of values for a few factors, (sums, factors, deviations).

    Σ ln 2πv and Σ (y − m)²/v; with a gain Σ ln 2πv, Σ y²/v, Σ m y/v and Σ m²/v.
    """
    has_gain = block.data.error.gain_sd > 0.0
    run_cycle = run.equivalent_cycle(bins.node, factor[:, None, None], points.clock)
    model = points.curve.at(run_cycle, bins.column)
    smooth = _smooth_bins(bins, run, points, factor)
    if block.relative:
        smallest = np.abs(model).min(axis=-1)
        largest = np.abs(model).max(axis=-1)
        smooth &= largest - smallest <= SMOOTH * smallest

    by_bin = smooth[..., None]
    terms = [
        np.where(by_bin, sums, 0.0) for sums in _sums_of_bins(bins, model, has_gain)
    ]
    counts = by_bin * bins.many
    total = _summed_over_bins(terms, counts, model, sd, block.relative)

    lane, uneven = np.nonzero(~smooth)
    pieces = max(len(lane) * bins.value.shape[1] // NUMBERS_AT_ONCE, 1)
    lane_pieces = np.array_split(lane, pieces)
    bin_pieces = np.array_split(uneven, pieces)
    for lanes, chosen in zip(lane_pieces, bin_pieces, strict=True):
        cycle = bins.cycle[chosen]
        run_cycle = run.equivalent_cycle(cycle, factor[lanes, None], points.clock)
        model = points.curve.at(run_cycle, bins.column[chosen])
        terms = _sums_of_values(bins, chosen, model, has_gain)
        counts = bins.real[chosen][:, None]
        piece_sums = _summed_over_bins(
            terms, counts, model[:, None], sd[lanes], block.relative
        )
        np.add.at(total, np.s_[:, lanes], piece_sums)  # type: ignore[arg-type]
    return total


def _sums_of_bins(bins: Condensed, model: Array, has_gain: bool) -> list[Array]:
    """Return Σ w (y − m)² of bins; with a gain Σ w y², m Σ w y, m² Σ w."""
    zeroth, once, twice = bins.moment
    centre = bins.centre
    if not has_gain:
        off = model - centre
        return [twice + off * (off * zeroth - 2.0 * once)]
    square = twice + centre * (centre * zeroth + 2.0 * once)
    first = once + centre * zeroth
    return [np.broadcast_to(square, model.shape), model * first, model * model * zeroth]


def _smooth_bins(
    bins: Condensed, run: RunHistory, points: ObservationPoints, factor: Array
) -> Flags:
    """Return in which bins the model is one cubic, without a state of the run."""
    ends = bins.cycle[:, [0, -1]]
    run_cycle = run.equivalent_cycle(ends, factor[:, None, None], points.clock)
    state = np.searchsorted(points.curve.cycle[1:], run_cycle, side="right")
    return np.asarray(state[..., 0] == state[..., 1])


def _sums_of_values(
    bins: Condensed, chosen: Index, model: Array, has_gain: bool
) -> list[Array]:
    """Return w (y − m)² of the values of some bins; with a gain w y², w m y, w m²."""
    value = bins.value[chosen]
    weight = bins.weight[chosen]
    if has_gain:
        squares = [value * value, model * value, model * model]
    else:
        squares = [(value - model) ** 2]
    return [(weight * square)[:, None] for square in squares]


def _summed_over_bins(
    sums: Sequence[Array], count: Array, model: Array, sd: Array, relative: float
) -> Array:
    """Return Σ count ln 2πv and sums over v, of bins and their places.

    The result is (1 + sums, lanes, deviations).
    """
    parts = [np.broadcast_to(count, sums[0].shape), *sums]
    if not relative:  # all have one variance
        parts = [terms.sum(axis=(1, 2), keepdims=True) for terms in parts]
        model = np.zeros((1, 1, 1))
    counts = parts[0]
    model_variance = (relative * model) ** 2
    total = np.empty((len(parts), *sd.shape))
    for j, column in enumerate(sd.T):
        sd_variance = column[:, None, None] ** 2
        variance = np.where(counts != 0.0, sd_variance + model_variance, 1.0)
        logs = counts * np.log(2.0 * np.pi * variance)
        total[0, :, j] = logs.sum(axis=(1, 2))
        for k, terms in enumerate(parts[1:], 1):
            total[k, :, j] = (terms / variance).sum(axis=(1, 2))
    return total

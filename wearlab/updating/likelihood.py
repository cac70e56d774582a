"""How probable a block of observations is, for every wear coefficient, error and drift at once.

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
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.special import log_ndtr

from wearlab.arrays import Array, Index
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import PREVIOUS, Data, Limit
from wearlab.units import convert
from wearlab.updating import kalman, measurements
from wearlab.updating.run_curves import ObservationPoints, RunHistory

PER = 1e6  # cycles over which ``drift`` is said
MANY = 4000  # values from which independent ones are condensed
PIECE, NUMBERS = 2000, 400_000  # values, and numbers, that are worked on at once
SIZE = (
    128  # values of a bin, at least; of more than its square, as many as there are bins
)
NODES = 12  # of a bin: exact for a cubic squared times a variance that goes with it
SMOOTH = 0.1  # relative change of the model in a bin up to which its variance is smooth
MATTERS = 0.1  # numerical over measuring error from which it counts


class Spread(NamedTuple):
    """A standard deviation of one block [SI]: its name, its median, its prior where it is unknown."""

    name: str
    known: float
    prior: Distribution | None = None
    scale: float = 1.0


def log_density(prior: Distribution, log_value: Array, scale: float = 1.0) -> Array:
    """Return the log of a prior's density per unit of ln value, in so much of its unit.

    However far out.
    """
    log_in_unit = log_value - math.log(scale)
    return np.asarray(prior.log_density(np.exp(log_in_unit)) + log_in_unit)


RunsWithLanes = Sequence[
    tuple[RunHistory, Any]
]  # each run with the lanes that are its own


@dataclass(frozen=True)
class Block:
    """Observations with their errors, as the likelihood needs them.

    Parameters
    ----------
    observed : the observations
    rows : which of them count, (n,)
    sd, drift : spreads; a drift that is None is left out
    numerical : relative error of the runs, 0 where it is of no weight
    """

    observed: measurements.Observed
    rows: Index
    sd: Spread
    drift: Spread | None
    numerical: float = 0.0

    @property
    def data(self) -> Data:
        """What the file says of them."""
        return self.observed.data

    def measures(self, limit: Limit) -> bool:
        """Whether it is of the totals of what ends a life, of the same place where one is named."""
        data = self.data
        return (
            data.quantity == limit.quantity
            and limit.where in (None, data.where)
            and data.since is None
        )

    @property
    def shares(self) -> bool:
        """Whether values share an error."""
        return self.drift is not None or self.data.error.offset_sd > 0.0

    @property
    def relative(self) -> float:
        """The error of a value in parts of the model: what is measured, and the run's own."""
        return math.hypot(self.data.error.relative, self.numerical)

    def drifting(self, drifts: bool) -> "Block":
        """Return it with the drift that is given for it, or without one."""
        return replace(
            block_of(self.observed, accumulating=drifts),
            rows=self.rows,
            numerical=self.numerical,
        )

    def bins(self, asked: ObservationPoints, sd: float) -> tuple["Condensed", float]:
        """Return its values in bins, and the sum of the logs of their variances where a column tells them.

        The last ones are kept: they are asked for again and again.

        Parameters
        ----------
        asked : what it asks of a run
        sd : of a value, where a column tells another of each
        """
        own = self.observed.sd[self.rows]
        kept = self.__dict__.get("_bins")
        if kept is None or kept[0] is not asked.cycle or kept[1] != (own.any() and sd):
            variance = own**2 + sd**2 if own.any() else np.ones(len(own))
            cycle = asked.cycle[self.rows]
            column = asked.column[self.rows]
            value = self.observed.value[self.rows]
            made = (
                condensed(cycle, column, value, 1.0 / variance),
                float(np.sum(np.log(variance))),
            )
            kept = self.__dict__["_bins"] = (asked.cycle, own.any() and sd, made)
        return kept[2]


Blocks = Sequence[Block]


def measured_blocks(blocks: Blocks) -> list[int]:
    """Return the numbers of the blocks of which any value counts."""
    return [n for n, block in enumerate(blocks) if len(block.rows)]


def unknown_errors(blocks: Blocks) -> Iterator[tuple[int, int, Spread, Distribution]]:
    """Yield the unknown errors: number of the block, 0 of its sd or 1 of its drift, it, and its prior."""
    for n, block in enumerate(blocks):
        for side, spread in enumerate((block.sd, block.drift)):
            if spread is not None and spread.prior is not None:
                yield n, side, spread, spread.prior


def cycles_of(blocks: Blocks, run: RunHistory) -> Array:
    """Return the times of values that count in any block, rising [cycles]."""
    return np.unique(
        [at for n, b in enumerate(blocks) for at in run.points[n].cycle[b.rows]]
    )


def select_by_cycle(
    blocks: Blocks, run: RunHistory, holds: Callable[..., Any], cycle: float
) -> tuple[Block, ...]:
    """Return blocks of which those values count that did and whose cycles compare so with one."""
    pairs = zip(blocks, run.points, strict=True)
    return tuple(
        replace(b, rows=b.rows[holds(points.cycle[b.rows], cycle)])
        for b, points in pairs
    )


def block_of(observed: measurements.Observed, *, accumulating: bool) -> Block:
    """Return a block with all its observations."""
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
    """Return the largest numerical error of the run over the smallest error of a value."""
    error = block.data.error
    observed = block.observed
    value = np.nanmax(
        np.abs(np.where(observed.censored, observed.below, observed.value)), initial=0.0
    )
    smallest_sd = (
        block.sd.known
        if block.sd.prior is None
        else block.sd.prior.at(0.05) * block.sd.scale
    )
    smallest_error = float(
        np.min(
            np.hypot(observed.sd, np.hypot(smallest_sd, error.relative * value)),
            initial=math.inf,
        )
    )
    return (
        float(history.numerical_of(block.data.quantity) * value / smallest_error)
        if smallest_error > 0.0
        else 0.0
    )


def inspections_of(
    block: Block, run: RunHistory, number: int, max_count: float = math.inf
) -> kalman.Inspections:
    """Return the times of a block's values that count, each with the places of its values among those.

    Of more than ``most`` times whose values share no error, neighbouring ones are one,
    in their middle.
    """
    cycle = run.points[number].cycle[block.rows]
    offset = block.data.error.offset_sd**2
    times, first = np.unique(np.sort(cycle), return_index=True)
    if not len(times):
        return []
    count = len(times) if block.shares else int(min(len(times), max_count))
    begins = np.linspace(0, len(times), count, endpoint=False).astype(np.intp)
    parts = np.split(np.argsort(cycle, kind="stable"), first[begins][1:])
    middles = np.add.reduceat(times, begins) / np.diff(begins, append=len(times))
    return [
        kalman.Inspection(float(t), part, offset)
        for t, part in zip(middles, parts, strict=True)
    ]


class ParameterBatch(NamedTuple):
    """What a likelihood is asked for, any number of them at once: arrays that go together by broadcasting.

    Parameters
    ----------
    factor : on the wear coefficient [1]
    sd : standard deviation of a value [SI]
    drift : standard deviation of W in `PER` cycles [SI]
    """

    factor: Array
    sd: Array
    drift: Array


def modelled(block: Block, run: RunHistory, number: int, factor: Array) -> Array:
    """Return what the model says of each value that counts, (…, n), for factors on the coefficient (…)."""
    points = run.points[number]
    f = np.asarray(factor)[..., None]
    cycle = points.cycle[block.rows]
    column = points.column[block.rows]
    since = block.data.since
    depth = points.curve.at(run.equivalent_cycle(cycle, f, points.clock), column)
    if since is None:
        return depth
    first = (
        _previous_inspection(cycle, run.begin(number))
        if since == PREVIOUS
        else np.full_like(cycle, float(since))
    )
    return np.asarray(
        depth - points.curve.at(run.equivalent_cycle(first, f, points.clock), column)
    )


def compared(block: Block, model: Array, sd: Array) -> kalman.Compared:
    """Return measured minus model, the variance of independent errors, and limits minus model.

    The last is NaN of values that were seen, (n,) where all were; the first is 0 of
    those that were not.

    Parameters
    ----------
    block : what was measured
    model : what is said of each value that counts, (…, n)
    sd : (…) of a value
    """
    observed = block.observed
    rows = block.rows
    column_sd = observed.sd[rows]
    variance = np.asarray(sd**2)[..., None]
    variance = variance + column_sd**2 if column_sd.any() else variance
    relative = block.numerical if block.data.error.gain_sd else block.relative
    variance = variance + (relative * model) ** 2 if relative else variance
    censored = observed.censored[rows]
    residual = observed.value[rows] - model
    nothing = np.full(len(rows), np.nan)
    if not censored.any():
        return residual, variance, nothing
    return (
        np.where(censored, 0.0, residual),
        variance,
        np.where(censored, observed.below[rows], nothing) - model,
    )


def _previous_inspection(cycle: Array, start: float) -> Array:
    times = np.unique(cycle)
    return np.asarray(np.append(start, times[:-1])[np.searchsorted(times, cycle)])


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
    runs : the run; or several, each with those lanes along their first dimension that
        are its own
    lanes : coefficients and errors
    steps : inspections whose surprises are kept, each [none]
    """
    pairs: RunsWithLanes = [(runs, ...)] if isinstance(runs, RunHistory) else runs
    (factor, sd, drift) = lanes
    data = block.data
    rows = block.rows
    rate = drift**2 / PER
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd), rate.shape)

    def of_lanes(items: Sequence[Any]) -> Any:
        """Return what each run has, of each lane; once where all have the same."""
        if all(np.array_equal(item, items[0]) for item in items[1:]):
            return items[0]
        by_batch = np.empty(
            (shape[0], *np.ones(len(shape) - 1, int), *np.shape(items[0]))
        )
        for (_, mine), item in zip(pairs, items, strict=True):
            by_batch[mine] = item
        return by_batch

    cycles = [run.points[number].cycle[rows] for run, _ in pairs]
    begins = [run.begin(number) for run, _ in pairs]
    cycle = of_lanes(cycles)
    start = of_lanes(begins)
    last = np.maximum(cycle.max(axis=-1, initial=-np.inf), start)
    if not steps and condenses(block, pairs[0][0].points[number], sd):
        sums = np.empty((3, *shape))
        for run, mine in pairs:
            sums[:, mine] = _condensed_log_likelihood(
                block, run, run.points[number], factor[mine], sd[mine]
            )
        return kalman.Filtered(sums[0], sums[1], sums[2], last)
    model = np.empty((*np.shape(factor), len(rows)))
    for run, mine in pairs:
        model[mine] = modelled(block, run, number, factor[mine])
    residual, variance, room = compared(block, model, sd)
    if data.since == PREVIOUS:
        elapsed = cycle - of_lanes(list(map(_previous_inspection, cycles, begins)))
        variance = variance + rate[..., None] * elapsed
        rate = np.zeros_like(rate)
    elif data.since is not None:
        start = float(data.since)
    if not (steps or block.shares or data.error.gain_sd):
        total = _independent(residual, variance, room)
        return kalman.Filtered(total, np.zeros_like(total), np.zeros_like(total), last)
    if data.error.gain_sd:
        whole = [kalman.Inspection(last, np.arange(len(rows)))][: len(rows)]
        return kalman.with_gain(
            block.observed.value[rows], model, variance, steps or whole, data.error
        )
    times = steps or inspections_of(block, pairs[0][0], number)
    times = [
        item._replace(cycle=cycle[..., item.values[0]]) if len(item.values) else item
        for item in times
    ]
    start_state = kalman.Filtered(cycle=start)
    return kalman.filtered(
        (residual, variance, room), times, start_state, rate, steps=len(steps) > 0
    )


def _independent(residual: Array, variance: Array, room: Array) -> Array:
    """Return the sum of the logs of independent normal densities.

    Of probabilities where values are below.
    """
    n = residual.shape[-1]
    hidden = kalman.censored_values(room)
    if variance.shape[-1] == 1 and not hidden.any():
        square = np.einsum("...i,...i->...", residual, residual)
        v = variance[..., 0]
        return np.asarray(-0.5 * (square / v + n * (np.log(v) + kalman.LOG_TWO_PI)))
    total = np.zeros(np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1]))
    for part in (slice(begin, begin + PIECE) for begin in range(0, n, PIECE)):
        r = residual[..., part]
        v = variance if variance.shape[-1] == 1 else variance[..., part]
        logs = -0.5 * (r**2 / v + np.log(v) + kalman.LOG_TWO_PI)
        if hidden[part].any():
            logs = np.where(hidden[part], log_ndtr(room[..., part] / np.sqrt(v)), logs)
        total = total + logs.sum(axis=-1)
    return total


def condenses(block: Block, points: ObservationPoints, sd: Array) -> bool:
    """Whether the values are very many, and their errors differ by the model alone."""
    observed = block.observed
    rows = block.rows
    error = block.data.error
    if len(rows) <= MANY or _size(len(rows)) * points.curve.value.shape[-1] > len(rows):
        return False
    independent = (
        not block.shares
        and block.data.since is None
        and not observed.censored[rows].any()
    )
    if not independent or (
        error.gain_sd and error.relative
    ):  # the variance goes with the gain
        return False
    return not observed.sd[rows].any() or (
        not block.relative and bool((sd == sd.flat[0]).all())
    )


def one_by_one(block: Block, run: RunHistory, number: int) -> bool:
    """Whether values have to be compared one by one: they share an error, or their errors differ by more."""
    return not condenses(
        block,
        run.points[number],
        np.array([1.0] if block.sd.prior is None else [1.0, 2.0]),
    )


def _size(count: int) -> int:
    """Return how many values a bin has: as many as there are bins, where values are very many."""
    return max(SIZE, math.isqrt(count))


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


def condensed(cycle: Array, column: Index, value: Array, weight: Array) -> Condensed:
    """Return bins of values: when, which column of the curve, what was measured, of its square; each (n,)."""
    order = np.lexsort((cycle, column))
    size = _size(len(cycle))
    counts = np.bincount(column)
    counts = counts[counts > 0]
    bins = -(-counts // size)
    ends = np.cumsum(counts)
    start = np.concatenate(
        [f + size * np.arange(b) for f, b in zip(ends - counts, bins, strict=True)]
    )
    end = np.repeat(ends, bins)[:, None]
    place = start[:, None] + np.arange(size)
    real = (place < end).astype(float)
    place = order[np.minimum(place, end - 1)]
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
    centre = np.einsum("bs,bs->b", real, values)[:, None] / real.sum(
        axis=1, keepdims=True
    )
    powers = np.stack([(values - centre) ** n for n in range(3)])
    moment = np.einsum("pbs,bs,bsk->pbk", powers, weights, lagrange)
    node = middle + 0.5 * (high - low) * nodes
    count = np.einsum("bs,bsk->bk", real, lagrange)
    return Condensed(
        column[place[:, :1]], cycles, values, weights, real, node, centre, moment, count
    )


def _condensed_log_likelihood(
    block: Block, run: RunHistory, points: ObservationPoints, factor: Array, sd: Array
) -> Array:
    """Return the log likelihood of very many values, and mean and variance of what the gain is more than 1.

    Factors go along the first of the lanes only.
    """
    bins, constant = block.bins(points, float(np.ravel(sd)[0]))
    sd = np.ones(1) if block.observed.sd[block.rows].any() else sd
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd))
    flat = np.ravel(factor)
    spread = np.broadcast_to(sd, shape).reshape(flat.size, -1)
    pieces = np.array_split(
        np.arange(flat.size), max(flat.size * bins.node.size // NUMBERS, 1)
    )
    parts = [
        _piece_sums(bins, run, points, flat[chosen], spread[chosen], block)
        for chosen in pieces
    ]
    logs, chi, *gain_sums = np.concatenate(parts, axis=1).reshape(-1, *shape)
    if gain_sums:
        return np.stack(
            kalman.update_state(
                1.0, block.data.error.gain_sd**2, (chi, *gain_sums, logs + constant)
            )[2:]
        )
    return np.stack([-0.5 * (chi + logs + constant), np.zeros(shape), np.zeros(shape)])


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
    curve = points.curve
    f = factor[:, None, None]
    model = curve.at(run.equivalent_cycle(bins.node, f, points.clock), bins.column)
    zeroth, once, twice = bins.moment
    if block.data.error.gain_sd:
        square = np.broadcast_to(
            twice + bins.centre * (bins.centre * zeroth + 2.0 * once), model.shape
        )
        sums = [square, model * (once + bins.centre * zeroth), model * model * zeroth]
    else:
        off = model - bins.centre
        sums = [twice + off * (off * zeroth - 2.0 * once)]
    outer = run.equivalent_cycle(bins.cycle[:, [0, -1]], f, points.clock)
    ends = np.searchsorted(curve.cycle[1:], outer, side="right")
    smooth = ends[..., 0] == ends[..., 1]
    if block.relative:
        smallest = np.abs(model).min(axis=-1)
        largest = np.abs(model).max(axis=-1)
        smooth &= largest - smallest <= SMOOTH * smallest
    select_by_cycle = smooth[..., None]
    total = _summed_over_bins(
        [np.where(select_by_cycle, terms, 0.0) for terms in sums],
        select_by_cycle * bins.many,
        model,
        sd,
        block.relative,
    )
    lane, uneven = np.nonzero(~smooth)
    pieces = max(len(lane) * bins.value.shape[1] // NUMBERS, 1)
    for i, b in zip(
        np.array_split(lane, pieces), np.array_split(uneven, pieces), strict=True
    ):
        uneven_model = curve.at(
            run.equivalent_cycle(bins.cycle[b], factor[i, None], points.clock),
            bins.column[b],
        )
        value = bins.value[b]
        weight = bins.weight[b]
        squares = (
            (value * value, uneven_model * value, uneven_model * uneven_model)
            if len(sums) > 1
            else ((value - uneven_model) ** 2,)
        )
        terms = [(weight * square)[:, None] for square in squares]
        piece_sums = _summed_over_bins(
            terms, bins.real[b][:, None], uneven_model[:, None], sd[i], block.relative
        )
        np.add.at(total, np.s_[:, i], piece_sums)  # type: ignore[arg-type]
    return total


def _summed_over_bins(
    sums: Sequence[Array], count: Array, model: Array, sd: Array, relative: float
) -> Array:
    """Return Σ count ln 2πv and sums over v, of bins and their places, (1 + sums, lanes, deviations)."""
    parts = [np.broadcast_to(count, sums[0].shape), *sums]
    if not relative:  # all have one variance
        parts = [terms.sum(axis=(1, 2), keepdims=True) for terms in parts]
        model = np.zeros((1, 1, 1))
    total = np.empty((len(parts), *sd.shape))
    for j, column in enumerate(sd.T):
        variance = np.where(
            parts[0] != 0.0, column[:, None, None] ** 2 + (relative * model) ** 2, 1.0
        )
        logs = parts[0] * np.log(2.0 * np.pi * variance)
        total[:, :, j] = [
            logs.sum(axis=(1, 2)),
            *((terms / variance).sum(axis=(1, 2)) for terms in parts[1:]),
        ]
    return total

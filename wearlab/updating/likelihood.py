"""How probable a block of observations is, for every wear coefficient, error and drift at once.

Very many values with independent errors are condensed: between two states of a run the model m is a cubic of
the cycle, and the variance v of a value is smooth in it. What a bin of values of neighbouring cycles adds to
the likelihood is therefore known from twelve cycles,

    Σ w (y − m)²/v + ln v = Σ_k (Y2_k − 2 d_k Y1_k + d_k² Y0_k)/v_k + N_k ln v_k,   d_k = m(t_k) − c,

with Y_n,k = Σ w (y − c)ⁿ L_k(t) over the values, L_k the Lagrange polynomials of those cycles, N_k = Σ L_k,
and c the bin's mean: exact where v does not change in a bin, to 1e-6 where the model changes by less than a
tenth. A bin in which it changes by more, or in which a state of the run falls, is compared value by value.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.special import log_ndtr

from wearlab.arrays import Array, Index
from wearlab.campaign.distributions import SMALLEST, Distribution
from wearlab.campaign.update_options import PREVIOUS, Data, Limit
from wearlab.units import convert
from wearlab.updating import kalman, measurements
from wearlab.updating.run_curves import Asked, RunHistory

PER = 1e6  # cycles over which ``drift`` is said
MANY = 4000  # values from which independent ones are condensed
PIECE, NUMBERS = 2000, 400_000  # values, and numbers, that are worked on at once
SIZE = 128  # values of a bin, at least; of more than its square, as many as there are bins
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
    """Return the log of a prior's density per unit of ln value, in so much of its unit; however far out."""
    own = log_value - math.log(scale)
    found: Array = prior.log_density(np.exp(own)) + own
    return found


OfRuns = Sequence[tuple[RunHistory, Any]]  # each run with the lanes that are its own


class Range(NamedTuple):
    """Where ln of an unknown is looked for, and what its prior allows at all; each (runs,)."""

    low: Array
    high: Array
    least: Array
    most: Array


def range_of(prior: Distribution, runs: int, scale: float = 1.0) -> Range:
    """Return the range of ln value of a prior, by run; a normal law allows more than it starts with."""
    with np.errstate(divide="ignore"):
        low, high = np.log(scale * np.array([prior.at(SMALLEST), prior.at(1.0 - SMALLEST)])).tolist()
        ends = np.log(scale * np.array([max(prior.low, 0.0), prior.high])).tolist()
    if not np.isfinite(low):  # a normal law of what is positive
        low = math.log(scale * prior.at(0.5)) - 40.0
    allowed = ends if prior.word in ("lognormal", "normal") else (low, high)
    return Range(*(np.full(runs, end) for end in (low, high, *allowed)))


@dataclass(frozen=True)
class Block:
    """Observations with their errors, as the likelihood needs them.

    Parameters
    ----------
    seen : the observations
    rows : which of them count, (n,)
    sd, drift : spreads; a drift that is None is left out
    numerical : relative error of the runs, 0 where it is of no weight
    """

    seen: measurements.Observed
    rows: Index
    sd: Spread
    drift: Spread | None
    numerical: float = 0.0

    @property
    def data(self) -> Data:
        """What the file says of them."""
        return self.seen.data

    def measures(self, limit: Limit) -> bool:
        """Whether it is of the totals of what ends a life, of the same place where one is named."""
        own = self.data
        return own.quantity == limit.quantity and limit.where in (None, own.where) and own.since is None

    @property
    def relative(self) -> float:
        """The error of a value in parts of the model: what is measured, and the run's own."""
        return math.hypot(self.data.error.relative, self.numerical)

    def drifting(self, drifts: bool) -> "Block":
        """Return it with the drift that is given for it, or without one."""
        other = block_of(self.seen, accumulating=drifts)
        return replace(other, rows=self.rows, numerical=self.numerical)

    def bins(self, asked: Asked, sd: float) -> tuple["Condensed", float]:
        """Return its values in bins, and the sum of the logs of their variances where a column tells them.

        The last ones are kept: they are asked for again and again.

        Parameters
        ----------
        asked : what it asks of a run
        sd : of a value, where a column tells another of each
        """
        own = self.seen.sd[self.rows]
        kept = self.__dict__.get("_bins")
        if kept is None or kept[0] is not asked.cycle or kept[1] != (own.any() and sd):
            variance = own**2 + sd**2 if own.any() else np.ones(len(own))
            cycle, column, value = asked.cycle[self.rows], asked.column[self.rows], self.seen.value[self.rows]
            made = condensed(cycle, column, value, 1.0 / variance), float(np.sum(np.log(variance)))
            kept = self.__dict__["_bins"] = (asked.cycle, own.any() and sd, made)
        return kept[2]


Blocks = Sequence[Block]


def cycles_of(blocks: Blocks, run: RunHistory) -> Array:
    """Return the times of values that count in any block, rising [cycles]."""
    return np.unique([at for n, b in enumerate(blocks) for at in run.asked[n].cycle[b.rows]])


def held(
    blocks: Blocks, run: RunHistory, holds: Callable[[Array, float], Any], cycle: float
) -> tuple[Block, ...]:
    """Return blocks of which those values count that did and whose cycles compare so with one."""
    cycles = [run.asked[n].cycle[block.rows] for n, block in enumerate(blocks)]
    both = zip(blocks, cycles, strict=True)
    return tuple(replace(block, rows=block.rows[holds(at, cycle)]) for block, at in both)


def block_of(seen: measurements.Observed, *, accumulating: bool) -> Block:
    """Return a block with all its observations."""
    error, data = seen.data.error, seen.data

    def spread(name: str, given: float | Distribution) -> Spread:
        if not isinstance(given, Distribution):
            return Spread(f"{name}_{data.label}", given)
        scale = 1.0 if given.unit is None else convert(1.0, given.unit, data.si)
        return Spread(f"{name}_{data.label}", given.at(0.5) * scale, given, scale)

    drift = spread("drift", error.drift) if accumulating and error.drift is not None else None
    return Block(seen, np.arange(len(seen)), spread("sd", 0.0 if error.sd is None else error.sd), drift)


def numerical_share(block: Block, history: RunHistory) -> float:
    """Return the largest numerical error of the run over the smallest error of a value."""
    error, seen = block.data.error, block.seen
    value = np.nanmax(np.abs(np.where(seen.censored, seen.below, seen.value)), initial=0.0)
    least = block.sd.known if block.sd.prior is None else block.sd.prior.at(0.05) * block.sd.scale
    own = float(np.min(np.hypot(seen.sd, np.hypot(least, error.relative * value)), initial=math.inf))
    return float(history.numerical_of(block.data.quantity) * value / own) if own > 0.0 else 0.0


def inspections_of(block: Block, history: RunHistory, number: int) -> list[kalman.Inspection]:
    """Return the times of a block's values that count, each with the places of its values among those."""
    times, inverse = np.unique(history.asked[number].cycle[block.rows], return_inverse=True)
    if not len(times):
        return []
    order = np.argsort(inverse, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(inverse, minlength=len(times)))[:-1])
    own, offset = zip(times, parts, strict=True), block.data.error.offset_sd**2
    return [kalman.Inspection(float(t), part.astype(np.intp), offset) for t, part in own]


class Lanes(NamedTuple):
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
    asked, f = run.asked[number], np.asarray(factor)[..., None]
    cycle, column, since = asked.cycle[block.rows], asked.column[block.rows], block.data.since
    depth = asked.curve.at(run.own_cycle(cycle, f, asked.clock), column)
    if since is None:
        return depth
    first = _previous(cycle, run.begin(number)) if since == PREVIOUS else np.full_like(cycle, float(since))
    return np.asarray(depth - asked.curve.at(run.own_cycle(first, f, asked.clock), column))


def compared(block: Block, model: Array, sd: Array) -> tuple[Array, Array, kalman.Hidden | None]:
    """Return measured minus model, the variance of independent errors, and what is known by a limit alone.

    Parameters
    ----------
    block : what was measured
    model : what is said of each value that counts, (…, n)
    sd : (…) of a value
    """
    seen, rows = block.seen, block.rows
    own, variance = seen.sd[rows], np.asarray(sd**2)[..., None]
    variance = variance + own**2 if own.any() else variance
    relative = block.numerical if block.data.error.gain_sd else block.relative
    variance = variance + (relative * model) ** 2 if relative else variance
    which, residual = seen.censored[rows], seen.value[rows] - model
    if not which.any():
        return residual, variance, None
    room = np.where(which, seen.below[rows], 0.0) - model
    return np.where(which, 0.0, residual), variance, kalman.Hidden(which, room)


def _previous(cycle: Array, start: float) -> Array:
    times = np.unique(cycle)
    return np.asarray(np.append(start, times[:-1])[np.searchsorted(times, cycle)])


def log_likelihood(
    block: Block, runs: RunHistory | OfRuns, number: int, lanes: Lanes, *, steps: bool = False
) -> kalman.Filtered:
    """Return how probable the block is, and what is known of its drift or gain.

    Parameters
    ----------
    block, number : what was measured, and its place
    runs : the run; or several, each with those lanes along their first dimension that are its own
    lanes : coefficients and errors
    steps : whether each inspection's surprise is kept
    """
    pairs: OfRuns = [(runs, ...)] if isinstance(runs, RunHistory) else runs
    (factor, sd, drift), data, rows = lanes, block.data, block.rows
    rate = drift**2 / PER
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd), rate.shape)

    asked = pairs[0][0].asked[number]

    def of_lanes(told: Callable[[Array, float], Any]) -> Any:
        """Return what is told of the cycles of all runs, of each lane where they differ."""
        each = [told(run.asked[number].cycle[rows], run.begin(number)) for run, _ in pairs]
        if all(np.array_equal(one, each[0]) for one in each[1:]):
            return each[0]
        found = np.empty((shape[0], *np.ones(len(shape) - 1, int), *np.shape(each[0])))
        for (_, mine), one in zip(pairs, each, strict=True):
            found[mine] = one
        return found

    last = of_lanes(lambda cycle, begin: cycle.max(initial=begin))
    shares = bool(np.any(rate > 0.0)) or data.error.offset_sd > 0.0
    if not steps and not shares and condenses(block, asked, sd):
        sums = np.empty((3, *shape))
        for run, mine in pairs:
            sums[:, mine] = _condensed(block, run, run.asked[number], factor[mine], sd[mine])
        return kalman.Filtered(sums[0], sums[1], sums[2], last)
    model = np.empty((*np.shape(factor), len(rows)))
    for run, mine in pairs:
        model[mine] = modelled(block, run, number, factor[mine])
    residual, variance, hidden = compared(block, model, sd)
    start = of_lanes(lambda cycle, begin: begin)
    if data.since == PREVIOUS:
        gone = of_lanes(lambda cycle, begin: cycle - _previous(cycle, begin))
        variance = variance + rate[..., None] * gone
        rate = np.zeros_like(rate)
    elif data.since is not None:
        start = float(data.since)
    if not (steps or shares or data.error.gain_sd):
        total = _independent(residual, variance, hidden)
        return kalman.Filtered(total, np.zeros_like(total), np.zeros_like(total), last)
    cycle = of_lanes(lambda cycle, begin: cycle)
    inspections = inspections_of(block, pairs[0][0], number)
    times = [own._replace(cycle=cycle[..., own.values[0]]) for own in inspections]
    if unknown_gain := data.error.gain_sd:
        times = times if steps else [kalman.Inspection(last, np.arange(len(rows)))][: len(rows)]
        value, relative = block.seen.value[rows], data.error.relative
        return kalman.with_gain(value, model, variance, times, unknown_gain, relative)
    return kalman.filtered(residual, variance, times, rate, start, hidden=hidden, steps=steps)


def _independent(residual: Array, variance: Array, hidden: kalman.Hidden | None) -> Array:
    """Return the sum of the logs of independent normal densities; of probabilities where values are below."""
    n = residual.shape[-1]
    if variance.shape[-1] == 1 and hidden is None:
        square = np.einsum("...i,...i->...", residual, residual)
        v = variance[..., 0]
        return np.asarray(-0.5 * (square / v + n * (np.log(v) + kalman.LOG_TWO_PI)))
    total = np.zeros(np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1]))
    for part in (slice(begin, begin + PIECE) for begin in range(0, n, PIECE)):
        r = residual[..., part]
        v = variance if variance.shape[-1] == 1 else variance[..., part]
        each = -0.5 * (r**2 / v + np.log(v) + kalman.LOG_TWO_PI)
        if hidden is not None:
            each = np.where(hidden.which[part], log_ndtr(hidden.room[..., part] / np.sqrt(v)), each)
        total = total + each.sum(axis=-1)
    return total


def condenses(block: Block, asked: Asked, sd: Array) -> bool:
    """Whether the values are very many, and their errors differ by the model alone."""
    seen, rows = block.seen, block.rows
    if len(rows) <= MANY or _size(len(rows)) * asked.curve.value.shape[-1] > len(rows):
        return False
    if block.data.since is not None or seen.censored[rows].any():
        return False
    if block.data.error.gain_sd and block.data.error.relative:  # their variance goes with the gain
        return False
    return not seen.sd[rows].any() or (not block.relative and bool((sd == sd.flat[0]).all()))


def one_by_one(block: Block, run: RunHistory, number: int) -> bool:
    """Whether values have to be compared one by one: they share an error, or their errors differ by more."""
    sd = np.array([1.0] if block.sd.prior is None else [1.0, 2.0])
    shares = block.drift is not None or block.data.error.offset_sd > 0.0
    return shares or not condenses(block, run.asked[number], sd)


def _size(count: int) -> int:
    """Return how many values a bin has: as many as there are bins, where values are very many."""
    return max(SIZE, math.isqrt(count))


class Condensed(NamedTuple):
    """Bins of values at neighbouring cycles and one place; the last of a place is filled up at weight 0.

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
    order, counts = np.lexsort((cycle, column)), np.bincount(column)
    counts = counts[counts > 0]
    size = _size(len(cycle))
    bins, ends = -(-counts // size), np.cumsum(counts)
    start = np.concatenate([f + size * np.arange(b) for f, b in zip(ends - counts, bins, strict=True)])
    end = np.repeat(ends, bins)[:, None]
    place = start[:, None] + np.arange(size)
    real = (place < end).astype(float)
    place = order[np.minimum(place, end - 1)]
    cycles, values, weights = cycle[place], value[place], real * weight[place]
    low, high = cycles[:, :1], cycles[:, -1:]
    half, middle = np.where(high > low, 0.5 * (high - low), 1.0), 0.5 * (high + low)
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    own = legendre.legvander((cycles - middle) / half, NODES - 1)
    lagrange = own @ np.linalg.inv(legendre.legvander(nodes, NODES - 1))
    centre = np.einsum("bs,bs->b", real, values)[:, None] / real.sum(axis=1, keepdims=True)
    powers = np.stack([(values - centre) ** n for n in range(3)])
    moment = np.einsum("pbs,bs,bsk->pbk", powers, weights, lagrange)
    node, count = middle + 0.5 * (high - low) * nodes, np.einsum("bs,bsk->bk", real, lagrange)
    return Condensed(column[place[:, :1]], cycles, values, weights, real, node, centre, moment, count)


def _condensed(block: Block, run: RunHistory, asked: Asked, factor: Array, sd: Array) -> Array:
    """Return the log likelihood of very many values, and mean and variance of what the gain is more than 1.

    Factors go along the first of the lanes only.
    """
    bins, constant = block.bins(asked, float(np.ravel(sd)[0]))
    sd = np.ones(1) if block.seen.sd[block.rows].any() else sd
    shape, flat = np.broadcast_shapes(np.shape(factor), np.shape(sd)), np.ravel(factor)
    spread = np.broadcast_to(sd, shape).reshape(flat.size, -1)
    pieces = np.array_split(np.arange(flat.size), max(flat.size * bins.node.size // NUMBERS, 1))
    parts = [_of_factors(bins, run, asked, flat[some], spread[some], block) for some in pieces]
    logs, chi, *more = np.concatenate(parts, axis=1).reshape(-1, *shape)
    g = variance = np.zeros(shape)
    if more:
        chi, log_scale, g, variance = kalman.gain_after(0.0, block.data.error.gain_sd**2, chi, *more)
        logs = logs + log_scale
    return np.stack([-0.5 * (chi + logs + constant), g, variance])


def _of_factors(
    bins: Condensed, run: RunHistory, asked: Asked, factor: Array, sd: Array, block: Block
) -> Array:
    """Return sums of values for a few factors, (sums, factors, deviations).

    Σ ln 2πv and Σ (y − m)²/v; with a gain Σ ln 2πv, Σ y²/v, Σ m y/v and Σ m²/v.
    """
    curve, f = asked.curve, factor[:, None, None]
    model = curve.at(run.own_cycle(bins.node, f, asked.clock), bins.column)
    zeroth, once, twice = bins.moment
    if block.data.error.gain_sd:
        square = np.broadcast_to(twice + bins.centre * (bins.centre * zeroth + 2.0 * once), model.shape)
        sums = [square, model * (once + bins.centre * zeroth), model * model * zeroth]
    else:
        off = model - bins.centre
        sums = [twice + off * (off * zeroth - 2.0 * once)]
    outer = run.own_cycle(bins.cycle[:, [0, -1]], f, asked.clock)
    ends = np.searchsorted(curve.cycle[1:], outer, side="right")
    smooth = ends[..., 0] == ends[..., 1]
    if block.relative:
        least, largest = np.abs(model).min(axis=-1), np.abs(model).max(axis=-1)
        smooth &= largest - least <= SMOOTH * least
    held = smooth[..., None]
    total = _added([np.where(held, each, 0.0) for each in sums], held * bins.many, model, sd, block.relative)
    lane, uneven = np.nonzero(~smooth)
    size = bins.value.shape[1]
    for some in np.array_split(np.arange(len(lane)), max(len(lane) * size // NUMBERS, 1)):
        i, b = lane[some], uneven[some]
        own = curve.at(run.own_cycle(bins.cycle[b], factor[i, None], asked.clock), bins.column[b])
        value, weight = bins.value[b], bins.weight[b]
        squares = (value * value, own * value, own * own) if len(sums) > 1 else ((value - own) ** 2,)
        each = [(weight * one)[:, None] for one in squares]
        more = _added(each, bins.real[b][:, None], own[:, None], sd[i], block.relative)
        np.add.at(total, np.s_[:, i], more)  # type: ignore[arg-type]
    return total


def _added(sums: Sequence[Array], count: Array, model: Array, sd: Array, relative: float) -> Array:
    """Return Σ count ln 2πv and sums over v, of bins and their places, (1 + sums, lanes, deviations)."""
    total = np.empty((1 + len(sums), *sd.shape))
    if not relative:
        total[0] = count.sum(axis=(1, 2))[:, None] * np.log(2.0 * np.pi * sd**2)
        for n, each in enumerate(sums, 1):
            total[n] = each.sum(axis=(1, 2))[:, None] / sd**2
        return total
    own = (relative * model) ** 2
    for j, column in enumerate(sd.T):
        variance = np.where(count != 0.0, column[:, None, None] ** 2 + own, 1.0)
        total[0, :, j] = (count * np.log(2.0 * np.pi * variance)).sum(axis=(1, 2))
        for n, each in enumerate(sums, 1):
            total[n, :, j] = (each / variance).sum(axis=(1, 2))
    return total

"""How probable a block of observations is, for every wear coefficient, error and drift at once."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from wearlab.arrays import Array, Flags
from wearlab.campaign.distributions import SMALLEST, Distribution
from wearlab.campaign.update_options import PREVIOUS, Data
from wearlab.units import convert
from wearlab.updating import sufficient
from wearlab.updating.history import Asked, RunHistory
from wearlab.updating.kalman import LOG_TWO_PI, Filtered, Hidden, Inspection, SharedError, filtered
from wearlab.updating.observations import Observed
from wearlab.updating.sufficient import SIZE, condensed

PER = 1e6  # cycles over which ``drift`` is said
MANY = 4000  # values from which independent ones are summed in pieces
PIECE = 2000
MATTERS = 0.1  # numerical over measuring error from which it counts


@dataclass(frozen=True)
class Spread:
    """A standard deviation of one block that is known, or has a prior [SI]."""

    name: str
    known: float
    prior: Distribution | None = None
    scale: float = 1.0

    def log_density(self, log_value: Array) -> Array:
        """Return the log of the prior's density per unit of ln value."""
        assert self.prior is not None
        return log_density(self.prior, log_value - np.log(self.scale))


def log_density(prior: Distribution, log_value: Array) -> Array:
    """Return the log of a prior's density per unit of ln value; of normal laws however far out."""
    found: Array = prior.log_density(np.exp(log_value)) + log_value
    return found


class Range(NamedTuple):
    """Where ln of an unknown is looked for at first, and what its prior allows at all."""

    low: float
    high: float
    least: float
    most: float


def range_of(prior: Distribution, scale: float = 1.0) -> Range:
    """Return the range of ln value of a prior; a normal law allows more than it starts with."""
    with np.errstate(divide="ignore"):
        low, high = np.log(scale * np.array([prior.at(SMALLEST), prior.at(1.0 - SMALLEST)]))
        ends = np.log(scale * np.array([max(prior.low, 0.0), prior.high]))
    if not np.isfinite(low):  # a normal law of what is positive
        low = np.log(scale * prior.at(0.5)) - 40.0
    if prior.word in ("lognormal", "normal"):
        return Range(float(low), float(high), float(ends[0]), float(ends[1]))
    return Range(float(low), float(high), float(low), float(high))


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

    seen: Observed
    rows: NDArray[np.intp]
    sd: Spread
    drift: Spread | None
    numerical: float = 0.0

    @property
    def data(self) -> Data:
        """What the file says of them."""
        return self.seen.data

    def measures(self, quantity: str, where: str | None) -> bool:
        """Whether it is of a quantity's totals, of the same place where one is named."""
        return self.data.quantity == quantity and where in (None, self.data.where) and self.data.since is None

    def is_whole(self, quantity: str, where: str | None) -> bool:
        """Whether it measures a quantity that is one number."""
        return self.measures(quantity, where) and self.seen.place_kind is None

    @property
    def spreads(self) -> tuple[Spread, ...]:
        """Those that have a prior."""
        return tuple(s for s in (self.sd, self.drift) if s is not None and s.prior is not None)

    @property
    def relative(self) -> float:
        """The error of a value in parts of the model: what is measured, and the run's own."""
        return math.hypot(self.data.error.relative, self.numerical)


def block_of(seen: Observed, *, accumulating: bool) -> Block:
    """Return a block with all its observations."""
    error, data = seen.data.error, seen.data
    drift = _spread("drift", error.drift, data) if accumulating and error.drift is not None else None
    sd = _spread("sd", error.sd if error.sd is not None else 0.0, data)
    return Block(seen, np.arange(len(seen)), sd, drift)


def _spread(name: str, given: float | Distribution, data: Data) -> Spread:
    label = f"{name}_{data.label}"
    if not isinstance(given, Distribution):
        return Spread(label, given)
    scale = 1.0 if given.unit is None else convert(1.0, given.unit, data.si)
    return Spread(label, given.at(0.5) * scale, given, scale)


def numerical_share(block: Block, history: RunHistory) -> float:
    """Return the largest numerical error of the run over the smallest error of a value."""
    error, seen = block.data.error, block.seen
    value = np.nanmax(np.abs(np.where(seen.censored, seen.below, seen.value)), initial=0.0)
    least = block.sd.known if block.sd.prior is None else block.sd.prior.at(0.05) * block.sd.scale
    own = float(np.min(np.hypot(seen.sd, np.hypot(least, error.relative * value)), initial=math.inf))
    return float(history.numerical_of(block.data.quantity) * value / own) if own > 0.0 else 0.0


def inspections_of(block: Block, history: RunHistory, number: int) -> list[Inspection]:
    """Return the times of a block's values that count, each with the places of its values among those."""
    cycle = history.asked[number].cycle[block.rows]
    if not len(cycle):
        return []
    times, inverse = np.unique(cycle, return_inverse=True)
    order = np.argsort(inverse, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(inverse, minlength=len(times)))[:-1])
    return [Inspection(float(t), part.astype(np.intp)) for t, part in zip(times, parts, strict=True)]


def modelled(block: Block, history: RunHistory, number: int, factor: Array) -> Array:
    """Return what the model says of each value that counts, (…, n), for factors on the coefficient (…)."""
    asked = history.asked[number]
    cycle, column = asked.cycle[block.rows], asked.column[block.rows]
    f = np.asarray(factor)[..., None]
    depth = asked.curve.at(history.own_cycle(cycle, f), column)
    since = block.data.since
    if since is None:
        return depth
    first = _previous(cycle, history.start) if since == PREVIOUS else np.full_like(cycle, float(since))
    return np.asarray(depth - asked.curve.at(history.own_cycle(first, f), column))


def _previous(cycle: Array, start: float) -> Array:
    times = np.unique(cycle)
    before = np.concatenate([[start], times[:-1]])
    return np.asarray(before[np.searchsorted(times, cycle)])


class Lanes(NamedTuple):
    """What a likelihood is asked for, any number of them at once: arrays that go together by broadcasting.

    Parameters
    ----------
    factor : on the wear coefficient [1]
    sd : standard deviation of a value [SI]
    drift : of W in `PER` cycles [SI]
    """

    factor: Array
    sd: Array
    drift: Array


def log_likelihood(
    block: Block, history: RunHistory, number: int, lanes: Lanes, *, steps: bool = False
) -> Filtered:
    """Return how probable the block is, and what is known of its drift.

    Parameters
    ----------
    block, history, number : what was measured, the run, the block's place
    lanes : coefficients and errors
    steps : whether each inspection's surprise is kept
    """
    factor, sd = lanes.factor, lanes.sd
    rate = lanes.drift**2 / PER
    if not steps and _condenses(block, history.asked[number], sd, rate):
        total = _condensed(block, history, number, factor, sd)
        total = np.broadcast_to(total, np.broadcast_shapes(total.shape, rate.shape))
        zero = np.zeros_like(total)
        return Filtered(total, zero, zero, float(history.asked[number].cycle[block.rows].max()))
    model = modelled(block, history, number, factor)
    variance = _variance(block, model, sd)
    start = history.start
    times = inspections_of(block, history, number)
    if block.data.since == PREVIOUS:
        cycle = history.asked[number].cycle[block.rows]
        variance = variance + rate[..., None] * (cycle - _previous(cycle, start))
        rate = np.zeros_like(rate)
    elif block.data.since is not None:
        start = float(block.data.since)
    residual = block.seen.value[block.rows] - model
    censored = block.seen.censored[block.rows]
    shares = bool(np.any(rate > 0.0)) or block.data.error.offset_sd > 0.0
    if not steps and not shares:
        total = _independent(residual, variance, model, censored, block.seen.below[block.rows])
        zero = np.zeros_like(total)
        return Filtered(total, zero, zero, times[-1].cycle if times else start)
    hidden = None
    if censored.any():
        residual = np.where(censored, 0.0, residual)
        hidden = Hidden(censored, np.where(censored, block.seen.below[block.rows], 0.0) - model)
    shared = SharedError(block.data.error.offset_sd**2, rate, start)
    return filtered(residual, variance, times, shared, hidden=hidden, steps=steps)


def _condenses(block: Block, asked: Asked, sd: Array, rate: Array) -> bool:
    """Whether the values are very many, with errors that are independent and differ by the model alone."""
    error, seen = block.data.error, block.seen
    if len(block.rows) <= MANY or SIZE * asked.curve.value.shape[-1] > len(block.rows):
        return False
    if block.data.since is not None or np.any(rate > 0.0):
        return False
    if error.offset_sd or seen.censored[block.rows].any():
        return False
    return not seen.sd[block.rows].any() or (sd.size == 1 and not block.relative)


def _condensed(block: Block, history: RunHistory, number: int, factor: Array, sd: Array) -> Array:
    """Return the log likelihood by what is sufficient of the values, see `sufficient`."""
    asked, rows, own = history.asked[number], block.rows, block.seen.sd[block.rows]
    values = (asked.cycle[rows], asked.column[rows], block.seen.value[rows])
    if not own.any():
        told = condensed(*values, np.ones(len(rows)))
        return sufficient.log_likelihood(told, history, asked, factor, sd, block.relative)
    variance = own**2 + float(sd.ravel()[0]) ** 2
    told = condensed(*values, 1.0 / variance)
    whole = sufficient.log_likelihood(told, history, asked, factor, np.ones(1), 0.0)
    return np.asarray(whole - 0.5 * np.sum(np.log(variance)))


def _variance(block: Block, model: Array, sd: Array) -> Array:
    """Return the variance of each value's own error; of one where all are alike, its last dimension is 1."""
    own = block.seen.sd[block.rows]
    square = np.asarray(sd**2)[..., None]
    if own.any():
        square = square + own**2
    return square + (block.relative * model) ** 2 if block.relative else square


def _independent(residual: Array, variance: Array, model: Array, censored: Flags, below: Array) -> Array:
    """Return the sum of the logs of independent normal densities; of probabilities where values are below."""
    n = residual.shape[-1]
    if variance.shape[-1] == 1 and not censored.any():
        square = np.einsum("...i,...i->...", residual, residual)
        v = variance[..., 0]
        return np.asarray(-0.5 * (square / v + n * (np.log(v) + LOG_TWO_PI)))
    total = np.zeros(np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1]))
    for begin in range(0, n, PIECE):
        part = slice(begin, begin + PIECE)
        r, hidden = residual[..., part], censored[part]
        v = variance if variance.shape[-1] == 1 else variance[..., part]
        each = -0.5 * (np.where(hidden, 0.0, r) ** 2 / v + np.log(v) + LOG_TWO_PI)
        if hidden.any():
            score = (np.where(hidden, below[part], 0.0) - model[..., part]) / np.sqrt(v)
            each = np.where(hidden, log_ndtr(score), each)
        total = total + each.sum(axis=-1)
    return total

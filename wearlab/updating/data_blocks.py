"""Blocks of observations with their errors, as the likelihood needs them."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import PREVIOUS, Data, Limit
from wearlab.units import convert
from wearlab.updating import kalman, measurements
from wearlab.updating.bins import Condensed, RememberedBins, condensed
from wearlab.updating.run_curves import ObservationPoints, RunHistory

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


def values_worth(spread: Spread) -> float:
    """Return how many values the prior of an unknown sd is worth.

    As many as make a scaled inverse chi-square law as wide.

    Parameters
    ----------
    spread : with a prior
    """
    assert spread.prior is not None
    low, high = np.log([spread.prior.at(0.159), spread.prior.at(0.841)])
    return float(2.0 / (high - low) ** 2)


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
    last_bins: dict[str, RememberedBins] = field(
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

    def bins(self, points: ObservationPoints, sd: float) -> tuple[Condensed, float]:
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
        return previous_inspection(cycle, begin)
    return np.full_like(cycle, begin if since is None else float(since))


def previous_inspection(cycle: Array, start: float) -> Array:
    """Return the cycle of the inspection before each, ``start`` before the first."""
    times = np.unique(cycle)
    previous = np.append(start, times[:-1])
    return np.asarray(previous[np.searchsorted(times, cycle)])

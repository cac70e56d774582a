"""What a population tells of one unit: its wear at the next inspection, and its life."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr

from wearlab.arrays import Array
from wearlab.updating.answer import STIFFEST, first_passage
from wearlab.updating.kalman import Filtered
from wearlab.updating.population import Population, Shared, Unit, drawn, factors, log_marginal, seen_by
from wearlab.updating.posterior import quantiles

DRAWS = 2000
STATES = np.polynomial.hermite_e.hermegauss(3)
COARSE, FINE = 49, 65  # of a table of lives
LONGEST = 1e4  # times the time inspected that a life is looked for


@dataclass(frozen=True)
class UnitState:
    """Equally probable states of a unit after some inspections.

    Parameters
    ----------
    unit : with what had been measured by then
    shared : what units share, lanes (n, 1)
    factor : (n,) on the wear coefficient, at the reference time
    block : the block whose quantity ends the life, None where it is not measured
    seen : what the filter knows of it, None without a measurement
    """

    unit: Unit
    shared: Shared
    factor: Array
    block: int | None
    seen: Filtered | None

    @property
    def now(self) -> float:
        """The last inspection [cycles]."""
        return self.unit.now

    def _equal(self, cycle: float) -> Array:
        return np.asarray(self.shared.equal(cycle - self.unit.run.start)[:, 0])

    @cached_property
    def rate(self) -> Array:
        """Variance of W per unit of equal wear time, (n,)."""
        block = None if self.block is None else self.unit.blocks[self.block]
        rate = self.shared.rate(self.unit.run, block, self.block or 0, self.factor[:, None])
        return np.asarray(np.broadcast_to(rate, (len(self.factor), 1))[:, 0])

    def wear(self, cycle: float) -> tuple[Array, Array]:
        """Return mean and variance of what ends the life at a cycle, (n,) [SI and its square]."""
        run = self.unit.run
        mean = run.limit.at(run.start + self._equal(cycle) * self.factor / run.factor)
        if self.seen is None:
            return mean, self.rate * self._equal(cycle)
        left = np.maximum(self._equal(cycle) - self._equal(self.now), 0.0)
        return mean + self.seen.mean[:, 0], self.seen.variance[:, 0] + self.rate * left

    def measured(self, cycle: float) -> tuple[Array, Array]:
        """Return mean and standard deviation of a value measured at a cycle, (n,) [SI]."""
        mean, variance = self.wear(cycle)
        if self.block is not None:
            block = self.unit.blocks[self.block]
            column = float(np.median(block.seen.sd)) if len(block.seen) else 0.0
            own = np.hypot(block.data.error.offset_sd, np.hypot(column, block.relative * mean))
            variance = variance + self.shared.sd[self.block][:, 0] ** 2 + own**2
        return mean, np.sqrt(variance)

    def value_below(self, cycle: float, value: Array | float) -> Array:
        """Return the probability that less is measured at a cycle, (q,)."""
        mean, sd = self.measured(cycle)
        return np.asarray(ndtr((np.atleast_1d(value)[:, None] - mean) / np.maximum(sd, 1e-300)).mean(axis=1))

    def value(self, cycle: float, p: Array) -> Array:
        """Return quantiles of a value measured at a cycle [SI]."""
        mean, sd = self.measured(cycle)
        low, high = float(np.min(mean - 9.0 * sd)), float(np.max(mean + 9.0 * sd))
        return quantiles(lambda x: self.value_below(cycle, x), p, low, high)

    @cached_property
    def _ahead(self) -> tuple[Array, Array, Array, Array]:
        """Weight, gap, mean equal time and shape of the way to the limit, (n·states,)."""
        run, nodes, heights = self.unit.run, *STATES
        w = np.zeros(len(self.factor)) if self.seen is None else self.seen.mean[:, 0]
        spread = 0.0 * w if self.seen is None else np.sqrt(self.seen.variance[:, 0])
        w = (w + nodes[:, None] * spread).ravel()
        weight = np.repeat(heights / heights.sum() / len(self.factor), len(self.factor))
        factor, rate = np.tile(self.factor / run.factor, len(nodes)), np.tile(self.rate, len(nodes))
        since = 0.0 * self.factor if self.seen is None else self._equal(self.now)
        own = run.start + np.tile(since, len(nodes)) * factor
        gap = run.level - w - run.limit.at(own)
        mean = np.maximum((run.limit.first_above(run.level - w) - own) / factor, 1e-300)
        shape = np.minimum(gap**2 / np.maximum(rate, 1e-300), STIFFEST * mean)
        return weight, gap, mean, shape

    @property
    def passed(self) -> float:
        """The probability that the limit has been passed at the last inspection."""
        weight, gap, *_ = self._ahead
        return float(weight[gap <= 0.0].sum())

    def life_below(self, cycle: Array) -> Array:
        """Return the probability that the limit is reached before cycles, (q,)."""
        weight, gap, mean, shape = self._ahead
        open_, found = gap > 0.0, []
        since = 0.0 * self.factor if self.seen is None else self._equal(self.now)
        for each in np.atleast_1d(cycle):
            ahead = np.tile(np.maximum(self._equal(float(each)) - since, 1e-300), len(STATES[0]))[open_]
            reached = first_passage(ahead, mean[open_], shape[open_])
            found.append(self.passed + float(weight[open_] @ reached))
        return np.array(found)

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]; the last inspection where it is over."""
        first = max(self.now - self.unit.run.start, self.shared.reference)
        logs, p = np.log(first) + np.linspace(np.log(1e-6), np.log(LONGEST), COARSE), np.asarray(p, float)
        for _ in range(3):  # a table, and finer ones where the life ends
            below, at = self.life_below(self._from + np.exp(logs)), logs
            first_, last = (int(np.argmax(below >= end)) for end in (self.passed + 1e-6, below[-1] - 1e-6))
            logs = np.linspace(logs[max(first_ - 1, 0)], logs[last], FINE)
        below, keep = np.unique(below, return_index=True)
        if len(below) == 1:
            return np.where(p <= self.passed, max(self.now, self.unit.run.start), np.inf)
        found = PchipInterpolator(below, at[keep])(np.clip(p, below[0], below[-1]))
        life = np.where(p > below[-1], np.inf, self._from + np.exp(found))
        return np.where(p <= self.passed, max(self.now, self.unit.run.start), life)

    @property
    def _from(self) -> float:
        return self.unit.run.start if self.seen is None else self.now


def state_of(found: Population, unit: Unit, weight: Array, rng: np.random.Generator) -> UnitState:
    """Return equally probable states of a unit.

    Parameters
    ----------
    found : what is known of all units together
    unit : with the measurements that count
    weight : of the lattice's points, these measurements included
    rng : of the draws
    """
    theta = found.theta[drawn(found, DRAWS, rng, weight)]
    log_factor = factors(unit, found.law, theta, rng)
    shared = found.law.shared(theta)
    limit = unit.run.limit
    block = next((n for n, asked in enumerate(unit.run.asked) if asked.curve is limit), None)
    seen = None
    if block is not None and len(unit.blocks[block].rows):
        seen = seen_by(unit, shared, log_factor[:, None])[block]
        mean, variance = (np.broadcast_to(part, (DRAWS, 1)) for part in (seen.mean, seen.variance))
        seen = replace(seen, mean=mean, variance=variance)
    return UnitState(unit, shared, np.exp(log_factor), block, seen)


def after(found: Population, number: int, cycle: float, rng: np.random.Generator) -> UnitState:
    """Return the states of a unit after its inspections up to a cycle, all of the other units being known."""
    unit = found.units[number].up_to(cycle)
    instead = log_marginal(unit, found.law, found.theta)
    return state_of(found, unit, found.weight(number, instead), rng)

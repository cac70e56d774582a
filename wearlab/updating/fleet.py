"""What a population tells of one unit: its wear at the next inspection, and its life."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, ndtr

from wearlab.arrays import Array
from wearlab.updating.answer import Passage
from wearlab.updating.history import RunCurve
from wearlab.updating.kalman import Filtered
from wearlab.updating.population import FleetMember, Population, Shared, drawn, factors, log_marginal, seen_by
from wearlab.updating.posterior import quantiles

DRAWS = 2000
STATES = np.polynomial.hermite_e.hermegauss(3)


@dataclass(frozen=True)
class UnitState:
    """Equally probable states of a unit after some inspections.

    Parameters
    ----------
    unit : with what had been measured by then
    shared : what units share, lanes (n, 1)
    factor : (n,) on the wear coefficient, at the reference time
    block : the block that tells how far the wear has strayed, None where there is none
    seen : what the filter knows of it, None without a measurement
    """

    unit: FleetMember
    shared: Shared
    factor: Array
    block: int | None
    seen: Filtered | None

    @property
    def now(self) -> float:
        """The last inspection [cycles]."""
        return self.unit.now

    @property
    def curve(self) -> RunCurve:
        """What the block measures, over the cycles of the run; what ends the life without one."""
        return self.unit.run.limit if self.block is None else self.unit.run.asked[self.block].curve

    def _equal(self, cycle: float) -> Array:
        return np.asarray(self.shared.equal(self.unit.run.equal(np.array(cycle)))[:, 0])

    @cached_property
    def _since(self) -> Array:
        """Equal wear time of the last inspection of the block, (n,)."""
        return np.zeros(len(self.factor)) if self.seen is None else np.asarray(self.seen.cycle)[:, 0]

    def _until_reference(self, curve: RunCurve) -> Array:
        run = self.unit.run
        return np.asarray(curve.at(run.start + self.shared.reference * self.factor / run.factor))

    def _rate(self, curve: RunCurve) -> Array:
        """Return the variance of W of a quantity per unit of equal wear time, (n,)."""
        return (self.shared.straying[:, 0] * self._until_reference(curve)) ** 2 / self.shared.reference

    def _strayed(self, curve: RunCurve) -> tuple[Array, Array]:
        """Return mean and variance of W of a quantity at the last inspection, (n,)."""
        if self.seen is None:
            return np.zeros(len(self.factor)), np.zeros(len(self.factor))
        ratio = (
            1.0 if curve is self.curve else self._until_reference(curve) / self._until_reference(self.curve)
        )
        return ratio * self.seen.mean[:, 0], ratio**2 * self.seen.variance[:, 0]

    def wear(self, cycle: float, curve: RunCurve | None = None) -> tuple[Array, Array]:
        """Return mean and variance of a quantity at a cycle, (n,); of what ends the life by default."""
        run, own = self.unit.run, self.unit.run.limit if curve is None else curve
        w, variance = self._strayed(own)
        left = np.maximum(self._equal(cycle) - self._since, 0.0)
        mean = own.at(run.start + self._equal(cycle) * self.factor / run.factor)
        return mean + w, variance + self._rate(own) * left

    def measured(self, cycle: float, count: int = 1) -> tuple[Array, Array]:
        """Return mean and standard deviation of the mean of some values of the block, (n,) [SI]."""
        mean, variance = self.wear(cycle, self.curve)
        if self.block is not None:
            block = self.unit.blocks[self.block]
            column = float(np.median(block.seen.sd)) if len(block.seen) else 0.0
            own = self.shared.sd[self.block][:, 0] ** 2 + column**2 + (block.relative * mean) ** 2
            variance = variance + own / count + block.data.error.offset_sd**2
        return mean, np.sqrt(variance)

    def value_below(self, cycle: float, value: Array | float, count: int = 1) -> Array:
        """Return the probability that less is measured at a cycle, (q,); of the mean of so many values."""
        mean, sd = self.measured(cycle, count)
        return np.asarray(ndtr((np.atleast_1d(value)[:, None] - mean) / np.maximum(sd, 1e-300)).mean(axis=1))

    def value(self, cycle: float, p: Array) -> Array:
        """Return quantiles of a value measured at a cycle [SI]."""
        mean, sd = self.measured(cycle)
        low, high = float(np.min(mean - 9.0 * sd)), float(np.max(mean + 9.0 * sd))
        return quantiles(lambda x: self.value_below(cycle, x), p, low, high)

    def crps(self, cycle: float, value: float, rng: np.random.Generator) -> float:
        """Return the continuous ranked probability score of a value: E|x − y| − ½ E|x − x′|."""
        mean, sd = self.measured(cycle)
        x = np.sort(mean + sd * rng.standard_normal(len(mean)))
        n = len(x)
        apart = 2.0 * float((2.0 * np.arange(n) - n + 1.0) @ x) / n**2
        return float(np.mean(np.abs(x - value)) - 0.5 * apart)

    @cached_property
    def _passage(self) -> Passage:
        run, (nodes, heights) = self.unit.run, STATES
        w, variance = self._strayed(run.limit)
        w = (w + nodes[:, None] * np.sqrt(variance)).ravel()
        weight = np.repeat(heights, len(self.factor))
        factor, rate, since = (
            np.tile(each, len(nodes))
            for each in (self.factor / run.factor, self._rate(run.limit), self._since)
        )
        own = run.start + since * factor
        mean = np.maximum((run.limit.first_above(run.level - w) - own) / factor, 1e-300)
        lanes = (weight, run.level - w - run.limit.at(own), mean, rate)
        return Passage(self.now, lanes, lambda cycle: np.tile(self._equal(cycle), len(nodes)) - since)

    @property
    def passed(self) -> float:
        """The probability that the limit has been passed at the last inspection."""
        return self._passage.over

    def life_below(self, cycle: Array) -> Array:
        """Return the probability that the limit is reached before cycles, (q,)."""
        return np.array([self._passage.below(float(each)) for each in np.atleast_1d(cycle)])

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]; the last inspection where it is over."""
        return self._passage.quantile(np.asarray(p, float))


def state_of(found: Population, unit: FleetMember, theta: Array, rng: np.random.Generator) -> UnitState:
    """Return equally probable states of a unit.

    Parameters
    ----------
    found : what is known of all units together
    unit : with the measurements that count
    theta : (n, parameters) draws of what units share, these measurements included
    rng : of the draws
    """
    log_factor = factors(unit, found.law, theta, rng)
    shared, asked = found.law.shared(theta), unit.run.asked
    whole = [n for n, block in enumerate(unit.blocks) if block.seen.place_kind is None]
    limits = [n for n in whole if asked[n].curve is unit.run.limit]
    block = next(iter([*limits, *whole]), None)
    seen = None
    if block is not None and len(unit.blocks[block].rows):
        seen = seen_by(unit, shared, log_factor[:, None])[block]
        mean, variance = (
            np.broadcast_to(part, log_factor[:, None].shape) for part in (seen.mean, seen.variance)
        )
        seen = replace(seen, mean=mean, variance=variance)
    return UnitState(unit, shared, np.exp(log_factor), block, seen)


def now(found: Population, number: int, rng: np.random.Generator) -> UnitState:
    """Return the states of a unit after all measurements."""
    return state_of(found, found.units[number], found.theta[drawn(found, DRAWS, rng)], rng)


def after(
    found: Population, number: int, cycle: float, rng: np.random.Generator, draws: int = DRAWS
) -> UnitState:
    """Return the states of a unit after its inspections up to a cycle, all of the other units being known."""
    unit = found.units[number].up_to(cycle)
    theta = found.theta[drawn(found, draws, rng, found.weight(number))]
    if len(unit.cycles):
        logs = log_marginal(unit, found.law, theta)
        theta = theta[rng.choice(draws, draws, p=np.exp(logs - logsumexp(logs)))]
    return state_of(found, unit, theta, rng)

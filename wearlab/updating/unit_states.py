"""Equally probable states of a fleet's unit: wear, values and lives from them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from wearlab.arrays import Array, Index, Random
from wearlab.updating import fleet_law, lives, run_curves, unit_factors
from wearlab.updating.fleet_law import Law
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.grids import draws_along_grid, equal_draws
from wearlab.updating.population import Population

DRAWS = 2000  # states of a unit after all measurements
INSPECTED_STATES = 400  # that inspections are checked with
W_NODES = 3  # points over W of each state, by Gauss and Hermite


@dataclass(frozen=True)
class UnitState:
    """Equally probable states of a unit after some inspections.

    Parameters
    ----------
    unit : with what had been measured by then
    shared : what units share, lanes (n, 1)
    factor : (n,) on the wear coefficient, at the reference time
    block : whose values are foreseen, at first what was measured last; None of a unit
        without any block
    drift_mean, drift_variance : (n,) mean and variance of W after the last inspection
    since : (n,) equal wear time of that
    """

    unit: FleetMember
    shared: fleet_law.Shared
    factor: Array
    block: int | None
    drift_mean: Array
    drift_variance: Array
    since: Array

    def _equal(self, cycle: float) -> Array:
        """Return the equal wear time of a cycle, (n,)."""
        equal = self.shared.equal(self.unit.run.equal(np.array(cycle)))[:, 0]
        return np.broadcast_to(equal, self.factor.shape)

    def wear(self, cycle: float, block: int | None = None) -> tuple[Array, Array]:
        """Return mean and variance of what a block measures at a cycle, (n,) [SI].

        Parameters
        ----------
        cycle : when
        block : number of the block [what ends the life]
        """
        run = self.unit.run
        if block is None:
            nowhere = np.zeros(0, np.intp)
            points = run_curves.ObservationPoints(run.limit, nowhere, np.zeros(0))
        else:
            points = run.points[block]

        factor = self.factor[:, None]
        mean = self.shared.mean(run, points, factor, np.array([cycle]))[:, 0, 0]
        scale = self.shared.worn(run, points.curve, self.factor)
        elapsed = np.maximum(self._equal(cycle) - self.since, 0.0)
        variance = self.drift_variance + self.shared.rate[:, 0] * elapsed
        return mean + scale * self.drift_mean, scale**2 * variance

    def measured(self, cycle: float, count: int = 1) -> tuple[Array, Array]:
        """Return mean and standard deviation of the mean of some values, (n,) [SI].

        Parameters
        ----------
        cycle : when
        count : number of values
        """
        mean, variance = self.wear(cycle, self.block)
        if self.block is None:
            return mean, np.sqrt(variance)

        block = self.unit.blocks[self.block]
        observed = block.observed
        column_sd = float(np.median(observed.sd)) if len(observed) else 0.0
        sd = self.shared.sd[self.block][:, 0]
        value_variance = sd**2 + column_sd**2 + (block.relative * mean) ** 2
        offset_variance = block.data.error.offset_sd**2
        variance = variance + value_variance / count + offset_variance
        return mean, np.sqrt(variance)

    def value(self, cycle: float, p: Array) -> Array:
        """Return quantiles of a value measured at a cycle [SI].

        Parameters
        ----------
        cycle : when
        p : probabilities of smaller values, (q,)
        """
        mean, sd = self.measured(cycle)
        low = float(np.min(mean - 9.0 * sd))
        high = float(np.max(mean + 9.0 * sd))

        def below(x: Array) -> Array:
            return _mean_probability(x, mean, sd)

        return run_curves.invert_rising(below, p, low, high, 1e-6)

    def two_sided_p(self, cycle: float, value: float, count: int) -> float:
        """Return the probability that a mean of values is as far off.

        Parameters
        ----------
        cycle : when
        value : the mean [SI]
        count : number of values
        """
        mean, sd = self.measured(cycle, count)
        below = float(_mean_probability(np.array([value]), mean, sd)[0])
        return 2.0 * min(below, 1.0 - below)

    def crps(self, cycle: float, value: float, rng: Random) -> float:
        """Return the continuous ranked probability score: E|x − y| − ½ E|x − x′| [SI].

        Parameters
        ----------
        cycle : when
        value : y, what was measured [SI]
        rng : of draws x
        """
        mean, sd = self.measured(cycle)
        n = len(self.factor)
        x = np.sort(mean + sd * rng.standard_normal(n))
        mean_difference = 2.0 * float((2.0 * np.arange(n) - n + 1.0) @ x) / n**2
        return float(np.mean(np.abs(x - value)) - 0.5 * mean_difference)

    @cached_property
    def lives(self) -> lives.Passage:
        """The lives, of all states together."""
        run = self.unit.run
        nodes, heights = np.polynomial.hermite_e.hermegauss(W_NODES)
        count = len(nodes)
        scale = self.shared.worn(run, run.limit, self.factor)  # the unit of W
        deviation = nodes[:, None] * np.sqrt(self.drift_variance)
        w = (scale * (self.drift_mean + deviation)).ravel()
        factor = np.tile(self.factor / run.factor, count)
        rate = np.tile(scale**2 * self.shared.rate[:, 0], count)
        since = np.tile(self.since, count)

        run_cycle = run.start + since * factor
        end = run.limit.first_above(run.level - w)
        states = lives.PassageStates(
            weight=np.repeat(heights, len(self.factor)),
            gap=run.level - w - run.limit.at(run_cycle),
            mean=np.maximum((end - run_cycle) / factor, 1e-300),
            rate=rate,
        )

        def ahead(cycle: float) -> Array:
            return np.tile(self._equal(cycle), count) - since

        return lives.Passage(self.unit.now, states, ahead)


def _mean_probability(value: Array, mean: Array, sd: Array) -> Array:
    """Return the probability of smaller values, in the mean of normal laws."""
    scores = (value[:, None] - mean) / np.maximum(sd, 1e-300)
    return np.asarray(ndtr(scores).mean(axis=1))


States = list[UnitState]


def states_of(
    law: Law, unit: FleetMember, theta: Array, log_factor: Array, cycles: Array
) -> States:
    """Return equally probable states of a unit after what had been measured by cycles.

    Parameters
    ----------
    law : what is unknown of all units together
    unit : with its measurements
    theta : draws of what units share, (cycles, n, parameters)
    log_factor : draws of ln f, (cycles, n)
    cycles : (cycles,) up to which measurements count
    """
    n = log_factor.shape[1]
    filtered_steps = []
    if unit.inspections:
        lanes = law.shared(theta.reshape(-1, theta.shape[-1]))
        flat_factor = log_factor.reshape(-1, 1)
        filtered_steps = unit_factors.unit_likelihood(
            unit, lanes, flat_factor, steps=True
        ).steps

    states = []
    counts = unit.inspected(cycles)
    for k, (cycle, count) in enumerate(zip(cycles, counts, strict=True)):
        shared = law.shared(theta[k])
        mean = np.zeros(n)
        variance = np.zeros(n)
        since = np.zeros(n)
        inspections = unit.inspections[:count]
        if inspections:
            lanes_of_cycle = slice(k * n, (k + 1) * n)
            step = filtered_steps[count - 1]
            mean = step.mean[lanes_of_cycle, 0]
            variance = step.variance[lanes_of_cycle, 0]
            last = np.array(inspections[-1][1].cycle)
            equal = shared.equal(unit.run.equal(last))[:, 0]
            since = np.broadcast_to(equal, (n,))
        state = UnitState(
            unit=unit.up_to(cycle),
            shared=shared,
            factor=np.exp(log_factor[k]),
            block=_last_block(unit, count),
            drift_mean=mean,
            drift_variance=variance,
            since=since,
        )
        states.append(state)
    return states


def _last_block(unit: FleetMember, count: int) -> int | None:
    """Return the block without places that was measured last, else the first."""
    whole = unit.whole
    numbers = (number for number, _ in reversed(unit.inspections[:count]))
    measured = (number for number in numbers if number in whole)
    return next(measured, next(iter(whole), None))


class JointDraws(NamedTuple):
    """Equally probable draws of all that is not known of a fleet.

    Parameters
    ----------
    theta : ln of what units share, (n, parameters)
    log_factor : ln f of each unit with it, (units, n)
    reading : which reading of each unit's sheets holds, (units, n)
    """

    theta: Array
    log_factor: Array
    reading: Index


def joint_draws(fleet: Population, n: int, rng: Random) -> JointDraws:
    """Return draws of what units share, and of ln f of each unit with it.

    Parameters
    ----------
    fleet : what is known of all units
    n : number of draws
    rng : of the draws
    """
    theta, near = fleet.parameters(n, rng)
    of_units = [
        unit_factors.factors(unit, fleet.law, near, rng) for unit in fleet.units
    ]
    log_factor = np.stack([one.log_factor for one in of_units])
    return JointDraws(theta, log_factor, np.stack([one.reading for one in of_units]))


def states_now(fleet: Population, draws: JointDraws) -> States:
    """Return the states of all units after all measurements, by `DRAWS` draws at most.

    Parameters
    ----------
    fleet : what is known of all units
    draws : of all that is not known of it
    """
    count = min(len(draws.theta), DRAWS)
    chosen = np.linspace(0, len(draws.theta) - 1, count).astype(int)
    theta = draws.theta[chosen]
    return [
        _state_now(fleet.law, unit, theta, log_factor[chosen], reading[chosen])
        for unit, log_factor, reading in zip(fleet.units, *draws[1:], strict=True)
    ]


def _state_now(
    law: Law, unit: FleetMember, theta: Array, log_factor: Array, reading: Index
) -> UnitState:
    """Return the state of a unit, each draw after the sheets that are sound in it."""
    now = np.array([np.inf])
    (state,) = states_of(law, unit, theta[None], log_factor[None], now)
    drift_mean = state.drift_mean.copy()
    drift_variance = state.drift_variance.copy()
    since = np.array(state.since)
    for number in range(1, len(unit.readings)):
        drawn = np.flatnonzero(reading == number)
        if len(drawn):
            sound = unit.readings[number].unit
            of_drawn = (theta[None, drawn], log_factor[None, drawn])
            (of_sound,) = states_of(law, sound, *of_drawn, now)
            drift_mean[drawn] = of_sound.drift_mean
            drift_variance[drawn] = of_sound.drift_variance
            since[drawn] = of_sound.since
    return replace(
        state, drift_mean=drift_mean, drift_variance=drift_variance, since=since
    )


def state_of_reading(
    fleet: Population, number: int, reading: int, rng: Random
) -> UnitState:
    """Return the state of a unit after all measurements, if a reading of it holds.

    Parameters
    ----------
    fleet : what is known of all units
    number : of the unit
    reading : number of the reading of its sheets
    rng : of the draws
    """
    unit = fleet.units[number]
    sound = unit.readings[reading]
    weight = fleet.weight_of_reading(number, reading)
    theta = fleet.theta[equal_draws(weight / weight.sum(), DRAWS, rng)]
    points, rows = np.unique(theta, axis=0, return_inverse=True)
    known = unit_factors.masses(sound.unit, fleet.law, points, aside=sound.aside)
    log_factor = draws_along_grid(known.log_factor, known.mass, rows.ravel(), rng)
    now = np.array([np.inf])
    (state,) = states_of(fleet.law, sound.unit, theta[None], log_factor[None], now)
    return replace(state, unit=unit)


def states_after(
    fleet: Population,
    number: int,
    until: Array,
    rng: Random,
    foreseen: int | None = None,
) -> States:
    """Return `INSPECTED_STATES` states of a unit after its inspections up to cycles.

    All of the other units is known.

    Parameters
    ----------
    fleet : what is known of all units
    number : of the unit
    until : cycles, rising
    rng : of the draws
    foreseen : block that is foreseen; the states are then those before its inspections
        at these cycles
    """
    unit = replace(fleet.units[number], foreseen=foreseen).up_to(until[-1])
    size = INSPECTED_STATES
    theta = fleet.theta[equal_draws(fleet.weight(number), size, rng)]
    if not len(unit.cycles):
        log_factor = unit_factors.factors(unit, fleet.law, theta, rng).log_factor
        return states_of(fleet.law, unit, theta[None], log_factor[None], until)

    points, rows = np.unique(theta, axis=0, return_inverse=True)
    rows = rows.ravel()
    known = unit_factors.masses(unit, fleet.law, points, until)
    marginal = known.log_marginal
    weight = np.exp(marginal - marginal.max(axis=1, keepdims=True))[:, rows]
    picks = [rng.choice(size, size, p=row / row.sum()) for row in weight]
    log_factors = [
        draws_along_grid(known.log_factor, mass, rows[pick], rng)
        for mass, pick in zip(known.mass, picks, strict=True)
    ]
    drawn = theta[np.array(picks)]
    return states_of(fleet.law, unit, drawn, np.array(log_factors), until)


def inspections_of_block(
    unit: FleetMember, number: int
) -> Sequence[tuple[float, float, int]]:
    """Return cycle, mean value and number of values of each inspection of a block.

    Parameters
    ----------
    unit : with its measurements
    number : of the block
    """
    block = unit.blocks[number]
    cycle = unit.run.points[number].cycle[block.rows]
    value = block.observed.value[block.rows]
    times, counts = np.unique(cycle, return_counts=True)
    return [
        (float(time), float(value[cycle == time].mean()), int(count))
        for time, count in zip(times, counts, strict=True)
    ]

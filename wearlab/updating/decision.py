"""What to do next: when to look again, when to change, at which cost.

A virtual measurement is made of some draws in turn, all draws are weighted by how well
they explain it, and the interval of the remaining life that follows is averaged: the
width to be expected, before looking.

A cycle goes from new to a change, planned (cost P) at t or forced (cost F) when the
limit is reached at T,

    rate(t) = (P Pr(T > t) + F Pr(T ≤ t)) / (age + E min(T, t)).

A look at τ costs I and tells a measurement; t is then chosen after it. Of policies
whose length is chance the best has the least E(cost) − g E(length) at that g where it
is 0 (Dinkelbach). Over a stated horizon H the expected cost until then is least; V(h)
is that of a new one with h hours to go,

    V(h) = min_a ∫_0^a (F + V(h − x)) dG(x) + (1 − G(a)) (P + V(h − a)),   a = h without
    a change.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq
from scipy.special import ndtri

from wearlab.arrays import Array, Random
from wearlab.campaign.update_options import Decision
from wearlab.units import HOUR
from wearlab.updating import answers, grids, layout, likelihood, lives, sampling
from wearlab.updating.run_curves import RunHistory
from wearlab.updating.sampling import Draws

LOOKS = 9
INSTRUMENTS = (0.3, 1.0, 3.0)  # times the error of the block
TRUTHS = 100  # draws that virtual measurements are made of
MAX_DRAWS = 4000  # that are weighted by them
ENDS = (0.05, 0.95)
CHANGE_TIMES = 400  # at which a change is considered
LAST = 0.999  # quantile of the life up to which it is
DEARER = (0.5, 1.0, 2.0)  # times the cost of a failure, for the sensitivity
STEPS = 300  # of a horizon


class LookState(NamedTuple):
    """What would be known at a later inspection, of each draw.

    Parameters
    ----------
    value : (n,) the quantity that would be measured [SI]
    life : (n,) as it then is [cycles]
    sd : (n,) error of a value [SI]
    """

    value: Array
    life: Array
    sd: Array


def virtual_inspection(
    outcome: answers.UpdateOutcome, rng: Random
) -> xr.Dataset | None:
    """Return the expected width of the remaining life after one more inspection.

    It is that of the 90 % interval, over the time of the inspection. The inspection is
    one of the first block that has no places on the flank. None where there is no such
    block, or where no life is left to look at.

    Parameters
    ----------
    outcome : of the update
    rng : of virtual measurements
    """
    answer = outcome.answer
    number = virtual_block(outcome)
    early, end = answer.life(np.array([0.05, 0.5]))
    if number is None or not np.isfinite(end) or not answer.now < end:
        return None
    draws = outcome.draws[:MAX_DRAWS]
    rest = np.maximum(draws.life - answer.now, 0.0)
    equal = np.ones(len(draws))
    present = float(np.ptp(grids.weighted_quantiles(rest, equal, ENDS)))
    if not present > 0.0:
        return None

    looks = np.linspace(answer.now, end, LOOKS + 1)[1:]
    expected = np.empty((len(INSTRUMENTS), len(looks)))
    states = states_at_looks(answer.drifting, draws, number, looks, rng)
    for k, state in enumerate(states):
        rest = state.life - looks[k]
        for i, scale in enumerate(INSTRUMENTS):
            width = expected_width(state.value, rest, scale * state.sd, rng)
            expected[i, k] = width / present

    is_safe = looks <= max(early, looks[0])
    best = looks[is_safe][np.argmin(expected[1][is_safe])]
    values = {"expected_width": expected, "present_width": present, "recommended": best}
    return layout.dataset("ahead", values, instrument=list(INSTRUMENTS), look=looks)


def before_change(ahead: xr.Dataset, change: float) -> xr.Dataset:
    """Return advice on one more inspection where a change is planned.

    It is before the change, or none (NaN).

    Parameters
    ----------
    ahead : as `virtual_inspection` returns it
    change : when [cycles]
    """
    if not change <= float(ahead["recommended"]):
        return ahead
    looks = ahead["look"].values
    widths = ahead["expected_width"].sel(instrument=1.0).values
    sooner = looks < change
    best = looks[sooner][np.argmin(widths[sooner])] if sooner.any() else np.nan
    return ahead.assign(recommended=ahead["recommended"].copy(data=best))


def virtual_block(outcome: answers.UpdateOutcome) -> int | None:
    """Return the first block that has no places on the flank: what is measured again.

    None where sources contradict each other: the next value would not tell which of
    them is right.

    Parameters
    ----------
    outcome : of the update
    """
    if outcome.answer.contradiction > answers.TENSION:
        return None
    for n, block in enumerate(outcome.posterior.blocks):
        if block.observed.place_kind is None and not block.counts_since:
            return n
    return None


def states_at_looks(
    drifting: int | None, draws: Draws, number: int, looks: Array, rng: Random
) -> Iterator[LookState]:
    """Yield what would be known at later inspections, of some draws.

    Parameters
    ----------
    drifting : the block whose drift goes on to the limit, None without one
    draws : from the posterior
    number : of the block that is measured again
    looks : when, rising [cycles]
    rng : of drift and gains
    """
    block = draws.posterior.blocks[number]
    observed = block.observed
    error = block.data.error
    # of its column, as until now
    column_sd = float(np.median(observed.sd)) if len(observed) else 0.0
    gain = sampling.gains(draws, number, rng)
    drift = draws.drift[number]
    rate = drift**2 / likelihood.PER
    w = np.zeros(len(draws))
    last = draws.filtered(number) if drift.any() else None
    runs = draws.by_run()
    for look in map(float, looks):
        if last is not None:
            w = last.drawn(look, rate, rng)
        mean = np.empty(len(draws))
        scatter = np.empty(len(draws))
        life = draws.life.copy()
        for run, chosen in runs:
            factor = draws.factor[chosen]
            points = run.points[number]
            run_cycle = run.equivalent_cycle(np.array(look), factor, points.clock)
            mean[chosen] = points.curve.at(run_cycle)
            scatter[chosen] = run.scatter
            if drifting == number:
                life[chosen] = lives.draw_lives(
                    run, factor, w[chosen], look, rate[chosen], rng
                )
        variance = draws.sd[number] ** 2 + column_sd**2
        relative = np.hypot(block.relative, scatter)
        variance = variance + (relative * gain * mean) ** 2
        sd = np.sqrt(variance + error.offset_sd**2)
        yield LookState(mean * gain + w, life, sd)


def expected_width(value: Array, rest: Array, sd: Array, rng: Random) -> float:
    """Return the mean width of the 90 % interval after a measurement.

    The interval is that of the remaining life.

    Parameters
    ----------
    value, rest : of each draw, the quantity measured and the remaining life then
    sd : of the measurement
    rng : of its errors
    """
    order = np.argsort(rest)
    ordered_rest = np.maximum(rest[order], 0.0)
    weight = virtual_weights(value[order], sd[order], rng)
    total = np.cumsum(weight, axis=1)
    # a value stands in the middle of its weight
    below = (total - 0.5 * weight) / total[:, -1:]
    widths = [np.ptp(np.interp(ENDS, row, ordered_rest)) for row in below]
    return float(np.mean(widths))


def virtual_weights(value: Array, sd: Array, rng: Random) -> NDArray[np.float32]:
    """Return how well all draws explain virtual measurements of some of them.

    In single precision, (measurements, draws): a weight need not be known to more than
    its sum is by chance.

    Parameters
    ----------
    value, sd : of each draw, the quantity and the error of a value, in order
    rng : of the measurements
    """
    places = (np.arange(TRUTHS) + rng.random()) / TRUTHS * len(value)
    truths = places.astype(int)
    error = rng.permutation(ndtri((np.arange(TRUTHS) + 0.5) / TRUTHS))
    measured = value[truths] + sd[truths] * error
    middle = value.mean()
    share = (1.0 / sd).astype(np.float32)
    standardised = ((value - middle) / sd).astype(np.float32)
    offset = (measured - middle).astype(np.float32)
    off = np.multiply.outer(offset, share) - standardised
    # a truth explains its own value: no row is nothing
    return np.exp(np.float32(-0.5) * off * off) * (share * np.float32(sd.min()))


def decision_of(
    outcome: answers.UpdateOutcome, costs: Decision, rng: Random
) -> xr.Dataset | None:
    """Return the cost per hour of changes and looks, None where no end is expected.

    Parameters
    ----------
    outcome : of the update
    costs : of changes, failures and looks
    rng : of virtual measurements
    """
    answer = outcome.answer
    run = outcome.posterior.histories[0]
    result = change_costs(answer, run, costs)
    number = virtual_block(outcome)
    if result is None or costs.inspection is None or number is None:
        return result

    hour = run.seconds_per_cycle / HOUR
    draws = outcome.draws
    age = hour * (answer.now - run.new_cycle)
    middle = float(answer.life(np.array([0.5]))[0])
    looks = np.linspace(answer.now, middle, LOOKS + 1)[1:]
    states = states_at_looks(answer.drifting, draws, number, looks, rng)
    rates = []
    for look, state in zip(looks.tolist(), states, strict=True):
        life = np.where(draws.life <= look, draws.life, state.life)
        rest = hour * (life - answer.now)
        until = hour * (look - answer.now)
        rates.append(rate_with_inspection(rest, state, until, age, costs, rng))
    pays = min(rates) < float(result["best_rate"])
    best = looks[int(np.argmin(rates))] if pays else np.nan
    values = {"rate_with_look": rates, "best_look": best}
    return result.merge(layout.dataset("decision", values, look=looks))


def change_costs(
    answer: lives.Lives, run: RunHistory, costs: Decision, places: int = CHANGE_TIMES
) -> xr.Dataset | None:
    """Return the cost per hour of planned changes, the best, and its sensitivity.

    None without an end.

    Parameters
    ----------
    answer : with the lives
    run : that says how long a cycle takes
    costs : of changes and failures
    places : number of times at which a change is considered
    """
    hour = run.seconds_per_cycle / HOUR
    now = answer.now
    end, middle = answer.life(np.array([LAST, 0.5]))
    end = end if np.isfinite(end) else 4.0 * middle
    if not (np.isfinite(end) and end > now and np.isfinite(hour)):
        return None

    cycles: Array = np.linspace(now, end, places + 1)
    below = answer.life_below(cycles)
    age = hour * (now - run.new_cycle)
    ahead = hour * (cycles - now)
    lengths = age + cumulative_trapezoid(1.0 - below, ahead, initial=0.0)
    hours = np.maximum(lengths, 1e-9)
    planned_cost = costs.planned * (1.0 - below)
    rates = np.stack(
        [(planned_cost + scale * costs.failure * below) / hours for scale in DEARER]
    )
    best = rates.argmin(axis=1)
    values = {
        "cost_rate": rates[1],
        "best_change": cycles[best[1]],
        "best_rate": rates[1, best[1]],
        "rate_to_failure": rates[1, -1],
        "best_change_if": cycles[best],
    }
    if costs.horizon_hours is not None:
        values |= _horizon_values(answer, run, costs, costs.horizon_hours / hour)
    return layout.dataset("decision", values, change=cycles, failure_times=list(DEARER))


def _horizon_values(
    answer: lives.Lives, run: RunHistory, costs: Decision, cycles: float
) -> dict[str, Any]:
    """Return the best change until a horizon so many cycles off, and what it costs."""
    steps: Array = cycles * np.linspace(0.0, 1.0, STEPS + 1)
    ahead = answer.now + steps
    of_new = answer.life_below(run.new_cycle + steps)
    of_new = of_new - of_new[0]
    below = answer.life_below(ahead)
    step, cost = over_horizon(below, of_new, costs)
    _, cost_to_failure = over_horizon(below, of_new, costs, planned=False)
    return {
        "horizon_cost": cost,
        "horizon_change": ahead[step] if step < STEPS else np.nan,
        "horizon_to_failure": cost_to_failure,
    }


def over_horizon(
    below: Array, new: Array, costs: Decision, *, planned: bool = True
) -> tuple[int, float]:
    """Return the step of the planned change that costs least, and its expected cost.

    The cost is that until the horizon.

    Parameters
    ----------
    below, new : probability of an end before each step, of the one now and of a new one
    costs : of changes and failures
    planned : whether a change of the one now may be planned
    """
    value = np.zeros(len(new))  # cost to go of a new one with so many steps left
    for left in range(1, len(new)):
        value[left] = value[left - 1]  # for failures within the first step
        value[left] = min(_costs_of_ages(new[: left + 1], value, costs)[1:])
    costs_by_age = _costs_of_ages(below, value, costs)
    best = int(np.argmin(costs_by_age)) if planned else len(costs_by_age) - 1
    return best, float(costs_by_age[best])


def _costs_of_ages(below: Array, value: Array, costs: Decision) -> Array:
    """Return the cost to go of a change planned after 0, 1, … steps.

    That of none stands in the last place.
    """
    left = len(below) - 1
    failing = np.diff(below)  # in each step; half of them lie before its middle
    to_go = value[left::-1]
    failed = failing * (costs.failure + 0.5 * (to_go[:-1] + to_go[1:]))
    forced = below[0] * (costs.failure + to_go[0]) + np.append(0.0, np.cumsum(failed))
    totals: Array = forced + (1.0 - below) * (costs.planned + to_go)
    totals[-1] = forced[-1]
    return totals


def rate_with_inspection(
    rest: Array, state: LookState, look: float, age: float, costs: Decision, rng: Random
) -> float:
    """Return the least cost per hour with a look, after which the change is chosen.

    Parameters
    ----------
    rest : of each draw, the life from now [h]
    state : what would be known at the look
    look, age : time of it from now, and age now [h]
    costs : of changes, failures and looks
    rng : of the errors
    """
    early = rest <= look
    inspection = costs.inspection or 0.0
    failed = float(early.mean())
    lost = float(np.minimum(rest, look).mean())
    if early.all():
        return costs.failure / (age + lost)

    # of those that live on, in order of their lives
    later = rest - look
    order = np.argsort(later[~early])
    left = later[~early][order]
    value = state.value[~early][order]
    sd = state.sd[~early][order]
    time = np.linspace(0.0, float(np.quantile(left, LAST)), CHANGE_TIMES + 1)
    at = np.searchsorted(left, time, side="right")
    mass = np.cumsum(virtual_weights(value, sd, rng), axis=1, dtype=float)
    failed_share = np.insert(mass, 0, 0.0, axis=1)[:, at] / mass[:, -1:]
    living = 1.0 - failed_share
    cost = costs.planned * living + costs.failure * failed_share
    length = cumulative_trapezoid(living, time, initial=0.0)

    def excess(rate: float) -> float:
        """Return the expected cost beyond a rate of the best policy."""
        later_cost = float(np.min(cost - rate * length, axis=1).mean())
        after_look = (1.0 - failed) * (inspection + later_cost)
        return costs.failure * failed + after_look - rate * (age + lost)

    dearest = costs.failure + inspection + costs.planned
    highest_rate = dearest / max(age + lost, 1e-9)
    return float(brentq(excess, 0.0, highest_rate, xtol=1e-12 * highest_rate))

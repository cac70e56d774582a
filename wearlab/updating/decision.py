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
TRUTHS, MOST = (
    100,
    4000,
)  # draws that virtual measurements are made of; that are weighted
ENDS = (0.05, 0.95)
PLACES = 400  # times at which a change is considered
LAST = 0.999  # quantile of the life up to which it is
DEARER = (0.5, 1.0, 2.0)  # times the cost of a failure, for the sensitivity
STEPS = 300  # of a horizon
Seen = tuple[
    Array, Array, Array
]  # what would be measured, the life as it then is, and a value's error


def virtual_inspection(
    outcome: answers.UpdateOutcome, rng: Random
) -> xr.Dataset | None:
    """Return the expected width of the remaining life's 90 % interval over the time of one more inspection.

    The inspection is one of the first block that has no places on the flank. None where
    there is no such block, or where no life is left to look at.
    """
    answer = outcome.answer
    number = virtual_block(outcome)
    early, end = answer.life(np.array([0.05, 0.5]))
    if number is None or not np.isfinite(end) or not answer.now < end:
        return None
    draws = outcome.draws[:MOST]
    looks = np.linspace(answer.now, end, LOOKS + 1)[1:]
    rest = np.maximum(draws.life - answer.now, 0.0)
    present = float(np.ptp(grids.weighted_quantiles(rest, np.ones(len(draws)), ENDS)))
    if not present > 0.0:
        return None
    expected = np.empty((len(INSTRUMENTS), len(looks)))
    for k, (value, life, sd) in enumerate(
        states_at_looks(answer.drifting, draws, number, looks, rng)
    ):
        expected[:, k] = [
            expected_width(value, life - looks[k], n * sd, rng) / present
            for n in INSTRUMENTS
        ]
    safe = looks <= max(early, looks[0])
    best = looks[safe][np.argmin(expected[1][safe])]
    values = {"expected_width": expected, "present_width": present, "recommended": best}
    return layout.dataset("ahead", values, instrument=list(INSTRUMENTS), look=looks)


def before_change(ahead: xr.Dataset, change: float) -> xr.Dataset:
    """Return one more inspection as it is advised where a change is planned: before it, or none (NaN)."""
    if not change <= float(ahead["recommended"]):
        return ahead
    looks = ahead["look"].values
    widths = ahead["expected_width"].sel(instrument=1.0).values
    sooner = looks < change
    best = looks[sooner][np.argmin(widths[sooner])] if sooner.any() else np.nan
    return ahead.assign(recommended=ahead["recommended"].copy(data=best))


def virtual_block(outcome: answers.UpdateOutcome) -> int | None:
    """Return the first block that has no places on the flank: what one would measure again.

    None where sources contradict each other: the next value would not tell which of
    them is right.
    """
    if outcome.answer.contradiction > answers.TENSION:
        return None
    blocks = outcome.posterior.blocks
    return next(
        (
            n
            for n, b in enumerate(blocks)
            if b.observed.place_kind is None and not b.data.since
        ),
        None,
    )


def states_at_looks(
    drifting: int | None, draws: Draws, number: int, looks: Array, rng: Random
) -> Iterator[Seen]:
    """Yield for some draws the quantity at later cycles, the life as it then is, and a value's error."""
    n = len(draws)
    block = draws.posterior.blocks[number]
    drift = draws.drift[number]
    column_error = (
        float(np.median(block.observed.sd)) if len(block.observed) else 0.0
    )  # of its column, as until now
    gain = sampling.gains(draws, number, rng)
    runs = draws.by_run()
    rate = drift**2 / likelihood.PER
    w = np.zeros(n)
    last = draws.filtered(number) if drift.any() else None
    for look in map(float, looks):
        mean = np.empty(n)
        life = draws.life.copy()
        if last is not None:
            w = last.drawn(look, rate, rng)
        for run, mine in runs:
            factor = draws.factor[mine]
            points = run.points[number]
            mean[mine] = points.curve.at(
                run.equivalent_cycle(np.array(look), factor, points.clock)
            )
            if drifting == number:
                life[mine] = lives.draw_lives(
                    run, factor, w[mine], look, rate[mine], rng
                )
        square = (
            draws.sd[number] ** 2
            + column_error**2
            + (block.relative * gain * mean) ** 2
        )
        yield mean * gain + w, life, np.sqrt(square + block.data.error.offset_sd**2)


def expected_width(value: Array, rest: Array, sd: Array, rng: Random) -> float:
    """Return the mean width of the 90 % interval of the remaining life after a measurement of the value.

    Parameters
    ----------
    value, rest : of each draw, the quantity measured and the remaining life then
    sd : of the measurement
    rng : of its errors
    """
    order = np.argsort(rest)
    value = value[order]
    rest = np.maximum(rest[order], 0.0)
    sd = sd[order]
    weight = virtual_weights(value, sd, rng)
    total = np.cumsum(weight, axis=1)
    below = (total - 0.5 * weight) / total[
        :, -1:
    ]  # a value stands in the middle of its weight
    return float(np.mean([np.ptp(np.interp(ENDS, row, rest)) for row in below]))


def virtual_weights(value: Array, sd: Array, rng: Random) -> NDArray[np.float32]:
    """Return how well all draws explain virtual measurements of some of them, which are in order.

    In single precision, (measurements, draws): a weight need not be known to more than
    its sum is by chance.
    """
    truths = ((np.arange(TRUTHS) + rng.random()) / TRUTHS * len(value)).astype(int)
    error = rng.permutation(ndtri((np.arange(TRUTHS) + 0.5) / TRUTHS))
    measured = value[truths] + sd[truths] * error
    middle = value.mean()
    share = (1.0 / sd).astype(np.float32)
    standardised = ((value - middle) / sd).astype(np.float32)
    off = (
        np.multiply.outer((measured - middle).astype(np.float32), share) - standardised
    )
    # a truth explains its own value: no row is nothing
    return np.exp(np.float32(-0.5) * off * off) * (share * np.float32(sd.min()))


def decision_of(
    outcome: answers.UpdateOutcome, costs: Decision, rng: Random
) -> xr.Dataset | None:
    """Return the cost per hour of changes and looks, None where no end is to be expected."""
    answer = outcome.answer
    run = outcome.posterior.histories[0]
    result = change_costs(answer, run, costs)
    number = virtual_block(outcome)
    if result is None or costs.inspection is None or number is None:
        return result
    hour = run.seconds_per_cycle / HOUR
    draws = outcome.draws
    age = hour * (answer.now - run.start)
    looks = np.linspace(answer.now, float(answer.life(np.array([0.5]))[0]), LOOKS + 1)[
        1:
    ]
    states = states_at_looks(answer.drifting, draws, number, looks, rng)
    rates = []
    for look, state in zip(looks.tolist(), states, strict=True):
        rest = hour * (np.where(draws.life <= look, draws.life, state[1]) - answer.now)
        rates.append(
            rate_with_inspection(
                rest, state, hour * (look - answer.now), age, costs, rng
            )
        )
    best = (
        looks[int(np.argmin(rates))]
        if min(rates) < float(result["best_rate"])
        else np.nan
    )
    return result.merge(
        layout.dataset(
            "decision", {"rate_with_look": rates, "best_look": best}, look=looks
        )
    )


def change_costs(
    answer: lives.Lives, run: RunHistory, costs: Decision, places: int = PLACES
) -> xr.Dataset | None:
    """Return the cost per hour of planned changes, the best, and its sensitivity.

    None without an end.
    """
    hour = run.seconds_per_cycle / HOUR
    last_cycle = answer.now
    end, middle = answer.life(np.array([LAST, 0.5]))
    end = end if np.isfinite(end) else 4.0 * middle
    if not (np.isfinite(end) and end > last_cycle and np.isfinite(hour)):
        return None
    cycles: Array = np.linspace(last_cycle, end, places + 1)
    below = answer.life_below(cycles)
    age = hour * (last_cycle - run.start)
    hours = np.maximum(
        age
        + cumulative_trapezoid(1.0 - below, hour * (cycles - last_cycle), initial=0.0),
        1e-9,
    )
    rates = np.stack(
        [
            (costs.planned * (1.0 - below) + d * costs.failure * below) / hours
            for d in DEARER
        ]
    )
    best = rates.argmin(axis=1)
    values = {
        "cost_rate": rates[1],
        "best_change": cycles[best[1]],
        "best_rate": rates[1, best[1]],
    }
    values |= {"rate_to_failure": rates[1, -1], "best_change_if": cycles[best]}
    if costs.horizon_hours is not None:
        steps: Array = costs.horizon_hours / hour * np.linspace(0.0, 1.0, STEPS + 1)
        ahead = last_cycle + steps
        new = answer.life_below(run.start + steps)
        below = answer.life_below(ahead)
        at, values["horizon_cost"] = over_horizon(below, new - new[0], costs)
        values["horizon_change"] = ahead[at] if at < STEPS else np.nan
        values["horizon_to_failure"] = over_horizon(
            below, new - new[0], costs, planned=False
        )[1]
    return layout.dataset("decision", values, change=cycles, failure_times=list(DEARER))


def over_horizon(
    below: Array, new: Array, costs: Decision, *, planned: bool = True
) -> tuple[int, float]:
    """Return the step of the planned change with the least expected cost until the horizon, and that cost.

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
    """Return the cost to go of a change planned after 0, 1, … steps, of none in the last place."""
    left = len(below) - 1
    failing = np.diff(below)  # in each step; half of them lie before its middle
    to_go = value[left::-1]
    failed = failing * (costs.failure + 0.5 * (to_go[:-1] + to_go[1:]))
    forced = below[0] * (costs.failure + to_go[0]) + np.append(0.0, np.cumsum(failed))
    totals: Array = forced + (1.0 - below) * (costs.planned + to_go)
    totals[-1] = forced[-1]
    return totals


def rate_with_inspection(
    rest: Array, measured: Seen, look: float, age: float, costs: Decision, rng: Random
) -> float:
    """Return the least cost per hour with a look, after which the change is chosen.

    Parameters
    ----------
    rest : of each draw, the life from now [h]
    measured : what would be measured at the look, the life as it then is, and the error
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
    order = np.argsort((rest - look)[~early])
    left, value, sd = (
        values[~early][order] for values in (rest - look, measured[0], measured[2])
    )
    time = np.linspace(0.0, float(np.quantile(left, LAST)), PLACES + 1)
    at = np.searchsorted(left, time, side="right")
    mass = np.cumsum(virtual_weights(value, sd, rng), axis=1, dtype=float)
    failed_share = np.insert(mass, 0, 0.0, axis=1)[:, at] / mass[:, -1:]
    cost = costs.planned * (1.0 - failed_share) + costs.failure * failed_share
    length = cumulative_trapezoid(1.0 - failed_share, time, initial=0.0)

    def excess(rate: float) -> float:
        later_cost = float(np.min(cost - rate * length, axis=1).mean())
        return (
            costs.failure * failed
            + (1.0 - failed) * (inspection + later_cost)
            - rate * (age + lost)
        )

    highest_rate = (costs.failure + inspection + costs.planned) / max(age + lost, 1e-9)
    return float(brentq(excess, 0.0, highest_rate, xtol=1e-12 * highest_rate))

"""When to change, and whether to look first: the least expected cost per hour of a renewal cycle.

A cycle goes from new to a change, planned (cost P) at t or forced (cost F) when the limit is reached at T,

    rate(t) = (P Pr(T > t) + F Pr(T ≤ t)) / (age + E min(T, t)).

A look at τ costs I and tells a measurement; t is then chosen after it. Of policies whose length is chance the
best has the least E(cost) − g E(length) at that g where it is 0 (Dinkelbach).
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from wearlab.arrays import Array
from wearlab.campaign.update_options import Decision
from wearlab.units import HOUR
from wearlab.updating.next_inspection import LOOKS, states_at, virtual_block, virtual_weights

if TYPE_CHECKING:
    from wearlab.updating.outcome import UpdateOutcome

PLACES = 400  # times at which a change is considered
LAST = 0.999  # quantile of the life up to which it is
DEARER = (0.5, 1.0, 2.0)  # times the cost of a failure, for the sensitivity
ABOUT = {
    "change": "cycle of the planned change",
    "cost_rate": "expected cost per operating hour over the cycle from new to change",
    "best_change": "cycle of the planned change with the least cost per hour",
    "best_rate": "least expected cost per operating hour",
    "rate_to_failure": "expected cost per operating hour without a planned change",
    "failure_times": "times the cost of a failure",
    "best_change_if": "cycle of the planned change, were a failure so much dearer",
    "look": "cycle of the next inspection",
    "rate_with_look": "expected cost per operating hour with one inspection, and a change chosen after it",
    "best_look": "cycle of the inspection with the least cost per hour, NaN where none is worth its cost",
}


class DutyAhead(NamedTuple):
    """What may come: times ahead (t,), probability of the end before each, age now; all in hours."""

    time: Array
    below: Array
    age: float

    @property
    def length(self) -> Array:
        """The expected time until the end or the change, E min(T, t), (t,) [h]."""
        return _area(1.0 - self.below, self.time)

    def rate(self, costs: Decision, dearer: float = 1.0) -> Array:
        """Return the cost per hour of a change at each time, (t,)."""
        cost = costs.planned * (1.0 - self.below) + dearer * costs.failure * self.below
        return np.asarray(cost / np.maximum(self.age + self.length, 1e-300))


def _area(values: Array, time: Array) -> Array:
    """Return the integral from the first time to each, along the last axis."""
    steps = 0.5 * (values[..., 1:] + values[..., :-1]) * np.diff(time)
    return np.concatenate([np.zeros((*values.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)


def decided(outcome: "UpdateOutcome", costs: Decision, rng: np.random.Generator) -> xr.Dataset | None:
    """Return the cost per hour of changes and looks, None where no end is to be expected."""
    answer, run = outcome.answer, outcome.posterior.histories[0]
    hour = run.seconds_per_cycle / HOUR
    end = float(answer.life(np.array([LAST]))[0])
    end = end if np.isfinite(end) else 4.0 * float(answer.life(np.array([0.5]))[0])
    if not (np.isfinite(end) and end > answer.now and np.isfinite(hour)):
        return None
    cycles = np.linspace(answer.now, end, PLACES + 1)
    age = hour * (answer.now - run.start)
    ahead = DutyAhead(hour * (cycles - answer.now), answer.life_below(cycles), age)
    found = of_changes(ahead, costs, cycles)
    if costs.inspection is None or (number := virtual_block(outcome)) is None:
        return found
    draws = outcome.draws
    looks = np.linspace(answer.now, float(answer.life(np.array([0.5]))[0]), LOOKS + 1)[1:]
    rates = []
    for look in looks:
        value, life, sd = states_at(outcome, draws, number, float(look), rng)
        early = draws.life <= look
        rest = hour * np.where(early, draws.life - answer.now, life - answer.now)
        rates.append(with_a_look(rest, value, sd, hour * (float(look) - answer.now), (age, costs), rng))
    best = int(np.argmin(rates))
    worth = rates[best] < float(found["best_rate"])
    more = {
        "rate_with_look": ("look", np.array(rates)),
        "best_look": ((), looks[best] if worth else np.nan),
    }
    for name, each in more.items():
        found[name] = xr.Variable(*each, {"units": "1", "long_name": ABOUT[name]})
    return found.assign_coords(look=("look", looks, {"units": "1", "long_name": ABOUT["look"]}))


def of_changes(ahead: DutyAhead, costs: Decision, cycles: Array) -> xr.Dataset:
    """Return the cost per hour of a planned change at cycles, the best, and its sensitivity."""
    rates = np.stack([ahead.rate(costs, dearer) for dearer in DEARER])
    best = rates.argmin(axis=1)
    values = {
        "cost_rate": ("change", rates[1]),
        "best_change": ((), cycles[best[1]]),
        "best_rate": ((), rates[1, best[1]]),
        "rate_to_failure": ((), rates[1, -1]),
        "best_change_if": ("failure_times", cycles[best]),
    }
    coords = {"change": cycles, "failure_times": np.array(DEARER)}
    return xr.Dataset(
        {n: (*each, {"units": "1", "long_name": ABOUT[n]}) for n, each in values.items()},
        {n: (n, each, {"units": "1", "long_name": ABOUT[n]}) for n, each in coords.items()},
    )


def with_a_look(
    rest: Array,
    value: Array,
    sd: Array,
    look: float,
    asked: tuple[float, Decision],
    rng: np.random.Generator,
) -> float:
    """Return the least cost per hour with a look, after which the change is chosen.

    Parameters
    ----------
    rest : of each draw, the life from now [h]
    value, sd : what would be measured at the look, and the error
    look : time of it from now [h]
    asked : age now [h], costs
    rng : of the errors
    """
    age, costs = asked
    early = rest <= look
    failed, lost = float(early.mean()), float(np.minimum(rest, look).mean())
    assert costs.inspection is not None
    if early.all():
        return costs.failure / (age + lost)
    value, left, sd = value[~early], rest[~early] - look, sd[~early]
    order = np.argsort(left)
    value, left, sd = value[order], left[order], sd[order]
    time = np.linspace(0.0, float(np.quantile(left, LAST)), PLACES + 1)
    at = np.searchsorted(left, time, side="right")
    below = []
    for weight in virtual_weights(value, sd, rng):
        mass = np.concatenate([[0.0], np.cumsum(weight)])
        below.append(mass[at] / mass[-1])
    gone = np.array(below)
    cost = costs.planned * (1.0 - gone) + costs.failure * gone
    length = _area(1.0 - gone, time)

    def excess(rate: float) -> float:
        after = float(np.min(cost - rate * length, axis=1).mean())
        return costs.failure * failed + (1.0 - failed) * (costs.inspection + after) - rate * (age + lost)  # type: ignore[operator]

    most = (costs.failure + costs.inspection + costs.planned) / max(age + lost, 1e-9)
    return float(brentq(excess, 0.0, most, xtol=1e-12 * most))

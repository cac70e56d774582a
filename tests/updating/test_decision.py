"""The cost per hour of changes and looks, against nested simulation
that shares no code with it.
"""

from dataclasses import replace

import numpy as np
import pytest
from made import LIMIT, RATE, ErrorModel, history, observed, study
from scipy import stats

from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.update import read_update
from wearlab.campaign.update_options import Decision
from wearlab.updating.answers import outcome_of
from wearlab.updating.decision import (
    STEPS,
    _costs_of_ages,
    before_change,
    decision_of,
    over_horizon,
)
from wearlab.updating.layout import dataset

# hours of a cycle
CYCLES = np.array([2e5, 4e5])
SD = 2e-3
HOUR = 1e-3
COSTS = Decision(planned=1000.0, failure=8000.0, inspection=60.0)


def posterior(value):
    """Return a grid of factors and their probabilities after two weighings."""
    u = np.linspace(-3.0, 3.0, 20_001)
    logs = stats.norm(0.0, np.sqrt(np.log(2.0))).logpdf(u)
    logs += (
        stats.norm(value[:, None], SD)
        .logpdf(RATE * np.exp(u) * CYCLES[:, None])
        .sum(axis=0)
    )
    mass = np.exp(logs - logs.max())
    return np.exp(u), mass / mass.sum()


def advice():
    """Return the advice of the room, and the factors and their
    probabilities that it is compared with.
    """
    value = 1.3 * RATE * CYCLES
    seen = (observed(CYCLES, value, ErrorModel(SD)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen, draws=8000)
    asked = replace(asked, spec=asked.spec.model_copy(update={"decision": COSTS}))
    one = outcome_of(asked, (history(seen),))
    return decision_of(one, COSTS, np.random.default_rng(0)), *posterior(value)


@pytest.fixture(scope="module")
def made():
    return advice()


def of_changes(found, factor, mass):
    """Return the cost per hour of five changes, and the least, over that of simulated
    lives, less 1.
    """
    rng = np.random.default_rng(1)
    off = []
    life = HOUR * LIMIT.value / RATE / rng.choice(factor, 400_000, p=mass)
    for change in (0, 100, 200, 300, 399):
        t = HOUR * float(found["change"][change])
        cost = np.where(life <= t, COSTS.failure, COSTS.planned).mean()
        exact = cost / np.minimum(life, t).mean()
        off.append(float(found["cost_rate"][change]) / exact - 1.0)
    places = HOUR * found["change"].values
    rates = [
        np.where(life <= t, 8000.0, 1000.0).mean() / np.minimum(life, t).mean()
        for t in places[::5]
    ]
    return [*off, float(found["best_rate"]) / min(rates) - 1.0]


def test_a_change_costs_what_simulated_lives_cost(made):
    assert np.abs(of_changes(*made)).max() < 0.01


def of_looks(found, factor, mass):
    """Return the cost per hour with a look at three times over that of nested
    simulation, less 1.

    Truth, what is then measured, the posterior after it on a grid, the change chosen,
    what it costs.
    """
    life = HOUR * LIMIT.value / RATE / factor
    rng = np.random.default_rng(2)
    off = []
    for k in (2, 4, 6):
        look = HOUR * float(found["look"][k])
        truth = rng.choice(len(factor), 1500, p=mass)
        alive = life[truth] > look
        seen = RATE * factor[truth] * look / HOUR + SD * rng.standard_normal(len(truth))
        times = np.linspace(
            look, np.interp(0.999, np.cumsum(mass[::-1]), life[::-1]), 500
        )
        tables = []
        for value in seen[alive]:
            logs = np.log(mass + 1e-300) + stats.norm(value, SD).logpdf(
                RATE * factor * look / HOUR
            )
            own = np.where(life > look, np.exp(logs - logs.max()), 0.0)[::-1]
            below = np.interp(times, life[::-1], np.cumsum(own) / own.sum())
            area = np.concatenate(
                [
                    [0.0],
                    np.cumsum(0.5 * (2.0 - below[1:] - below[:-1]) * np.diff(times)),
                ]
            )
            tables.append(
                (COSTS.planned * (1.0 - below) + COSTS.failure * below, look + area)
            )
        low, high = 0.0, 50.0
        for _ in range(40):
            rate = 0.5 * (low + high)
            chosen = times[[np.argmin(cost - rate * length) for cost, length in tables]]
            own = life[truth][alive]
            cost = (
                np.where(own <= chosen, COSTS.failure, COSTS.planned) + COSTS.inspection
            )
            total = cost.sum() + COSTS.failure * (~alive).sum()
            hours = np.minimum(own, chosen).sum() + life[truth][~alive].sum()
            low, high = (rate, high) if total > rate * hours else (low, rate)
        off.append(float(found["rate_with_look"][k]) / rate - 1.0)
    return off


def test_a_look_is_worth_what_nested_simulation_finds(made):
    assert np.abs(of_looks(*made)).max() < 0.03


def test_dearer_failures_are_forestalled_and_looks_that_cost_too_much_are_not_made(
    made,
):
    found, *_ = made
    half, _, twice = found["best_change_if"].values
    assert twice < float(found["best_change"]) < half
    assert np.isfinite(found["best_look"]) and float(
        found["rate_with_look"].min()
    ) < float(found["best_rate"])


@pytest.mark.parametrize(
    ("costs", "said"),
    [
        ({"planned": 5}, "update.decision.failure: required"),
        (
            {"planned": 5, "failure": 4},
            "update.decision.failure: 4 is not more than the planned change",
        ),
        ({"planned": 0, "failure": 4}, "update.decision.planned"),
        ({"planned": 5, "failure": 9, "inspektion": 1}, "did you mean 'inspection'"),
    ],
)
def test_wrong_costs_get_one_line(costs, said):
    unknown = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
    with pytest.raises(CampaignError) as caught:
        read_update({"unknown": unknown, "decision": costs})
    assert [said in line for line in caught.value.problems] == [True]


def test_over_a_horizon_a_change_costs_what_simulated_changes_cost(made):
    """Every new one lives as long as is known of the first, drawn anew.

    Best ages by the recursion itself.
    """
    costs = COSTS.model_copy(update={"inspection": None, "horizon_hours": 2500.0})
    _, factor, mass = made
    life = HOUR * LIMIT.value / RATE / factor[::-1]
    law = np.cumsum(mass[::-1])
    times = np.linspace(0.0, 2500.0, STEPS + 1)
    new = np.interp(times, life, law)
    now = HOUR * CYCLES[-1]
    below = np.interp(now + times, life, law)
    at, cost = over_horizon(below, new, costs)
    rng = np.random.default_rng(5)
    step = times[1]

    def simulated(change, n=20_000):
        """Return the mean cost of changing at a step, and new ones at
        the ages that are best then.
        """
        ages = [0]
        value = np.zeros(len(new))
        for left in range(1, len(new)):
            value[left] = value[left - 1]
            own = _costs_of_ages(new[: left + 1], value, costs)[1:]
            ages.append(1 + int(np.argmin(own)))
            value[left] = own.min()
        total = np.zeros(n)
        left = np.full(n, 2500.0)
        end = np.interp(rng.random(n), law, life) - now
        age = np.full(n, change * step)
        for _ in range(200):
            ended = np.minimum(end, age)
            over = ended >= left - 1e-9
            total += np.where(
                over, 0.0, np.where(end <= age, costs.failure, costs.planned)
            )
            left = np.where(over, 0.0, left - ended)
            if not left.any():
                break
            end = np.where(left > 0.0, np.interp(rng.random(n), law, life), np.inf)
            age = step * np.array(ages)[np.round(left / step).astype(int)]
        return total.mean()

    assert cost == pytest.approx(simulated(at), rel=0.03)
    for other in (at // 2, min(2 * at, STEPS - 1)):
        assert simulated(other) > 0.98 * cost


def test_no_inspection_is_advised_after_the_change():
    looks = np.array([1.0, 2.0, 3.0])
    widths = [[0.9, 0.8, 0.7]]
    ahead = dataset(
        "ahead",
        {"expected_width": widths, "present_width": 1.0, "recommended": 3.0},
        instrument=[1.0],
        look=looks,
    )
    advised = {
        change: float(before_change(ahead, change)["recommended"])
        for change in (3.5, 3.0, 2.5)
    }
    assert np.isnan(float(before_change(ahead, 1.0)["recommended"]))
    assert advised == {3.5: 3.0, 3.0: 2.0, 2.5: 2.0}

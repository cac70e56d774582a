"""A wear coefficient that changes once, against a grid of its own
over all three unknowns.
"""

import numpy as np
import pytest
from made import LIMIT, RATE, ErrorModel, blocks, history, observed, study
from scipy import stats

from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.update import read_update
from wearlab.updating.answers import answer_of, facts_of
from wearlab.updating.change_points import runs_with_change
from wearlab.updating.grids import Posterior
from wearlab.updating.measurements import UpdateError

CYCLES = np.array([1e5, 2e5, 3e5, 4e5, 5e5, 6e5])
SD = 2.5e-4
PRIOR = {"lognormal": {"median": 1.0, "cov": 1.0}}


def worn(factor, ratio, at, cycle):
    """Return the mass lost: ``ratio`` times the factor until ``at``."""
    return RATE * factor * (ratio * np.minimum(cycle, at) + np.maximum(cycle - at, 0.0))


def updated(values, kind="once"):
    seen = (observed(CYCLES, values, ErrorModel(SD)),)
    asked = study(PRIOR, seen)
    some = blocks(seen)
    runs = runs_with_change(
        history(seen), kind, lambda runs: Posterior(runs, some, asked.prior)
    )
    return answer_of(asked, runs, some)


def by_grid(values, at, log_ratio, weight):
    """Return ln evidence of a change over none, and quantiles of the remaining life,
    from one grid.
    """
    u = np.linspace(-1.5, 2.0, 1001)
    prior = stats.norm(0.0, np.sqrt(np.log(2.0))).logpdf(u)
    none = prior + stats.norm(values, SD).logpdf(
        worn(np.exp(u)[:, None], 1.0, 0.0, CYCLES)
    ).sum(axis=1)
    logs = np.empty((len(at), len(log_ratio), len(u)))
    for i, t in enumerate(at):
        for j, r in enumerate(np.exp(log_ratio)):
            model = worn(np.exp(u)[:, None], r, t, CYCLES)
            logs[i, j] = (
                prior
                - 0.5 * (((values - model) / SD) ** 2).sum(axis=1)
                + np.log(weight[j] / len(at))
            )
    logs -= len(CYCLES) * np.log(SD * np.sqrt(2.0 * np.pi))
    top = max(none.max(), logs.max())
    mass = np.exp(logs - top)
    alone = np.exp(none - top)
    ratio = np.exp(log_ratio)[None, :, None]
    equal = LIMIT.value / RATE / np.exp(u)
    life = np.broadcast_to(equal - (ratio - 1.0) * at[:, None, None], mass.shape)
    values = np.append(life.ravel(), equal)
    weights = np.append(mass.ravel(), alone)
    order = np.argsort(values)
    below = np.cumsum(weights[order]) / weights.sum()
    return np.log(mass.sum() / alone.sum()), np.interp(
        [0.05, 0.5, 0.95], below, values[order]
    ) - CYCLES[-1]


def in_gaps(n):
    edges = np.append(0.0, CYCLES)
    return (
        edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(n) + 0.5) / n
    ).ravel()


@pytest.mark.parametrize(
    ("ratio", "least", "most"), [(0.5, 8.0, 1e9), (1.0, -1e9, 0.0)]
)
def test_a_change_between_inspections_is_as_probable_as_a_grid_says(ratio, least, most):
    rng = np.random.default_rng(4)
    values = worn(1.2, ratio, 3.4e5, CYCLES) + SD * rng.standard_normal(6)
    answer = updated(values)
    facts = facts_of(answer.posterior)
    logs = np.linspace(-4.0, 4.0, 161)
    gain, rest = by_grid(
        values, in_gaps(3), logs, stats.norm.pdf(logs) * (logs[1] - logs[0])
    )
    assert least < facts["log_evidence_of_change"] < most
    assert facts["log_evidence_of_change"] == pytest.approx(gain, abs=0.15)
    mine = answer.remaining(np.array([0.05, 0.5, 0.95]))
    assert mine == pytest.approx(rest, abs=0.06 * (rest[2] - rest[0]))
    if ratio < 1.0:
        assert facts["change_cycle_5"] < 3.4e5 < facts["change_cycle_95"]
        assert facts["change_ratio_5"] < 2.0 < facts["change_ratio_95"]


def test_running_in_is_found_and_does_not_shorten_the_life():
    rng = np.random.default_rng(5)
    values = worn(1.0, 4.0, 0.6e5, CYCLES) + SD * rng.standard_normal(6)
    answer = updated(values, "running-in")
    assert facts_of(answer.posterior)["log_evidence_of_change"] > 5.0
    truth = LIMIT.value / RATE - 3.0 * 0.6e5 - CYCLES[-1]
    low, high = answer.remaining(np.array([0.025, 0.975]))
    assert low < truth < high
    seen = (observed(CYCLES, values, ErrorModel(SD)),)
    blind = answer_of(study(PRIOR, seen), [history(seen)], blocks(seen)).remaining(
        np.array([0.5])
    )[0]
    assert blind < 0.9 * truth


def test_a_constant_coefficient_is_rarely_called_changed():
    rng = np.random.default_rng(6)
    called = 0
    for _ in range(6):
        values = worn(1.0, 1.0, 0.0, CYCLES) + SD * rng.standard_normal(6)
        called += facts_of(updated(values).posterior)["log_evidence_of_change"] > 3.0
    assert called == 0


def test_what_cannot_change_is_refused():
    unknown = {"wear.coefficient.factor": PRIOR}
    for given, said in (
        (
            {"unknown": {**unknown, "operation.torque": PRIOR}, "change": "once"},
            "update.change: goes with",
        ),
        ({"unknown": unknown, "change": "twice"}, "update.change"),
        (
            {"unknown": unknown, "change": "once", "unit": [{"name": "A"}]},
            "power below 1 is running-in",
        ),
    ):
        with pytest.raises(CampaignError) as caught:
            read_update(given)
        assert any(said in line for line in caught.value.problems), (
            caught.value.problems
        )
    one = (observed(CYCLES[:1], RATE * CYCLES[:1], ErrorModel(SD)),)
    with pytest.raises(UpdateError, match="at least two inspections"):
        runs_with_change(history(one), "once", lambda runs: None)

"""How good the answers are: beside simple rules, and models beside each other.

Answers are those after every inspection.

Models compared: cases with the same measurements, errors that accumulate or not, k that
changed or not. An inspection left out is foretold exactly, without a sampling error: ln
p(y_i | the others) = ln Z − ln Z₋ᵢ.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.store.watching import each_told
from wearlab.updating import answers, cases, data_blocks, grids, layout, sampling
from wearlab.updating.lives import Answer

MAX_REPLAYED = 200  # inspections; of more, evenly many are replayed
MAX_LEFT_OUT = 3000  # runs times inspections up to which inspections are left out
DRAWS = 1000  # by which the next inspection is checked
EVEN = (np.arange(100) + 0.5) / 100
RULES = ("by_the_ratio", "by_the_last_three", "by_the_prior")


def crps(quantile: Array, truth: float) -> float:
    """Return the continuous ranked probability score.

    2 ∫ (1{y < q(p)} − p) (q(p) − y) dp.

    Parameters
    ----------
    quantile : at the probabilities `EVEN`; endless ones count as the longest that ends
    truth : y
    """
    q = np.minimum(quantile, quantile[np.isfinite(quantile)].max(initial=truth))
    return float(2.0 * np.mean(((truth < q) - EVEN) * (q - truth)))


def interval_score(
    low: Array, high: Array, truth: Array | float, width: float = 0.9
) -> Array:
    """Return the score of intervals: width, and 2/α times how far the truth is outside.

    Parameters
    ----------
    low, high : ends
    truth : what they are to hold
    width : probability of the intervals, 1 − α
    """
    outside = np.maximum(low - truth, 0.0) + np.maximum(truth - high, 0.0)
    return np.asarray(high - low + 2.0 / (1.0 - width) * outside)


def scores_of(quantile: Array, truth: float) -> tuple[float, float]:
    """Return the ranked probability score, and that of the 90 % interval.

    Parameters
    ----------
    quantile : at the probabilities `EVEN`
    truth : what came
    """
    q = np.minimum(quantile, quantile[np.isfinite(quantile)].max(initial=truth))
    low, high = np.interp([0.05, 0.95], EVEN, q)
    return crps(quantile, truth), float(interval_score(low, high, truth))


def truths_inside(q: Array, truth: Array) -> dict[str, float]:
    """Return how many truths lie in the 50 and in the 90 % interval.

    Parameters
    ----------
    q : quantiles, (5, truths)
    truth : (truths,)
    """
    inside = {
        50: (q[1] <= truth) & (truth <= q[3]),
        90: (q[0] <= truth) & (truth <= q[4]),
    }
    return {f"replay_in_{width}": float(held.sum()) for width, held in inside.items()}


def simple_rules(
    study: cases.Subject, post: grids.Posterior, last_cycle: float
) -> tuple[float, float]:
    """Return the remaining life by two simple rules [cycles], NaN where one has none.

    They are the ratio of wear to cycles, and a line through three values.

    Parameters
    ----------
    study : with what ends the life
    post : with the observations
    last_cycle : from which on the life remains
    """
    limit = study.limit
    run = post.histories[0]
    blocks = post.blocks
    number = next((n for n, b in enumerate(blocks) if b.measures(limit)), None)
    if number is None:
        return np.nan, np.nan

    rows = blocks[number].rows
    rows = rows[np.argsort(run.points[number].cycle[rows], kind="stable")]
    cycle = run.points[number].cycle[rows]
    value = blocks[number].observed.value[rows]
    is_known = np.isfinite(value) & (cycle <= last_cycle)
    cycle = cycle[is_known]
    value = value[is_known]

    ratio = np.nan
    line = np.nan
    if len(cycle) and value[-1] > 0.0:
        begin = run.begin(number)
        ratio = begin + (cycle[-1] - begin) * limit.value / value[-1] - last_cycle
    if len(cycle) > 2 and np.ptp(cycle[-3:]) > 0.0:
        slope, intercept = np.polyfit(cycle[-3:], value[-3:], 1)
        if slope > 0.0:
            line = (limit.value - intercept) / slope - last_cycle
    return ratio, line


def replayed(
    study: cases.Subject, post: grids.Posterior, end: float = np.nan
) -> xr.Dataset:
    """Return quantiles of factor and lives after each inspection, and its check.

    Parameters
    ----------
    study, post : what was asked, and what is known
    end : cycle at which the limit was measured, NaN where it was not
    """
    run = post.histories[0]
    cycles = data_blocks.cycles_of(post.blocks, run)
    if len(cycles) > MAX_REPLAYED:
        chosen = np.linspace(0, len(cycles) - 1, MAX_REPLAYED).astype(int)
        cycles = cycles[chosen]

    rng = np.random.default_rng([study.spec.seed, 3])
    no_values = answers.without_values(post.blocks)
    prior = answers.answer_of(study, post.histories, no_values)
    draws = sampling.draw(prior, DRAWS, rng)
    middle = float(prior.life(np.array([0.5]))[0])
    rows: list[dict[str, Any]] = []
    for cycle in each_told([float(cycle) for cycle in cycles]):
        until = data_blocks.select_by_cycle(post.blocks, run, np.less_equal, cycle)
        answer = answers.answer_of(study, post.histories, until)
        # the draws of before, and the values of now
        results, _ = sampling.checks(replace(draws, posterior=answer.posterior))
        now_checked = [check.p for check in results if check.cycle == cycle]
        draws = sampling.draw(answer, DRAWS, rng)
        row = _replay_row(answer, cycle, end)
        row["check_p_forward"] = min(now_checked, default=np.nan)
        rules = (*simple_rules(study, post, cycle), middle - cycle)
        rows.append(row | dict(zip(RULES, rules, strict=True)))
    return layout.dataset(
        "replay",
        layout.stacked(rows),
        over="inspection",
        inspection=cycles,
        quantile=layout.P,
    )


def _replay_row(answer: Answer, cycle: float, end: float) -> dict[str, Any]:
    """Return the answer after an inspection, and its score where the end came later."""
    life = answer.life(layout.P)
    return {
        "life_quantile": life,
        "factor_quantile": answer.factor(layout.P),
        "remaining_useful_life_quantile": np.maximum(life - answer.now, 0.0),
        "log_evidence": answer.posterior.evidence,
        "check_p_forward": np.nan,
        "crps": crps(answer.life(EVEN), end) if cycle < end else np.nan,
    }


def scored(replay: xr.Dataset, end: float) -> xr.Dataset:
    """Return how the answers before a measured end of life did, over what then came.

    Parameters
    ----------
    replay : as `replayed` returns it
    end : cycle at which the limit was measured, NaN where it was not: then there is
        nothing to say
    """
    early = replay.isel(inspection=np.flatnonzero(replay["inspection"].values < end))
    if not np.isfinite(end) or not early.sizes["inspection"]:
        return xr.Dataset()

    truth = end - early["inspection"].values
    remaining = early["remaining_useful_life_quantile"]
    rest = remaining.transpose("quantile", "inspection").values
    relative_error = np.abs(rest[2] - truth) / truth
    score = {
        "replay_inspections": float(len(truth)),
        "replay_mean_error": np.mean(relative_error),
    }
    score |= truths_inside(rest, truth)
    score["replay_crps"] = np.mean(early["crps"].values / truth)
    intervals = interval_score(rest[0], rest[4], truth)
    score["replay_interval_score"] = np.mean(intervals / truth)
    for rule in RULES:
        off = np.abs(early[rule] - truth) / truth
        score[f"replay_error_{rule}"] = float(off.mean())
        of_those_with_rule = relative_error + 0.0 * off
        score[f"replay_own_{rule}"] = float(of_those_with_rule.mean())
    return layout.dataset("statistics", score)


class Model(NamedTuple):
    """One way to explain the measurements.

    Parameters
    ----------
    name : what it is called
    posterior : of its runs
    blocks : the observations with its errors
    """

    name: str
    posterior: grids.Posterior
    blocks: data_blocks.Blocks

    def updated(self) -> grids.Posterior:
        """Return what is known by this model."""
        return self.posterior.updated_with(self.blocks)


def models_of(outcome: answers.UpdateOutcome) -> Iterator[Model]:
    """Yield the model that was asked for, and those that differ from it in one thing.

    Parameters
    ----------
    outcome : of a case
    """
    post = outcome.posterior
    study = outcome.study
    accumulates = study.spec.discrepancy == answers.ACCUMULATING
    changes = study.spec.change != "none"
    drifts = any(block.data.error.drift is not None for block in post.blocks)
    errors = ["", ""]
    if drifts:
        errors = ["accumulating noise", "independent errors"]
        errors = errors if accumulates else errors[::-1]
    change = f"k changes ({study.spec.change})" if changes else ""

    def name(*parts: str) -> str:
        return ", ".join(filter(None, (study.label, *parts)))

    yield Model(name(errors[0], change), post, post.blocks)
    if drifts:
        blocks = [block.drifting(not accumulates) for block in post.blocks]
        yield Model(name(errors[1], change), post, blocks)
    if changes:
        first = replace(post.histories[0], log_weight=0.0)
        constant = post.with_changes(histories=(first,))
        yield Model(name(errors[0], "k constant"), constant, post.blocks)


def left_out(post: grids.Posterior) -> Array:
    """Return ln of the probability of each inspection given all others.

    NaN where that is much to do.

    Parameters
    ----------
    post : with all inspections
    """
    run = post.histories[0]
    values = sum(len(points.cycle) for points in run.points)
    if len(post.histories) * values > MAX_LEFT_OUT:
        return np.full(1, np.nan)
    evidences = []
    for cycle in data_blocks.cycles_of(post.blocks, run):
        others = data_blocks.select_by_cycle(post.blocks, run, np.not_equal, cycle)
        evidences.append(post.updated_with(others).evidence)
    return post.evidence - np.array(evidences)


def compared(outcomes: Sequence[answers.UpdateOutcome]) -> xr.Dataset | None:
    """Return the models beside each other, the most probable first.

    None of a single one.

    Parameters
    ----------
    outcomes : of cases with the same measurements
    """
    models = [model for outcome in outcomes for model in models_of(outcome)]
    if len(models) < 2 or not data_blocks.measured_blocks(models[0].blocks):
        return None
    ranked = [(model.updated(), model.name) for model in models]
    ranked.sort(key=lambda pair: -pair[0].evidence)
    posts, names = zip(*ranked, strict=True)

    logs_by_model = [left_out(post) for post in posts]
    best = logs_by_model[0]
    differences = [
        logs - best if len(logs) == len(best) else np.full(1, np.nan)
        for logs in logs_by_model
    ]
    values = {
        "log_evidence": [post.evidence for post in posts],
        "log_left_out": [float(np.sum(logs)) for logs in logs_by_model],
        "left_out_difference": [float(np.sum(off)) for off in differences],
        "left_out_error": [_error_of_sum(off) for off in differences],
    }
    return layout.dataset("comparison", values, model=np.array(names, dtype=object))


def _error_of_sum(values: Array) -> float:
    """Return the standard error of a sum of independent values, NaN of one."""
    if len(values) < 2:
        return np.nan
    return float(np.sqrt(len(values)) * float(np.std(values, ddof=1)))

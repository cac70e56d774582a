"""How good the answers are: after every inspection beside simple rules, and models beside each other.

Models compared: cases with the same measurements, errors that accumulate or not, k that
changed or not. An inspection left out is foretold exactly, without a sampling error: ln
p(y_i | the others) = ln Z − ln Z₋ᵢ.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.updating import answers, cases, grids, layout, likelihood, sampling

MOST = 200  # inspections that are replayed; of more, evenly many
DRAWS = 1000
EVEN = (np.arange(100) + 0.5) / 100
RULES = ("by_the_ratio", "by_the_last_three", "by_the_prior")


def crps(quantile: Array, truth: float) -> float:
    """Return the continuous ranked probability score, 2 ∫ (1{y < q(p)} − p) (q(p) − y) dp.

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
    """Return the score of intervals: their width, and 2/α times how far the truth lies outside."""
    outside = np.maximum(low - truth, 0.0) + np.maximum(truth - high, 0.0)
    return np.asarray(high - low + 2.0 / (1.0 - width) * outside)


def scores_of(quantile: Array, truth: float) -> tuple[float, float]:
    """Return the ranked probability score, and that of the 90 % interval, of quantiles at `EVEN`."""
    q = np.minimum(quantile, quantile[np.isfinite(quantile)].max(initial=truth))
    low, high = np.interp([0.05, 0.95], EVEN, q)
    return crps(quantile, truth), float(interval_score(low, high, truth))


def truths_inside(q: Array, truth: Array) -> dict[str, float]:
    """Return how many truths lie in the 50 and in the 90 % interval of quantiles (5, truths)."""
    inside = {
        50: (q[1] <= truth) & (truth <= q[3]),
        90: (q[0] <= truth) & (truth <= q[4]),
    }
    return {f"replay_in_{width}": float(held.sum()) for width, held in inside.items()}


def simple_rules(
    study: cases.Subject, post: grids.Posterior, last_cycle: float
) -> tuple[float, float]:
    """Return the remaining life by the ratio of wear to cycles, and by a line through three values."""
    limit = study.limit
    run = post.histories[0]
    ratio = np.nan
    line = np.nan
    number = next((n for n, b in enumerate(post.blocks) if b.measures(limit)), None)
    if number is None:
        return ratio, line
    rows = post.blocks[number].rows
    rows = rows[np.argsort(run.points[number].cycle[rows], kind="stable")]
    cycle = run.points[number].cycle[rows]
    value = post.blocks[number].observed.value[rows]
    cycle, value = (
        array[np.isfinite(value) & (cycle <= last_cycle)] for array in (cycle, value)
    )
    if len(cycle) and value[-1] > 0.0:
        begin = run.begin(number)
        ratio = begin + (cycle[-1] - begin) * limit.value / value[-1] - last_cycle
    if len(cycle) > 2 and np.ptp(cycle[-3:]) > 0.0:
        slope, at = np.polyfit(cycle[-3:], value[-3:], 1)
        line = (limit.value - at) / slope - last_cycle if slope > 0.0 else np.nan
    return ratio, line


def replayed(
    study: cases.Subject, post: grids.Posterior, end: float = np.nan
) -> xr.Dataset:
    """Return quantiles of factor, life and remaining life after each inspection, and its check.

    Parameters
    ----------
    study, post : what was asked, and what is known
    end : cycle at which the limit was measured, NaN where it was not
    """
    run = post.histories[0]
    cycles = likelihood.cycles_of(post.blocks, run)
    if len(cycles) > MOST:
        cycles = cycles[np.linspace(0, len(cycles) - 1, MOST).astype(int)]
    rng = np.random.default_rng([study.spec.seed, 3])
    prior = answers.answer_of(
        study, post.histories, answers.without_values(post.blocks)
    )
    draws = sampling.draw(prior, DRAWS, rng)
    middle = float(prior.life(np.array([0.5]))[0])
    rows: list[dict[str, Any]] = []
    for cycle in map(float, cycles):
        until = likelihood.select_by_cycle(post.blocks, run, np.less_equal, cycle)
        answer = answers.answer_of(study, post.histories, until)
        results, _ = sampling.checks(replace(draws, posterior=answer.posterior))
        last = [check.p for check in results if check.cycle == cycle]
        draws = sampling.draw(answer, DRAWS, rng)
        life = answer.life(layout.P)
        row: dict[str, Any] = {
            "life_quantile": life,
            "factor_quantile": answer.factor(layout.P),
        }
        row |= {"remaining_useful_life_quantile": np.maximum(life - answer.now, 0.0)}
        row |= {
            "log_evidence": answer.posterior.evidence,
            "check_p_forward": min(last, default=np.nan),
        }
        row |= {"crps": crps(answer.life(EVEN), end) if cycle < end else np.nan}
        rows.append(
            row
            | dict(
                zip(
                    RULES,
                    (*simple_rules(study, post, cycle), middle - cycle),
                    strict=True,
                )
            )
        )
    columns = layout.stacked(rows)
    return layout.dataset(
        "replay", columns, over="inspection", inspection=cycles, quantile=layout.P
    )


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
    rest = (
        early["remaining_useful_life_quantile"]
        .transpose("quantile", "inspection")
        .values
    )
    relative_error = np.abs(rest[2] - truth) / truth
    score = {
        "replay_inspections": float(len(truth)),
        "replay_mean_error": np.mean(relative_error),
    }
    score |= truths_inside(rest, truth)
    score["replay_crps"] = np.mean(early["crps"].values / truth)
    score["replay_interval_score"] = np.mean(
        interval_score(rest[0], rest[4], truth) / truth
    )
    for rule in RULES:
        off = np.abs(early[rule] - truth) / truth
        score[f"replay_error_{rule}"] = float(off.mean())
        score[f"replay_own_{rule}"] = float(
            (relative_error + 0.0 * off).mean()
        )  # of those that have the rule
    return layout.dataset("statistics", score)


MOST_LEFT_OUT = 3000  # runs times inspections up to which inspections are left out


Model = tuple[
    str, grids.Posterior, likelihood.Blocks
]  # name, a posterior of its runs, observations


def models_of(outcome: answers.UpdateOutcome) -> Iterator[Model]:
    """Yield the model that was asked for, and those that differ from it in one thing."""
    post = outcome.posterior
    study = outcome.study
    accumulates = study.spec.discrepancy == answers.ACCUMULATING
    changes = study.spec.change != "none"
    drifts = any(block.data.error.drift is not None for block in post.blocks)
    errors = (
        ["accumulating noise", "independent errors"][:: 1 if accumulates else -1]
        if drifts
        else ["", ""]
    )
    change = f"k changes ({study.spec.change})" if changes else ""

    def name(*parts: str) -> str:
        return ", ".join(filter(None, (study.label, *parts)))

    yield name(errors[0], change), post, post.blocks
    if drifts:
        yield (
            name(errors[1], change),
            post,
            [block.drifting(not accumulates) for block in post.blocks],
        )
    if changes:
        constant = post.with_changes(
            histories=(replace(post.histories[0], log_weight=0.0),)
        )
        yield name(errors[0], "k constant"), constant, post.blocks


def left_out(post: grids.Posterior) -> Array:
    """Return ln of the probability of each inspection given all others.

    NaN where that is much to do.
    """
    run = post.histories[0]
    if (
        len(post.histories) * sum(len(points.cycle) for points in run.points)
        > MOST_LEFT_OUT
    ):
        return np.full(1, np.nan)
    cycles = likelihood.cycles_of(post.blocks, run)
    posteriors = [
        post.updated_with(
            likelihood.select_by_cycle(post.blocks, run, np.not_equal, cycle)
        )
        for cycle in cycles
    ]
    return post.evidence - np.array([posterior.evidence for posterior in posteriors])


def compared(outcomes: Sequence[answers.UpdateOutcome]) -> xr.Dataset | None:
    """Return the models beside each other, the most probable first.

    None of a single one.
    """
    models = [model for outcome in outcomes for model in models_of(outcome)]
    if len(models) < 2 or not likelihood.measured_blocks(models[0][2]):
        return None
    ranked = sorted(
        ((post.updated_with(blocks), name) for name, post, blocks in models),
        key=lambda logs: -logs[0].evidence,
    )
    posts, names = zip(*ranked, strict=True)
    left_out_logs = [left_out(post) for post in posts]
    off = [
        logs - left_out_logs[0]
        if len(logs) == len(left_out_logs[0])
        else np.full(1, np.nan)
        for logs in left_out_logs
    ]
    error = [
        np.sqrt(len(o)) * float(np.std(o, ddof=1)) if len(o) > 1 else np.nan
        for o in off
    ]
    values = {"log_evidence": [post.evidence for post in posts]}
    values["log_left_out"] = [float(np.sum(logs)) for logs in left_out_logs]
    values |= {
        "left_out_difference": [float(np.sum(logs)) for logs in off],
        "left_out_error": error,
    }
    return layout.dataset("comparison", values, model=np.array(names, dtype=object))

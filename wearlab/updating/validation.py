"""How good the answers are: as after every inspection, and of synthetic twins put through the same code.

Truths of twins are drawn from the prior, measurements from the model with its errors; each twin is updated
as the real data are. The probability that a posterior gives to less than the truth is then uniform (Talts et
al. 2018, arXiv:1804.06788), and an interval holds the truth as often as it says.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.update_options import TrueModel
from wearlab.updating.answer import QUANTILES, Answer, passage_time, present_state
from wearlab.updating.checks import checks
from wearlab.updating.draws import Draws, drawn
from wearlab.updating.history import Clock, RunHistory
from wearlab.updating.likelihood import PER, Block, block_of
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.posterior import Posterior
from wearlab.updating.twins import Truth, synthetic

if TYPE_CHECKING:
    from wearlab.updating.study import MeasuredCase

ABOUT = {
    "life_quantile": "cycles to the limit",
    "remaining_useful_life_quantile": "cycles from the inspection to the limit",
    "factor_quantile": "factor on the wear coefficient",
    "log_evidence": "log of the probability of all measurements until then",
    "check_p_forward": "probability of an inspection as far off, by what was known before it",
    "inspection": "cycle of the inspection",
    "quantile": "probability of less",
    "replay_inspections": "inspections before the measured end of life",
    "replay_mean_error": "mean relative error of their medians of the remaining life",
    "replay_in_50": "inspections whose 50 % interval of the remaining life held what came",
    "replay_in_90": "inspections whose 90 % interval of the remaining life held what came",
    "replay_crps": "mean continuous ranked probability score of the life, over what then came",
    "replay_interval_score": "mean score of the 90 % interval of the life, over what then came",
    "by_the_ratio": "remaining life by the ratio of wear to cycles",
    "by_the_last_three": "remaining life by a line through the last three values",
    "by_the_prior": "remaining life by the median of the life before anything was measured",
    "replay_error_by_the_ratio": "mean relative error of the ratio of wear to cycles",
    "replay_error_by_the_last_three": "mean relative error of a line through the last three values",
    "replay_error_by_the_prior": "mean relative error of the median life before anything was measured",
    "crps": "continuous ranked probability score of the life [cycles]",
}
MOST = 200  # inspections that are replayed; of more, evenly many
DRAWS = 1000
WIDTHS = (0.5, 0.9)
EVEN = (np.arange(100) + 0.5) / 100
RULES = ("by_the_ratio", "by_the_last_three", "by_the_prior")


def _dataset(values: Mapping[str, tuple[tuple[str, ...], Any]], **coords: Array) -> xr.Dataset:
    """Return variables labelled by `ABOUT`."""
    return xr.Dataset(
        {name: (*each, {"units": "1", "long_name": ABOUT[name]}) for name, each in values.items()},
        {name: (name, each, {"units": "1", "long_name": ABOUT[name]}) for name, each in coords.items()},
    )


def up_to(post: Posterior, cycle: float) -> tuple[Block, ...]:
    """Return the blocks with what had been measured by a cycle."""
    run = post.histories[0]
    return tuple(
        replace(block, rows=block.rows[run.asked[n].cycle[block.rows] <= cycle])
        for n, block in enumerate(post.blocks)
    )


def crps(quantile: Array, truth: float) -> float:
    """Return the continuous ranked probability score, 2 ∫ (1{y < q(p)} − p) (q(p) − y) dp.

    Parameters
    ----------
    quantile : at the probabilities `EVEN`; endless ones count as the longest that ends
    truth : y
    """
    ends = quantile[np.isfinite(quantile)]
    q = np.minimum(quantile, ends.max(initial=truth))
    return float(2.0 * np.mean(((truth < q) - EVEN) * (q - truth)))


def interval_score(low: Array, high: Array, truth: Array, width: float = 0.9) -> Array:
    """Return the score of intervals: their width, and 2/α times how far the truth lies outside."""
    outside = np.maximum(low - truth, 0.0) + np.maximum(truth - high, 0.0)
    return np.asarray(high - low + 2.0 / (1.0 - width) * outside)


def simple_rules(study: "MeasuredCase", post: Posterior, inspections: Array) -> dict[str, Array]:
    """Return the remaining life by the ratio of wear to cycles, and by a line through three values."""
    limit, run = study.limit, post.histories[0]
    found = {name: np.full(len(inspections), np.nan) for name in RULES[:2]}
    for n, block in enumerate(post.blocks):
        same = block.data.quantity == limit.quantity and limit.where in (None, block.data.where)
        if not same or block.data.since is not None or block.seen.place_kind is not None:
            continue
        cycle, value = run.asked[n].cycle[block.rows], block.seen.value[block.rows]
        order = np.argsort(cycle[np.isfinite(value)], kind="stable")
        cycle, value = (each[np.isfinite(value)][order] for each in (cycle, value))
        for i, now in enumerate(inspections):
            last = int(np.searchsorted(cycle, now, side="right"))
            if last and value[last - 1] > 0.0:
                start = run.start + (cycle[last - 1] - run.start) * limit.value / value[last - 1]
                found["by_the_ratio"][i] = start - now
            if last >= 3 and np.ptp(cycle[last - 3 : last]) > 0.0:
                slope, at = np.polyfit(cycle[last - 3 : last], value[last - 3 : last], 1)
                if slope > 0.0:
                    found["by_the_last_three"][i] = (limit.value - at) / slope - now
        break
    return found


def replayed(study: "MeasuredCase", post: Posterior, end: float = np.nan) -> xr.Dataset:
    """Return quantiles of factor, life and remaining life after each inspection, and its check.

    ``check_p_forward`` is the probability of an inspection as far off, by what was known before it.

    Parameters
    ----------
    study, post : what was asked, and what is known
    end : cycle at which the limit was measured, NaN where it was not
    """
    run, p = post.histories[0], np.array(QUANTILES)
    each = [run.asked[n].cycle[block.rows] for n, block in enumerate(post.blocks)]
    cycles = np.unique(np.concatenate(each)) if each else np.zeros(0)
    if len(cycles) > MOST:
        cycles = cycles[np.linspace(0, len(cycles) - 1, MOST).astype(int)]
    proposal = post.log_proposal if len(post.histories) > 1 else None
    life, rest, factor, evidence, check = [], [], [], [], []
    rng = np.random.default_rng([study.spec.seed, 3])
    prior, score = answered(study, post.histories, unseen(post.blocks), proposal), []
    known = drawn(prior, DRAWS, rng)
    for cycle in cycles:
        answer = answered(study, post.histories, up_to(post, float(cycle)), proposal)
        life.append(answer.life(p))
        rest.append(np.maximum(life[-1] - answer.now, 0.0))
        factor.append(answer.factor(p))
        evidence.append(answer.posterior.evidence)
        score.append(crps(answer.life(EVEN), end) if cycle < end else np.nan)
        last = [made.p for made in checks(answer.posterior, known)[0] if made.cycle == cycle]
        check.append(min(last, default=np.nan))
        known = drawn(answer, DRAWS, rng)
    dims, shape = ("inspection", "quantile"), (len(cycles), len(p))
    values = {
        "life_quantile": (dims, np.reshape(life, shape)),
        "remaining_useful_life_quantile": (dims, np.reshape(rest, shape)),
        "factor_quantile": (dims, np.reshape(factor, shape)),
        "log_evidence": (("inspection",), np.array(evidence, float)),
        "check_p_forward": (("inspection",), np.array(check, float)),
        "crps": (("inspection",), np.array(score, float)),
        "by_the_prior": (("inspection",), float(prior.life(np.array([0.5]))[0]) - cycles),
    }
    rules = simple_rules(study, post, cycles)
    values |= {name: (("inspection",), rule) for name, rule in rules.items()}
    return _dataset(values, inspection=cycles, quantile=p)


def scored(replay: xr.Dataset, end: float) -> xr.Dataset:
    """Return how the answers before a measured end of life did.

    Parameters
    ----------
    replay : as `replayed` returns it
    end : cycle at which the limit was measured, NaN where it was not: then there is nothing to say
    """
    before = replay.isel(inspection=np.flatnonzero(replay["inspection"].values < end))
    if not np.isfinite(end) or not before.sizes["inspection"]:
        return xr.Dataset()
    truth = end - before["inspection"].values
    rest = before["remaining_useful_life_quantile"].transpose("quantile", "inspection").values
    score = {
        "replay_inspections": float(len(truth)),
        "replay_mean_error": float(np.mean(np.abs(rest[2] - truth) / truth)),
        "replay_in_50": float(np.sum((rest[1] <= truth) & (truth <= rest[3]))),
        "replay_in_90": float(np.sum((rest[0] <= truth) & (truth <= rest[4]))),
        "replay_crps": float(np.mean(before["crps"].values / truth)),
        "replay_interval_score": float(np.mean(interval_score(rest[0], rest[4], truth) / truth)),
    }
    for rule in RULES:
        off = np.abs(before[rule].values - truth) / truth
        score[f"replay_error_{rule}"] = float(np.nanmean(off)) if np.isfinite(off).any() else np.nan
    return _dataset({name: ((), value) for name, value in score.items()})


def calibrated(
    study: "MeasuredCase", post: Posterior, n: int, *, told: Sequence[Block] | None = None
) -> xr.Dataset:
    """Return the ranks of the truths of synthetic twins, and how often intervals hold them.

    Parameters
    ----------
    study, post : the study and its posterior: runs, blocks, prior
    n : number of twins
    told : the errors that the twins are updated with, where they are to be wrong [those they are made with]
    """
    rng, true = np.random.default_rng([study.spec.seed, 2]), study.spec.check
    source = post
    if true is not None:
        runs = tuple(_bent(run, true.power) for run in post.histories)
        source, told = replace(post, histories=runs, blocks=_true_blocks(post, true)), told or post.blocks
    before = answered(study, source.histories, unseen(source.blocks), post.log_proposal)
    truths = drawn(before, n, rng)
    ranks: dict[str, list[float]] = {"factor": [], "life": []}
    scores: dict[str, list[float]] = {"posterior": [], "prior": []}
    unmeasured = before.life(EVEN)
    for t in range(n):
        made, life = twin(source, truths, t, before, rng)
        if told is not None:
            made = tuple(
                replace(believed, seen=replace(real.seen, data=believed.data))
                for believed, real in zip(told, made, strict=True)
            )
        kept = np.ones(len(post.histories), bool)
        if len(kept) > 1:  # its own run knows too much
            kept[truths.run[t]] = False
        runs = tuple(run for run, held in zip(post.histories, kept, strict=True) if held)
        answer = answered(study, runs, made, post.log_proposal[kept])
        if study.prior is not None:
            ranks["factor"].append(answer.factor_below(float(truths.factor[t])))
        over = life <= answer.now and answer.drifting is not None
        rank = float(rng.random() * answer.passed) if over else float(answer.life_below(life)[0])
        ranks["life"].append(rank)
        if np.isfinite(life):
            scores["posterior"].append(crps(answer.life(EVEN), life))
            scores["prior"].append(crps(unmeasured, life))
    variables: dict[str, xr.Variable] = {}
    for name, values in ranks.items():
        if not values:
            continue
        ranked = np.array(values)
        about = {"units": "1", "long_name": f"posterior probability of less {name} than the truth"}
        variables[f"{name}_rank"] = xr.Variable("twin", ranked, about)
        for width in WIDTHS:
            share = float(np.mean(np.abs(ranked - 0.5) <= 0.5 * width))
            about = {"units": "1", "long_name": "share of intervals with the truth"}
            variables[f"{name}_coverage_{100 * width:.0f}"] = xr.Variable((), share, about)
    if scores["prior"]:
        gain = 1.0 - float(np.sum(scores["posterior"]) / max(float(np.sum(scores["prior"])), 1e-300))
        saved = "part of the prior's ranked probability score of the life that the measurements save"
        variables["life_skill"] = xr.Variable((), gain, {"units": "1", "long_name": saved})
    coords = {"twin": ("twin", np.arange(n), {"units": "1", "long_name": "twin"})}
    return xr.Dataset(variables, coords, {} if true is None else {"true_model": repr(true)})


def _bent(run: RunHistory, power: float) -> RunHistory:
    """Return a run whose wear goes as the cycles to a power, and is its own at the last inspection."""
    last = (
        max((float(asked.cycle.max()) for asked in run.asked if len(asked.cycle)), default=run.end)
        - run.start
    )
    share = np.concatenate([np.linspace(0.0, 2.0, 401), np.geomspace(2.1, 1e4, 400)])
    clock = Clock(run.start + last * share, run.start + last * share**power)
    return run if power == 1.0 else replace(run, clock=clock)


def _true_blocks(post: Posterior, true: TrueModel) -> tuple[Block, ...]:
    """Return the blocks with the errors that are true of twins."""
    if true.errors is None:
        return post.blocks
    made = []
    for block in post.blocks:
        error = true.errors[block.data.number - 1]
        seen = replace(block.seen, data=replace(block.data, error=error))
        made.append(replace(block_of(seen, accumulating=True), rows=block.rows, numerical=block.numerical))
    return tuple(made)


def twin(
    post: Posterior, truths: Draws, t: int, before: Answer, rng: np.random.Generator
) -> tuple[tuple[Block, ...], float]:
    """Return the blocks with made-up values of one truth, and its life.

    Parameters
    ----------
    post : for its runs and blocks
    truths : draws from the prior
    t : which of them
    before : the prior, for what drifts on to the limit
    rng : of errors and drift
    """
    run = post.histories[int(truths.run[t])]
    factor = truths.factor[t : t + 1]
    made, life = [], float(run.life(factor)[0])
    for number, block in enumerate(post.blocks):
        sd, drift = float(truths.sd[number][t]), float(truths.drift[number][t])
        value, w, last = synthetic(block, run, number, Truth(float(factor[0]), sd, drift), rng)
        values = block.seen.value.copy()
        values[block.rows] = value
        made.append(replace(block, seen=replace(block.seen, value=values)))
        if number == before.drifting and drift > 0.0:
            cycles = [run.asked[n].cycle[b.rows].max() for n, b in enumerate(post.blocks) if len(b.rows)]
            now, rate = float(max(cycles)), np.array([drift**2 / PER])
            w += float(np.sqrt(rate[0] * (now - last)) * rng.standard_normal())
            life = now + float(passage_time(*present_state(run, factor, np.array([w]), now), rate, rng)[0])
    return tuple(made), life

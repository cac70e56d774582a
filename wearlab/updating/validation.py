"""How good the answers are: as after every inspection, and of synthetic twins put through the same code.

Truths of twins are drawn from the prior, measurements from the model with its errors; each twin is updated
as the real data are. The probability that a posterior gives to less than the truth is then uniform (Talts et
al. 2018, arXiv:1804.06788), and an interval holds the truth as often as it says.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.update_options import PREVIOUS, TrueModel
from wearlab.updating.answer import Answer, passage_time, present_state
from wearlab.updating.checks import checks
from wearlab.updating.draws import Draws, drawn
from wearlab.updating.history import Clock, RunHistory
from wearlab.updating.layout import P, dataset, stacked, variable
from wearlab.updating.likelihood import PER, Block, block_of, inspections_of, modelled
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.posterior import Posterior

if TYPE_CHECKING:
    from wearlab.updating.study import MeasuredCase

MOST = 200  # inspections that are replayed; of more, evenly many
DRAWS = 1000
WIDTHS = (0.5, 0.9)
EVEN = (np.arange(100) + 0.5) / 100
RULES = {
    "by_the_ratio": "the ratio of wear to cycles",
    "by_the_last_three": "a line through the last three values",
    "by_the_prior": "the median life before anything was measured",
}


class Truth(NamedTuple):
    """What measurements are made up from: factor, and sd of a value and of the wear in `PER` cycles [SI]."""

    factor: float
    sd: float
    drift: float


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


def held_by(q: Array, truth: Array) -> dict[str, float]:
    """Return how many truths lie in the 50 and in the 90 % interval of quantiles (5, truths)."""
    inside = {50: (q[1] <= truth) & (truth <= q[3]), 90: (q[0] <= truth) & (truth <= q[4])}
    return {f"replay_in_{width}": float(held.sum()) for width, held in inside.items()}


def simple_rules(study: "MeasuredCase", post: Posterior, now: float) -> tuple[float, float]:
    """Return the remaining life by the ratio of wear to cycles, and by a line through three values."""
    limit, run, found = study.limit, post.histories[0], [np.nan, np.nan]
    number = next((n for n, b in enumerate(post.blocks) if b.is_whole(limit.quantity, limit.where)), None)
    if number is None:
        return np.nan, np.nan
    rows = post.blocks[number].rows
    cycle, value = run.asked[number].cycle[rows], post.blocks[number].seen.value[rows]
    held = np.isfinite(value) & (cycle <= now)
    order = np.argsort(cycle[held], kind="stable")
    cycle, value = cycle[held][order], value[held][order]
    if len(cycle) and value[-1] > 0.0:
        found[0] = run.start + (cycle[-1] - run.start) * limit.value / value[-1] - now
    if len(cycle) > 2 and np.ptp(cycle[-3:]) > 0.0:
        slope, at = np.polyfit(cycle[-3:], value[-3:], 1)
        found[1] = (limit.value - at) / slope - now if slope > 0.0 else np.nan
    return found[0], found[1]


def replayed(study: "MeasuredCase", post: Posterior, end: float = np.nan) -> xr.Dataset:
    """Return quantiles of factor, life and remaining life after each inspection, and its check.

    ``check_p_forward`` is the probability of an inspection as far off, by what was known before it.

    Parameters
    ----------
    study, post : what was asked, and what is known
    end : cycle at which the limit was measured, NaN where it was not
    """
    run = post.histories[0]
    each = [run.asked[n].cycle[block.rows] for n, block in enumerate(post.blocks)]
    cycles = np.unique(np.concatenate(each)) if each else np.zeros(0)
    if len(cycles) > MOST:
        cycles = cycles[np.linspace(0, len(cycles) - 1, MOST).astype(int)]
    proposal = post.log_proposal if len(post.histories) > 1 else None
    rng = np.random.default_rng([study.spec.seed, 3])
    prior = answered(study, post.histories, unseen(post.blocks), proposal)
    known, middle, found = drawn(prior, DRAWS, rng), float(prior.life(np.array([0.5]))[0]), []
    for cycle in map(float, cycles):
        answer = answered(study, post.histories, up_to(post, cycle), proposal)
        last = [check.p for check in checks(answer.posterior, known)[0] if check.cycle == cycle]
        known, life = drawn(answer, DRAWS, rng), answer.life(P)
        rest = np.maximum(life - answer.now, 0.0)
        rules = (*simple_rules(study, post, cycle), middle - cycle)
        score = crps(answer.life(EVEN), end) if cycle < end else np.nan
        found.append(
            {
                "life_quantile": variable(life, "cycles to the limit", "quantile"),
                "remaining_useful_life_quantile": variable(
                    rest, "cycles from the inspection to the limit", "quantile"
                ),
                "factor_quantile": variable(answer.factor(P), "factor on the wear coefficient", "quantile"),
                "log_evidence": variable(
                    answer.posterior.evidence, "log of the probability of all measurements until then"
                ),
                "check_p_forward": variable(
                    min(last, default=np.nan),
                    "probability of an inspection as far off, by what was known before it",
                ),
                "crps": variable(score, "continuous ranked probability score of the life [cycles]"),
                **{
                    name: variable(rule, f"remaining life by {words}")
                    for (name, words), rule in zip(RULES.items(), rules, strict=True)
                },
            }
        )
    return dataset(stacked(found, "inspection") if found else {}, inspection=cycles, quantile=P)


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
    inside = held_by(rest, truth)
    held, over = "inspections whose {} % interval of the remaining life held what came", "over what then came"
    score = {
        "replay_inspections": (float(len(truth)), "inspections before the measured end of life"),
        "replay_mean_error": (
            np.mean(np.abs(rest[2] - truth) / truth),
            "mean relative error of their medians of the remaining life",
        ),
        "replay_in_50": (inside["replay_in_50"], held.format(50)),
        "replay_in_90": (inside["replay_in_90"], held.format(90)),
        "replay_crps": (
            np.mean(before["crps"].values / truth),
            f"mean continuous ranked probability score of the life, {over}",
        ),
        "replay_interval_score": (
            np.mean(interval_score(rest[0], rest[4], truth) / truth),
            f"mean score of the 90 % interval of the life, {over}",
        ),
    }
    for rule, words in RULES.items():
        off = np.abs(before[rule].values - truth) / truth
        mean = np.nanmean(off) if np.isfinite(off).any() else np.nan
        score[f"replay_error_{rule}"] = (mean, f"mean relative error of {words}")
    return dataset({name: variable(value, about) for name, (value, about) in score.items()})


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
    truths, unmeasured = drawn(before, n, rng), before.life(EVEN)
    ranks: dict[str, list[float]] = {"factor": [], "life": []}
    scores: list[tuple[float, float]] = []
    for t in range(n):
        made, life = twin(source, truths, t, before, rng)
        if told is not None:
            made = tuple(
                replace(believed, seen=replace(real.seen, data=believed.data))
                for believed, real in zip(told, made, strict=True)
            )
        kept = np.ones(len(post.histories), bool)
        kept[truths.run[t]] = not study.costly  # its own run knows too much
        runs = tuple(run for run, held in zip(post.histories, kept, strict=True) if held)
        answer = answered(study, runs, made, post.log_proposal[kept])
        if study.prior is not None:
            ranks["factor"].append(answer.factor_below(float(truths.factor[t])))
        over = life <= answer.now and answer.drifting is not None
        ranks["life"].append(float(rng.random() * answer.passed if over else answer.life_below(life)[0]))
        if np.isfinite(life):
            scores.append((crps(answer.life(EVEN), life), crps(unmeasured, life)))
    variables: dict[str, xr.Variable] = {}
    for name, values in ranks.items():
        about = f"posterior probability of less {name} than the truth"
        variables |= {f"{name}_rank": variable(values, about, "twin")} if values else {}
        for width in WIDTHS if values else ():
            share = float(np.mean(np.abs(np.array(values) - 0.5) <= 0.5 * width))
            variables[f"{name}_coverage_{100 * width:.0f}"] = variable(
                share, "share of intervals with the truth"
            )
    if scores:
        mine, theirs = np.sum(scores, axis=0)
        about = "part of the prior's ranked probability score of the life that the measurements save"
        variables["life_skill"] = variable(1.0 - float(mine / max(theirs, 1e-300)), about)
    found = dataset(variables, twin=np.arange(n))
    return found if true is None else found.assign_attrs(true_model=repr(true))


def _bent(run: RunHistory, power: float) -> RunHistory:
    """Return a run whose wear goes as the cycles to a power, and is its own at the last inspection."""
    ends = [float(asked.cycle.max()) for asked in run.asked if len(asked.cycle)]
    last = max(ends, default=run.end) - run.start
    share = np.concatenate([np.linspace(0.0, 2.0, 401), np.geomspace(2.1, 1e4, 400)])
    bent = run.start + run.equal(run.start + last * share**power)
    return run if power == 1.0 else replace(run, clock=Clock(run.start + last * share, bent))


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
    cycles = [run.asked[n].cycle[b.rows].max() for n, b in enumerate(post.blocks) if len(b.rows)]
    for number, block in enumerate(post.blocks):
        drift = float(truths.drift[number][t])
        truth = Truth(float(factor[0]), float(truths.sd[number][t]), drift)
        value, w, last = synthetic(block, run, number, truth, rng)
        values = block.seen.value.copy()
        values[block.rows] = value
        made.append(replace(block, seen=replace(block.seen, value=values)))
        if number == before.drifting and drift > 0.0:
            now, rate = float(max(cycles)), np.array([drift**2 / PER])
            w += float(np.sqrt(rate[0] * (now - last)) * rng.standard_normal())
            life = now + float(passage_time(*present_state(run, factor, np.array([w]), now), rate, rng)[0])
    return tuple(made), life


def synthetic(
    block: Block, run: RunHistory, number: int, truth: Truth, rng: np.random.Generator
) -> tuple[Array, float, float]:
    """Return values in place of those that count, how far the wear had strayed at the last, and when.

    A value below its limit of detection is NaN.

    Parameters
    ----------
    block, run, number : what is measured, the run that is the truth, the block's place
    truth : what the run and its errors are
    rng : of the errors
    """
    error, rows, since = block.data.error, block.rows, block.data.since
    model = modelled(block, run, number, np.array([truth.factor]))[0]
    spread = np.sqrt(truth.sd**2 + block.seen.sd[rows] ** 2 + (block.relative * model) ** 2)
    value = model + spread * rng.standard_normal(len(rows))
    last, strayed = float(since) if isinstance(since, float) else run.start, 0.0
    for inspection in inspections_of(block, run, number):
        step = np.sqrt(truth.drift**2 / PER * (inspection.cycle - last)) * rng.standard_normal()
        strayed = step if since == PREVIOUS else strayed + step
        value[inspection.values] += strayed + error.offset_sd * rng.standard_normal()
        last = inspection.cycle
    hidden = value < block.seen.below[rows]  # of which a file says no more than the limit of detection
    return np.where(hidden, np.nan, value), float(strayed), last

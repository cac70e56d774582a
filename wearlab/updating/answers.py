"""One case updated: posterior, answer, draws, checks, and notes for its reader."""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from wearlab.arrays import Array, Flags, Index, Random
from wearlab.updating import (
    condensing,
    data_blocks,
    doubts,
    grids,
    layout,
    misfit,
    rate_drift,
    sampling,
)
from wearlab.updating.cases import Subject, UpdateError
from wearlab.updating.data_blocks import Block, Blocks
from wearlab.updating.lives import Answer
from wearlab.updating.load_changes import load_change
from wearlab.updating.robust import applies, robust_answer
from wearlab.updating.row_checks import RowCheck, odd_rows
from wearlab.updating.run_curves import RunHistory, Runs

ACCUMULATING = "accumulating"
DRIFTING = "drifting-rate"
# standard deviations of ln k between two files that contradict each other
TENSION = 3.0
MAX_ONE_BY_ONE = 200_000  # values whose errors cannot be condensed
# effective runs, and their share of all, below which the answer leans on few
MIN_EFFECTIVE_RUNS = 100.0
MIN_EFFECTIVE_SHARE = 0.5
HARDLY = 0.01  # prior predictive probability below which the prior excludes the data
# equally probable standard errors by which values are judged, of more values fewer
MANY_SDS = 400
FEW_SDS = 20
MANY_VALUES = 2_000
FALSE_ALARM = 0.001  # probability of a note on sound values, of a file
ENDS = (0.05, 0.5, 0.95)
# cycles that a point of the grid is spread over when their interval is told
CYCLES_WITHIN = 30
LargerError = tuple[str, float]
"""An error, and how many times its prior's median it came out at."""
WORN = ("worn_mass", "max_wear_depth", "wear_depth", "tooth_thickness")


@dataclass(frozen=True)
class UpdateOutcome:
    """What an update comes to.

    Parameters
    ----------
    study : what was asked
    answer, prior : on the grid, after and before
    draws, prior_draws : from both
    checks : of every inspection
    courses : of each block, the probability of a course of its inspections as far off
    misfits : of each block, the probability of a bend or break of the wear as clear
    odd_rows : those that chance alone hardly puts so far off what all others tell
    robust : the answer with Student-t errors, None where nothing is odd
    readings : what a steady and each drifting rate would make of the measurements
    sources : for each block that was measured, the answer without it; none where there
        is one block
    notes : what a reader must know
    stats : numbers about the update itself
    """

    study: Subject
    answer: Answer
    draws: sampling.Draws
    prior: Answer
    prior_draws: sampling.Draws
    checks: Sequence[sampling.Check]
    courses: dict[int, float]
    misfits: dict[int, float]
    odd_rows: tuple[RowCheck, ...]
    robust: Answer | None
    readings: tuple[rate_drift.CourseReading, ...]
    sources: dict[int, Answer]
    notes: tuple[str, ...]
    stats: dict[str, float]

    @property
    def posterior(self) -> grids.Posterior:
        """The answer's."""
        return self.answer.posterior


def blocks_of(study: Subject, runs: Runs) -> tuple[Block, ...]:
    """Return the observations of a study with their errors.

    The runs' own error is among them where it counts.

    Parameters
    ----------
    study : with observations
    runs : its stored runs

    Raises
    ------
    UpdateError : there are too many whose errors cannot be condensed
    """
    run = runs[0]
    accumulating = study.spec.discrepancy == ACCUMULATING
    blocks = []
    for n, observed in enumerate(study.observations):
        block = data_blocks.block_of(observed, accumulating=accumulating)
        numerical = 0.0
        if data_blocks.numerical_share(block, run) > data_blocks.MATTERS:
            numerical = run.numerical_of(observed.data.quantity)
        block = replace(block, numerical=numerical)
        blocks.append(block)
        if len(observed) > MAX_ONE_BY_ONE and (
            study.spec.fleet or condensing.one_by_one(block, run, n)
        ):
            raise UpdateError(
                f"{observed.data.place}: {len(observed):,} values that share an error, "
                "or have each its own besides another, are compared one by one, at "
                f"most {MAX_ONE_BY_ONE:,}: take the mean of each inspection, or thin "
                "them out"
            )
    return tuple(blocks)


def answer_of(study: Subject, runs: Runs, blocks: Blocks) -> Answer:
    """Return what is known after the observations that count.

    Parameters
    ----------
    study : what was asked
    runs : its stored runs
    blocks : the observations
    """
    cycles = data_blocks.cycles_of(blocks, runs[0])
    now = float(max(cycles, default=runs[0].start))
    drifting = None
    for n, block in enumerate(blocks):
        if block.drift is not None and block.measures(study.limit):
            drifting = n
            break
    sound_runs = doubts.without_doubts(runs)
    post = grids.Posterior(_drifting(study, sound_runs, blocks), blocks, study.prior)
    answer = Answer(post, now, drifting)

    measured = data_blocks.measured_blocks(blocks)
    if len(measured) < 2 or study.prior is None:
        return answer
    sheets = doubts.sheets_of(blocks)
    if study.spec.change != "none" and len(sheets) < 2:
        return answer  # parts of one block, between which k may have changed
    parts: list[tuple[int, ...]] = [(n,) for n in measured]
    if len(sheets) > 1:
        with_gain = [part for part in parts if blocks[part[0]].data.error.gain_sd]
        parts = [*sheets.values(), *with_gain]
    alone = [_by_blocks(post, blocks, part) for part in parts]
    distance, *pair = contradiction(alone)
    at_odds = tuple(parts[n][0] for n in pair)
    answer = replace(answer, contradiction=distance, at_odds=at_odds)
    if len(sheets) < 2 or drifting is not None:
        return answer
    others = alone[::-1]
    if len(parts) > 2:
        rest = [{*measured} - {*part} for part in sheets.values()]
        others = [_by_blocks(post, blocks, part) for part in rest]
    doubted = doubts.with_doubts(post, alone[: len(sheets)], others)
    return replace(answer, posterior=doubted)


def _by_blocks(
    post: grids.Posterior, blocks: Blocks, numbers: Collection[int]
) -> grids.Posterior:
    """Return what is known by some blocks alone."""
    return post.updated_with(without_values(blocks, keep=numbers))


def _drifting(study: Subject, runs: Runs, blocks: Blocks) -> Runs:
    """Return the runs with those whose wear rate drifts, where it may.

    Of several runs, of a change that is asked for, and of gears that were replaced,
    they are as they are.
    """
    spec = study.spec
    steady = [run for run in runs if run.is_as_stated]
    is_asked = spec.discrepancy == DRIFTING and study.prior is not None
    changes = spec.change != "none" or bool(study.replaced)
    if not is_asked or changes or len(steady) > 1:
        return runs
    return rate_drift.runs_with_drift(steady[0], blocks, study.prior)


def without_values(blocks: Blocks, keep: Collection[int] = ()) -> tuple[Block, ...]:
    """Return blocks of which nothing counts, but of some. Of none: the prior.

    Parameters
    ----------
    blocks : observations
    keep : numbers of the blocks that go on to count
    """
    return tuple(
        b if n in keep else replace(b, rows=b.rows[:0]) for n, b in enumerate(blocks)
    )


def outcome_of(
    study: Subject, runs: Runs, answer: Answer | None = None
) -> UpdateOutcome:
    """Return what one case comes to.

    Parameters
    ----------
    study, runs : what was asked, and what the stored runs say
    answer : the answer by these runs, where it is known already
    """
    rng = np.random.default_rng(study.spec.seed)
    answer = answer or answer_of(study, runs, blocks_of(study, runs))
    blocks = answer.posterior.blocks
    draws = sampling.draw(answer, study.spec.draws, rng)
    prior = answer_of(study, runs, without_values(blocks))
    prior_draws = sampling.draw(prior, study.spec.draws, rng)
    checks, courses = sampling.checks(draws)
    misfits = misfit.misfits(answer.posterior)
    seen = min(misfits.values(), default=1.0) < misfit.ALARM
    readings = _readings(study, answer, seen)
    odd = tuple(odd_rows(answer.posterior, sampling.ALARM))
    robust = None
    if (odd or _any_off(checks)) and applies(answer):
        robust = robust_answer(answer, odd)

    stats = _stats(study, answer)
    stats["prior_predictive_p"] = _prior_predictive_p(prior, prior_draws, blocks, rng)
    larger = tuple(_larger_errors(blocks, draws, prior_draws))
    return UpdateOutcome(
        study=study,
        answer=answer,
        draws=draws,
        prior=prior,
        prior_draws=prior_draws,
        checks=checks,
        courses=courses,
        misfits=misfits,
        odd_rows=odd,
        robust=robust,
        readings=readings,
        sources=_without_each_source(study, runs, answer),
        notes=tuple(_notes(study, answer, draws, stats, larger, odd)),
        stats=stats,
    )


def _any_off(checks: Sequence[sampling.Check]) -> bool:
    """Whether any inspection is farther off than chance makes one of all of them."""
    counts = Counter(check.block for check in checks)
    return any(check.p < sampling.ALARM / counts[check.block] for check in checks)


def _readings(
    study: Subject, answer: Answer, seen: bool
) -> tuple[rate_drift.CourseReading, ...]:
    """Return what each course of the wear rate would make of the measurements.

    None of a steady rate that fits, where no drift is asked for.
    """
    post = answer.posterior
    if any(run.course is not None for run in post.histories):
        return rate_drift.readings_of(answer)
    single = len(doubts.without_doubts(post.histories)) == 1
    single = single and post.prior is not None
    if not (seen and single) or study.replaced:
        return ()
    runs = rate_drift.runs_with_drift(post.histories[0], post.blocks, post.prior)
    drifting = grids.Posterior(runs, post.blocks, post.prior)
    return rate_drift.readings_of(replace(answer, posterior=drifting))


def _without_each_source(
    study: Subject, runs: Runs, answer: Answer
) -> dict[int, Answer]:
    """Return the answer without each measured block, where there are several."""
    blocks = answer.posterior.blocks
    measured = data_blocks.measured_blocks(blocks)
    if len(measured) < 2:
        return {}
    sources = {}
    for n in measured:
        others = without_values(blocks, keep={*measured} - {n})
        sources[n] = replace(answer_of(study, runs, others), now=answer.now)
    return sources


def _stats(study: Subject, answer: Answer) -> dict[str, float]:
    """Return numbers about the update itself."""
    post = answer.posterior
    blocks = post.blocks
    run = post.histories[0]
    measured = [block for block in blocks if len(block.observed)]
    numerical = [run.numerical_of(block.data.quantity) for block in measured]
    shares = [data_blocks.numerical_share(block, run) for block in blocks]
    stats = {
        "log_evidence": post.evidence,
        "effective_runs": post.effective_runs,
        "runs": float(len({run.id for run in post.histories})),
        "beyond_the_runs": answer.beyond,
        "end_passed": answer.passed,
        "numerical_error": max(numerical, default=0.0),
        "numerical_share": max(shares, default=0.0),
        "contradiction": answer.contradiction,
    }
    stats |= facts_of(post)
    if any(block.data.error.drift is not None for block in blocks):
        otherwise = [block.drifting(block.drift is None) for block in blocks]
        as_asked = post.updated_with(blocks)
        gain = as_asked.evidence - post.updated_with(otherwise).evidence
        accumulates = study.spec.discrepancy == ACCUMULATING
        stats["log_evidence_of_drift"] = gain if accumulates else -gain
    return stats


def facts_of(post: grids.Posterior) -> dict[str, float]:
    """Return how much the data prefer a change, and its ratio and cycle.

    Ratio and cycle are those given a change, with their 90 % intervals.

    Parameters
    ----------
    post : of runs with changes of k, or without
    """
    changes = [run.change for run in post.histories if run.change is not None]
    if not changes:
        return {}
    changed = np.array([run.change is not None for run in post.histories])
    with_change = logsumexp(post.relative[changed])
    without = logsumexp(post.relative[~changed])
    facts = {"log_evidence_of_change": float(with_change - without)}

    at, ratio, width = np.array(changes).T
    places = (np.arange(CYCLES_WITHIN) + 0.5) / CYCLES_WITHIN - 0.5
    cycles = at + np.outer(places, width)
    for name, values in (("change_cycle", cycles), ("change_ratio", ratio)):
        weight = np.broadcast_to(post.weight[changed], values.shape).ravel()
        ends = grids.weighted_quantiles(values.ravel(), weight, ENDS).tolist()
        for percent, value in zip((5, 50, 95), ends, strict=True):
            facts[f"{name}_{percent}"] = value
    return facts


def _prior_predictive_p(
    prior_answer: Answer, draws: sampling.Draws, blocks: Blocks, rng: Random
) -> float:
    """Return how probable values as far out as each block's last were before.

    The least of them, two-sided.
    """
    prior = prior_answer.posterior
    smallest = 1.0
    for number in data_blocks.measured_blocks(blocks):
        block = blocks[number]
        if block.observed.censored.any():
            continue
        cycle = prior.histories[0].points[number].cycle[block.rows]
        latest = block.rows[np.flatnonzero(cycle == cycle.max())[-1:]]
        single = [replace(b, rows=b.rows[:0]) for b in blocks]
        single[number] = replace(block, rows=latest)
        block_draws = replace(draws, posterior=prior.with_changes(blocks=single))
        replicas, _ = sampling.replicated(block_draws, number, rng, conditional=False)
        smaller = np.sum(replicas <= block.observed.value[latest])
        below = (smaller + 0.5) / (len(draws) + 1.0)
        smallest = min(smallest, 2.0 * min(below, 1.0 - below))
    return float(smallest)


def contradiction(posts: Sequence[grids.Posterior]) -> tuple[float, int, int]:
    """Return by how many standard deviations of ln k two sources differ, and which.

    They are the two that are most at odds.

    Parameters
    ----------
    posts : of each source alone
    """
    means = []
    sds = []
    for post in posts:
        mean = float(np.sum(post.mass * post.log_factor))
        variance = np.sum(post.mass * (post.log_factor - mean) ** 2)
        means.append(mean)
        sds.append(float(np.sqrt(variance)))
    distances = []
    for i, j in combinations(range(len(posts)), 2):
        sd = max(np.hypot(sds[i], sds[j]), 1e-12)
        distances.append((abs(means[i] - means[j]) / sd, i, j))
    return max(distances)


def _notes(
    study: Subject,
    answer: Answer,
    draws: sampling.Draws,
    stats: dict[str, float],
    larger: Sequence[LargerError],
    odd_rows: Sequence[RowCheck],
) -> list[str]:
    """Return what a reader must know, most important first."""
    post = answer.posterior
    blocks = post.blocks
    no_drift = study.spec.discrepancy == ACCUMULATING and answer.drifting is None
    needed = max(MIN_EFFECTIVE_SHARE * len(post.histories), 20.0)
    few = stats["effective_runs"] < min(MIN_EFFECTIVE_RUNS, needed)
    a_year = study.calendar and study.calendar.a_year
    odd = [
        oddity
        for n, block in enumerate(blocks)
        for oddity in oddities(n, block, post.histories[0], draws.sd[n])
    ]
    values = {
        "study": study,
        "posterior": post,
        "stats": stats,
        "larger": larger,
        "hardly": HARDLY,
        "tension": TENSION,
        "matters": data_blocks.MATTERS,
        "nothing": not data_blocks.measured_blocks(blocks),
        "few": stats["runs"] > 1.0 and few,
        "at_odds": [blocks[n].data for n in answer.at_odds],
        "doubted": doubts.sound_probability(post) < 1.0,
        "chances": [doubts.doubted_probability(post, n) for n in answer.at_odds],
        "oddities": odd,
        "odd_rows": [_described(blocks[check.block], check) for check in odd_rows],
        "hours": study.record and study.record.excess(a_year),
        "pace": study.calendar and study.calendar.pace_change,
        "load_change": load_change(study.record, study.scene),
        "reversed_work": study.record and study.record.reversed_work,
        "steady": _is_taken_as_steady(study, post),
        "no_drift": study.limit.quantity if no_drift else "",
    }
    return layout.rendered("notes.txt", values)


def _described(block: Block, check: RowCheck) -> dict[str, Any]:
    """Return what a note says of an odd row."""
    line = block.observed.row[check.row]
    return {"data": block.data, "line": line, "sds": check.sds, "p": check.p}


def _is_taken_as_steady(study: Subject, post: grids.Posterior) -> bool:
    """Whether the rate may drift, but is taken as steady here."""
    drifts = any(run.course is not None for run in post.histories)
    measured = data_blocks.measured_blocks(post.blocks)
    is_asked = study.spec.discrepancy == DRIFTING and study.spec.change == "none"
    several = len(doubts.without_doubts(post.histories)) > 1
    cannot = several or bool(study.replaced) or study.prior is None
    return bool(measured) and is_asked and cannot and not drifts


def _larger_errors(
    blocks: Blocks, draws: sampling.Draws, prior_draws: sampling.Draws
) -> Iterator[LargerError]:
    """Yield which unknown errors came out far from what was thought, and how far."""
    for error in data_blocks.unknown_errors(blocks):
        of_prior = (prior_draws.sd, prior_draws.drift)[error.side][error.block]
        of_posterior = (draws.sd, draws.drift)[error.side][error.block]
        middle = float(np.median(of_posterior))
        low = np.quantile(of_prior, HARDLY)
        high = np.quantile(of_prior, 1.0 - HARDLY)
        if not low <= middle <= high:
            name = error.spread.name.replace("_", " ")
            yield name, middle / float(np.median(of_prior))


def oddities(
    number: int, block: Block, run: RunHistory, sd: Array | None = None
) -> Iterator[dict[str, Any]]:
    """Yield what is odd about values of a block: none, copies, negative, falling.

    Parameters
    ----------
    number : of the block
    block : observations
    run : a stored run that knows their cycles
    sd : draws of the standard error of a value from the posterior [SI] [what is known
        of it before, in the median]
    """
    observed = block.observed
    data = block.data
    if not len(observed):
        yield {"what": "empty", "data": data}
        return
    copies = _copied_rows(number, block, run)
    if len(copies):
        line = observed.row[copies[0]]
        yield {"what": "copied", "data": data, "line": line, "count": len(copies)}
    if data.quantity not in WORN:
        return

    value = np.where(observed.censored, 0.0, observed.value)
    error = data.error
    count = MANY_SDS if len(observed) <= MANY_VALUES else FEW_SDS
    sds = np.atleast_1d(block.sd.known if sd is None else _evenly(sd, count))
    besides = observed.sd**2 + error.offset_sd**2 + (error.relative * value) ** 2
    negative = np.flatnonzero(_improbable(-value, besides, sds**2))
    if len(negative):
        yield {"what": "negative", "data": data, "line": observed.row[negative[0]]}
    is_total = observed.place_kind is None and not block.counts_since
    if is_total and not observed.censored.any():
        order = np.argsort(run.points[number].cycle, kind="stable")
        of_two = besides[order][1:] + besides[order][:-1]
        risen = np.diff(value[order])
        falls = np.flatnonzero(_improbable(-risen, of_two, 2.0 * sds**2))
        if len(falls):
            is_high, place = _odd_one(value[order], int(falls[0]))
            line = observed.row[order[place]]
            what = "too high" if is_high else "falls"
            yield {"what": what, "data": data, "line": line}


def _evenly(sd: Array, count: int) -> Array:
    """Return draws of a standard error as so many equally probable values."""
    if sd.size == 1:
        return sd
    return np.asarray(np.quantile(sd, (np.arange(count) + 0.5) / count))


def _improbable(amount: Array, besides: Array, variances: Array) -> Flags:
    """Return which amounts, (n,), chance alone hardly makes, one of all of them.

    Parameters
    ----------
    amount : above 0 by so much
    besides : variance of each besides that of all, (n,)
    variances : equally probable ones of all, (sds,)
    """
    rare = FALSE_ALARM / max(len(amount), 1)
    # of others not even the smallest of the errors makes them improbable
    smallest = np.sqrt(besides + variances.min())
    far = norm.isf(rare) * (1.0 - 1e-9) * smallest
    candidates = np.flatnonzero(amount > far)
    errors = np.sqrt(besides[candidates] + variances[:, None])
    scores = amount[candidates] / np.maximum(errors, 1e-300)
    is_improbable = np.zeros(len(amount), bool)
    is_improbable[candidates] = norm.sf(scores).mean(axis=0) < rare
    return is_improbable


def _odd_one(value: Array, before: int) -> tuple[bool, int]:
    """Return whether a value before a fall is too high, and which of the two is odd.

    It is the one that the values about both leave out. ``value`` is in order of time,
    ``before`` the place of the one before the fall.
    """
    high = value[before]
    low = value[before + 1]
    off_if_high = 0.0
    off_if_low = 0.0
    if before > 0:
        # without the high value the others rise; without the low one they rise
        off_if_high += max(value[before - 1] - low, 0.0)
    if before + 2 < len(value):
        off_if_low += max(high - value[before + 2], 0.0)
    is_high = off_if_high < off_if_low
    return is_high, before if is_high else before + 1


def _copied_rows(number: int, block: Block, run: RunHistory) -> Index:
    """Return the rows that repeat another one in all that counts, rising."""
    observed = block.observed
    points = run.points[number]
    value = np.where(observed.censored, -observed.below, observed.value)
    whole = np.column_stack([points.cycle, points.column, value])
    order = np.lexsort(whole.T)
    repeats = np.all(whole[order[1:]] == whole[order[:-1]], axis=1)
    return np.sort(order[1:][repeats])

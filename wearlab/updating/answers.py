"""One case updated: posterior, answer, draws, checks, and what a reader must know besides."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from wearlab.arrays import Random
from wearlab.updating import grids, layout, likelihood, sampling
from wearlab.updating.cases import Subject, UpdateError
from wearlab.updating.likelihood import Block, Blocks
from wearlab.updating.lives import Answer
from wearlab.updating.run_curves import RunHistory, Runs

ACCUMULATING = "accumulating"
MOST_WIDENED = 60  # runs that contradicting sources are widened in
TENSION = (
    3.0  # standard deviations of ln k between two files that contradict each other
)
MOST_ONE_BY_ONE = 200_000  # values whose errors cannot be condensed
FEWEST, CARRIED = (
    100.0,
    0.5,
)  # effective runs, and their share of all, below which the answer leans on few
HARDLY = 0.01  # prior predictive probability below which the prior excludes the data
FALSE_ALARM = 0.001  # probability of a note on sound values, of a file
ENDS = (0.05, 0.5, 0.95)
WITHIN = (
    30  # cycles that a point of the grid is spread over when their interval is told
)
LargerError = tuple[
    str, float
]  # an error, and how many times its prior's median it came out at
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
    sources: dict[int, Answer]
    notes: tuple[str, ...]
    stats: dict[str, float]

    @property
    def posterior(self) -> grids.Posterior:
        """The answer's."""
        return self.answer.posterior


def blocks_of(study: Subject, runs: Runs) -> tuple[Block, ...]:
    """Return the observations of a study with their errors.

    The runs' own error where it counts.

    Raises
    ------
    UpdateError : there are too many whose errors cannot be condensed
    """
    blocks = []
    for n, observed in enumerate(study.observations):
        block = likelihood.block_of(
            observed, accumulating=study.spec.discrepancy == ACCUMULATING
        )
        counts = likelihood.numerical_share(block, runs[0]) > likelihood.MATTERS
        block = replace(
            block,
            numerical=runs[0].numerical_of(observed.data.quantity) if counts else 0.0,
        )
        blocks.append(block)
        if len(observed) > MOST_ONE_BY_ONE and (
            study.spec.fleet or likelihood.one_by_one(block, runs[0], n)
        ):
            message = (
                f"{len(observed):,} values that share an error, or have each its own "
                "besides another, are "
            )
            message += (
                f"compared one by one, at most {MOST_ONE_BY_ONE:,}: take the mean of "
                "each inspection, "
            )
            raise UpdateError(f"{observed.data.place}: {message}or thin them out")
    return tuple(blocks)


def answer_of(study: Subject, runs: Runs, blocks: Blocks) -> Answer:
    """Return what is known after the observations that count in these blocks."""
    last_cycle = float(
        max(likelihood.cycles_of(blocks, runs[0]), default=runs[0].start)
    )
    drifting = (
        n
        for n, b in enumerate(blocks)
        if b.drift is not None and b.measures(study.limit)
    )
    post = grids.Posterior(runs, blocks, study.prior)
    answer = Answer(post, last_cycle, next(drifting, None))
    measured = likelihood.measured_blocks(blocks)
    if len(measured) < 2 or study.prior is None:
        return answer
    separate = [post.updated_with(without_values(blocks, keep=[n])) for n in measured]
    distance, *pair = contradiction(separate)
    answer = replace(
        answer, contradiction=distance, at_odds=tuple(measured[n] for n in pair)
    )
    return (
        replace(answer, posterior=post.widened(separate))
        if distance > TENSION and _widens(answer)
        else answer
    )


def without_values(blocks: Blocks, keep: Collection[int] = ()) -> tuple[Block, ...]:
    """Return blocks of which nothing counts, but of those with such numbers.

    Of none: the prior.
    """
    return tuple(
        b if n in keep else replace(b, rows=b.rows[:0]) for n, b in enumerate(blocks)
    )


def outcome_of(
    study: Subject, runs: Runs, answer: Answer | None = None
) -> UpdateOutcome:
    """Update one case.

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
    measured = likelihood.measured_blocks(blocks)
    sources = {}
    for n in measured if len(measured) > 1 else ():
        sources[n] = replace(
            answer_of(study, runs, without_values(blocks, keep={*measured} - {n})),
            now=answer.now,
        )
    stats = _stats(study, answer) | {
        "prior_predictive_p": _prior_predictive_p(prior, prior_draws, blocks, rng)
    }
    notes = tuple(
        _notes(study, answer, stats, tuple(_larger_errors(blocks, draws, prior_draws)))
    )
    return UpdateOutcome(
        study, answer, draws, prior, prior_draws, checks, courses, sources, notes, stats
    )


def _stats(study: Subject, answer: Answer) -> dict[str, float]:
    post = answer.posterior
    blocks = answer.posterior.blocks
    run = answer.posterior.histories[0]
    off = [
        run.numerical_of(block.data.quantity) for block in blocks if len(block.observed)
    ]
    share = [likelihood.numerical_share(block, run) for block in blocks]
    stats = {"log_evidence": post.evidence, "effective_runs": post.effective_runs}
    stats |= {
        "runs": float(len({run.id for run in post.histories})),
        "beyond_the_runs": answer.beyond,
    }
    stats |= {"end_passed": answer.passed, "numerical_error": max(off, default=0.0)}
    stats |= {
        "numerical_share": max(share, default=0.0),
        "contradiction": answer.contradiction,
    }
    stats |= facts_of(post)
    if any(block.data.error.drift is not None for block in blocks):
        gain = (
            post.evidence
            - post.updated_with(
                [block.drifting(block.drift is None) for block in blocks]
            ).evidence
        )
        stats["log_evidence_of_drift"] = (
            gain if study.spec.discrepancy == ACCUMULATING else -gain
        )
    return stats


def facts_of(post: grids.Posterior) -> dict[str, float]:
    """Return how much the data prefer a change, and its ratio and cycle, with 90 %, given one."""
    changed = np.array([run.change is not None for run in post.histories])
    if not changed.any():
        return {}
    relative = post.relative
    at, ratio, width = np.array(
        [run.change for run in post.histories if run.change is not None]
    ).T
    facts = {
        "log_evidence_of_change": float(
            logsumexp(relative[changed]) - logsumexp(relative[~changed])
        )
    }
    inside = at + np.outer((np.arange(WITHIN) + 0.5) / WITHIN - 0.5, width)
    for name, values in (("change_cycle", inside), ("change_ratio", ratio)):
        weight = np.broadcast_to(post.weight[changed], values.shape).ravel()
        ends = grids.weighted_quantiles(values.ravel(), weight, ENDS).tolist()
        facts |= {
            f"{name}_{p}": value for p, value in zip((5, 50, 95), ends, strict=True)
        }
    return facts


def _prior_predictive_p(
    prior_answer: Answer, draws: sampling.Draws, blocks: Blocks, rng: Random
) -> float:
    """Return how probable values as far out as each block's last were before: the least, two-sided."""
    smallest = 1.0
    run = prior_answer.posterior.histories[0]
    for number in (
        n
        for n in likelihood.measured_blocks(blocks)
        if not blocks[n].observed.censored.any()
    ):
        block = blocks[number]
        cycle = run.points[number].cycle[blocks[number].rows]
        latest = block.rows[np.flatnonzero(cycle == cycle.max())[-1:]]
        single = [
            replace(b, rows=latest if n == number else b.rows[:0])
            for n, b in enumerate(blocks)
        ]
        block_draws = replace(
            draws, posterior=prior_answer.posterior.with_changes(blocks=single)
        )
        replicas = sampling.replicated(block_draws, number, rng, conditional=False)[0]
        below = (np.sum(replicas <= block.observed.value[latest]) + 0.5) / (
            len(draws) + 1.0
        )
        smallest = min(smallest, 2.0 * min(below, 1.0 - below))
    return float(smallest)


def contradiction(posts: Sequence[grids.Posterior]) -> tuple[float, int, int]:
    """Return by how many standard deviations of ln k the two sources most at odds differ, and which."""
    means = [float(np.sum(post.mass * post.log_factor)) for post in posts]
    posts_with_means = zip(posts, means, strict=True)
    sds = [
        float(np.sqrt(np.sum(post.mass * (post.log_factor - mean) ** 2)))
        for post, mean in posts_with_means
    ]
    pairs = combinations(range(len(posts)), 2)
    return max(
        (abs(means[i] - means[j]) / max(np.hypot(sds[i], sds[j]), 1e-12), i, j)
        for i, j in pairs
    )


def _widens(answer: Answer) -> bool:
    """Whether sources that contradict each other widen the interval: without drift, and in few runs."""
    return answer.drifting is None and len(answer.posterior.histories) <= MOST_WIDENED


def _notes(
    study: Subject,
    answer: Answer,
    stats: dict[str, float],
    larger: Sequence[LargerError],
) -> list[str]:
    """Return what a reader must know, most important first."""
    blocks = answer.posterior.blocks
    runs = answer.posterior.histories
    silent = study.spec.discrepancy == ACCUMULATING and answer.drifting is None
    few = stats["effective_runs"] < min(FEWEST, max(CARRIED * len(runs), 20.0))
    values = {
        "study": study,
        "posterior": answer.posterior,
        "stats": stats,
        "larger": larger,
    }
    values |= {"hardly": HARDLY, "tension": TENSION, "matters": likelihood.MATTERS}
    values |= {
        "nothing": not likelihood.measured_blocks(blocks),
        "few": stats["runs"] > 1.0 and few,
    }
    values |= {
        "at_odds": [blocks[n].data for n in answer.at_odds],
        "widened": _widens(answer),
    }
    values["oddities"] = [
        oddity
        for n, block in enumerate(blocks)
        for oddity in oddities(n, block, runs[0])
    ]
    values["hours"] = study.record and study.record.excess(
        study.calendar and study.calendar.a_year
    )
    values["no_drift"] = study.limit.quantity if silent else ""
    return layout.rendered("notes.txt", values)


def _larger_errors(
    blocks: Blocks, draws: sampling.Draws, prior_draws: sampling.Draws
) -> Iterator[LargerError]:
    """Yield which unknown errors came out far from what was thought, and how many times that."""
    for n, side, spread, _ in likelihood.unknown_errors(blocks):
        prior_values = (prior_draws.sd, prior_draws.drift)[side][n]
        posterior_values = (draws.sd, draws.drift)[side][n]
        middle = float(np.median(posterior_values))
        if (
            not np.quantile(prior_values, HARDLY)
            <= middle
            <= np.quantile(prior_values, 1.0 - HARDLY)
        ):
            yield spread.name.replace("_", " "), middle / float(np.median(prior_values))


def oddities(number: int, block: Block, run: RunHistory) -> Iterator[dict[str, Any]]:
    """Yield what is odd about the values of a block: none, copies, below nothing, falling."""
    observed = block.observed
    data = block.data
    error = block.data.error
    if not len(observed):
        yield {"what": "empty", "data": data}
        return
    value = np.where(observed.censored, 0.0, observed.value)
    points = run.points[number]
    whole = np.column_stack(
        [
            points.cycle,
            points.column,
            np.where(observed.censored, -observed.below, value),
        ]
    )
    order = np.lexsort(whole.T)
    repeated = np.sort(order[1:][np.all(whole[order[1:]] == whole[order[:-1]], axis=1)])
    if len(repeated):
        yield {
            "what": "copied",
            "data": data,
            "line": observed.row[repeated[0]],
            "count": len(repeated),
        }
    parts = np.broadcast_arrays(
        block.sd.known, observed.sd, error.offset_sd, error.relative * value
    )
    errors = np.linalg.norm(parts, axis=0)
    far = norm.isf(
        FALSE_ALARM / len(observed)
    )  # standard errors beyond which one of so many values is odd
    negative = np.flatnonzero(value < -far * errors)
    if data.quantity not in WORN:
        return
    if len(negative):
        yield {"what": "negative", "data": data, "line": observed.row[negative[0]]}
    if (
        observed.place_kind is None
        and data.since is None
        and not observed.censored.any()
    ):
        order = np.argsort(points.cycle, kind="stable")
        falls = np.flatnonzero(
            np.diff(value[order])
            < -far * np.hypot(errors[order][1:], errors[order][:-1])
        )
        if len(falls):
            yield {
                "what": "falls",
                "data": data,
                "line": observed.row[order[falls[0] + 1]],
            }

"""The answer where errors may be far larger than they are thought: Student-t laws.

Independent errors are Student-t with the sd of the file as their scale, their degrees
of freedom one of `FREEDOMS`, equally probable before: a reading that nothing else bears
out then hardly counts, without a switch. Errors that values share stay normal.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearlab.updating import grids, rate_drift
from wearlab.updating.data_blocks import Block, Blocks
from wearlab.updating.doubts import without_doubts
from wearlab.updating.lives import Answer
from wearlab.updating.row_checks import MAX_ROWS, RowCheck

# degrees of freedom; with more the law is almost normal
FREEDOMS = (1.5, 2.5, 5.0, 15.0)
MAX_RUNS = 400  # with each of which there are as many more
# densities at one factor, of all runs, freedoms, errors and rows; as many take seconds
MAX_DENSITIES = 1_000_000


def applies(answer: Answer) -> bool:
    """Whether any error may be Student-t: independent, and no unknown gain.

    Parameters
    ----------
    answer : with normal errors
    """
    post = answer.posterior
    is_asked = post.prior is not None and answer.drifting is None
    few_runs = len(post.histories) <= MAX_RUNS and _densities(post) <= MAX_DENSITIES
    return is_asked and few_runs and any(map(_has_tails, post.blocks))


def _densities(post: grids.Posterior) -> int:
    """Return how many densities there are to evaluate at one factor of each run."""
    runs = len(without_doubts(post.histories))
    values = sum(
        len(block.rows) * sd.shape[1] * drift.shape[1]
        for block, (sd, drift) in zip(post.blocks, post.spreads, strict=True)
    )
    return len(FREEDOMS) * runs * values


def _has_tails(block: Block) -> bool:
    """Whether the errors of a block are independent of each other, and not too many."""
    few = 0 < len(block.rows) <= MAX_ROWS
    return few and not (block.shares or block.data.error.gain_sd)


def robust_answer(answer: Answer, odd: Sequence[RowCheck]) -> Answer:
    """Return the answer with Student-t errors.

    Parameters
    ----------
    answer : with normal ones
    odd : rows that are farther off than they should: how the rate drifts is chosen
        without them
    """
    post = answer.posterior
    runs = without_doubts(post.histories)
    steady = [run for run in runs if run.is_as_stated]
    if len(steady) == 1 and len(runs) > 1:
        sound = _without_rows(post.blocks, odd)
        runs = rate_drift.runs_with_drift(steady[0], sound, post.prior)
    with_tails = [replace(run, freedom=freedom) for freedom in FREEDOMS for run in runs]
    robust = grids.Posterior(with_tails, post.blocks, post.prior)
    return replace(answer, posterior=robust)


def _without_rows(blocks: Blocks, odd: Sequence[RowCheck]) -> list[Block]:
    """Return blocks without some of their rows."""
    sound = list(blocks)
    for check in odd:
        block = sound[check.block]
        sound[check.block] = replace(block, rows=block.rows[block.rows != check.row])
    return sound


def freedom_of(answer: Answer) -> float:
    """Return the median of the degrees of freedom.

    Parameters
    ----------
    answer : with Student-t errors
    """
    post = answer.posterior
    freedom = np.array([run.freedom for run in post.histories])
    return float(grids.weighted_quantiles(freedom, post.weight, 0.5))

"""Whether single rows are farther off than their errors: each beside all the others.

About the course that fits best, m, with its slope J by ln of the factor, a row left out
of the weighted regression is off by

    t = r/√(1 − h) / s₋,   s₋² = (ν₀ s₀² + Σ w r² − w r²/(1 − h)) / (ν₀ + n − 1 − q),

with h its leverage, s₀ the sd as it was thought and ν₀ the values that its prior is
worth (infinitely many of a known one), and q the numbers that were fitted. Without
anything wrong t is Student's with the freedom of s₋ (Cook and Weisberg 1982, section
2.2): the row does not judge itself.

Where readings may scatter by a share of the wear besides, each such scatter judges with
its probability after the other rows alone: what it has after all of them, divided by
the density of this row as the others tell it.
"""

from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.special import logsumexp

from wearlab.arrays import Array, Flags
from wearlab.updating.data_blocks import Block, measured_blocks, values_worth
from wearlab.updating.grids import Posterior
from wearlab.updating.misfit import best_fit

MIN_ROWS = 4
MAX_ROWS = 4000  # of more, no single one moves the answer
LEAST_VARIANCE = 1e-200  # [SI²] of a row whose error goes with a wear of none


class RowCheck(NamedTuple):
    """A row beside what all others lead to expect.

    Parameters
    ----------
    block : number of the block
    row : place among its observations
    p : probability of a row as far off, the farthest of all of the block
    sds : standard deviations that it is off, of the others
    """

    block: int
    row: int
    p: float
    sds: float


class _RowsBesideOthers(NamedTuple):
    """Rows beside what all others tell, where readings scatter by so much.

    Parameters
    ----------
    scores : standard deviations that each row is off, of the others
    log_density : ln of the probability density of each row, told by the others
    freedom : degrees of freedom of the scores
    log_weight : ln of how probable the scatter is after all rows, to a constant
    """

    scores: Array
    log_density: Array
    freedom: float
    log_weight: float


def odd_rows(posterior: Posterior, alarm: float) -> list[RowCheck]:
    """Return the row of each block that is farthest off, where chance hardly makes it.

    Parameters
    ----------
    posterior : of runs
    alarm : probability of a false alarm, of all rows of a block together
    """
    if posterior.prior is None:
        return []
    found = []
    for number in measured_blocks(posterior.blocks):
        check = _farthest(posterior, number)
        if check is not None and check.p < alarm:
            found.append(check)
    return found


def _farthest(posterior: Posterior, number: int) -> RowCheck | None:
    """Return the row of a block that is farthest off, None of too few or too many."""
    block = posterior.blocks[number]
    count = len(block.rows)
    can_be_judged = not (block.shares or block.data.error.gain_sd)
    is_seen = not block.observed.censored[block.rows].any()
    if not (can_be_judged and is_seen and MIN_ROWS <= count <= MAX_ROWS):
        return None

    judged = [_judged(posterior, number, runs) for runs in _by_scatter(posterior)]
    log_share = np.array([one.log_weight - one.log_density for one in judged])
    share = np.exp(log_share - logsumexp(log_share, axis=0))
    scores = np.array([one.scores for one in judged])
    place = int(np.argmax(np.sum(share * np.abs(scores), axis=0)))

    tails = [stats.t.sf(np.abs(one.scores[place]), one.freedom) for one in judged]
    p = min(2.0 * count * float(share[:, place] @ tails), 1.0)
    likeliest = int(np.argmax(share[:, place]))
    sds = float(scores[likeliest, place])
    return RowCheck(number, int(block.rows[place]), p, sds)


def _by_scatter(posterior: Posterior) -> list[Flags]:
    """Return the runs of each relative scatter, of those whose sheets are sound."""
    sound = np.array([run.doubted is None for run in posterior.histories])
    scatter = np.array([run.scatter for run in posterior.histories])
    return [sound & (scatter == one) for one in np.unique(scatter[sound])]


def _judged(posterior: Posterior, number: int, runs: Flags) -> _RowsBesideOthers:
    """Return how far each row is off the others, by the likeliest of some runs."""
    block = posterior.blocks[number]
    log_weight = posterior.relative
    likeliest = int(np.argmax(np.where(runs, log_weight, -np.inf)))
    run = posterior.histories[likeliest]
    sd = float(np.exp(np.median(posterior.spreads[number][0][likeliest])))
    centre = float(posterior.centre[likeliest])
    model, slope = best_fit(block, run, number, sd, centre)

    fitted = 1 if run.course is None else 2
    relative_sd = np.hypot(block.relative, run.scatter) * model
    scores, spread, freedom = _left_out(block, relative_sd, model, slope, fitted)
    log_density = stats.t.logpdf(scores, freedom) - np.log(spread)
    weight_of_all = float(logsumexp(log_weight[runs]))
    return _RowsBesideOthers(scores, log_density, freedom, weight_of_all)


def _left_out(
    block: Block, relative_sd: Array, model: Array, slope: Array, fitted: int
) -> tuple[Array, Array, float]:
    """Return by how many sds each row is off the others, these sds, the freedom."""
    rest = block.observed.value[block.rows] - model
    known = block.sd.known
    column_variance = block.observed.sd[block.rows] ** 2
    variance = known**2 + column_variance + relative_sd**2
    sd = np.sqrt(np.maximum(variance, LEAST_VARIANCE))
    standard = rest / sd
    along = slope / sd
    leverage = along**2 / np.sum(along**2)
    left = 1.0 - np.minimum(leverage, 1.0 - 1e-9)
    if block.sd.prior is None:
        return standard / np.sqrt(left), sd / np.sqrt(left), np.inf

    worth = values_worth(block.sd)
    freedom = max(worth + len(rest) - 1.0 - fitted, 1.0)
    others = np.sum(standard**2) - standard**2 / left
    scale = (worth + np.maximum(others, 0.0)) / freedom
    spread = sd * np.sqrt(scale / left)
    return standard / np.sqrt(left * scale), spread, freedom

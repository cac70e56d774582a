"""Whether single rows are farther off than their errors: each beside all the others.

About the course that fits best, m, with its slope J by ln of the factor, a row left out
of the weighted regression is off by

    t = r/√(1 − h) / s₋,   s₋² = (ν₀ s₀² + Σ w r² − w r²/(1 − h)) / (ν₀ + n − 1 − q),

with h its leverage, s₀ the sd as it was thought and ν₀ the values that its prior is
worth (infinitely many of a known one), and q the numbers that were fitted. Without
anything wrong t is Student's with the freedom of s₋ (Cook and Weisberg 1982, section
2.2): the row does not judge itself.
"""

from typing import NamedTuple

import numpy as np
from scipy import stats

from wearlab.arrays import Array
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

    sound = [run.doubted is None for run in posterior.histories]
    likeliest = int(np.argmax(np.where(sound, posterior.weight, -1.0)))
    run = posterior.histories[likeliest]
    sd = float(np.exp(np.median(posterior.spreads[number][0][likeliest])))
    centre = float(posterior.centre[likeliest])
    model, slope = best_fit(block, run, number, sd, centre)
    fitted = 1 if run.course is None else 2
    scores, freedom = _left_out(block, model, slope, fitted)
    place = int(np.argmax(np.abs(scores)))
    tail = float(stats.t.sf(np.abs(scores[place]), freedom))
    p = min(2.0 * count * tail, 1.0)
    return RowCheck(number, int(block.rows[place]), p, float(scores[place]))


def _left_out(
    block: Block, model: Array, slope: Array, fitted: int
) -> tuple[Array, float]:
    """Return by how many sds each row is off what the others tell, and the freedom."""
    rest = block.observed.value[block.rows] - model
    known = block.sd.known
    column_variance = block.observed.sd[block.rows] ** 2
    variance = known**2 + column_variance + (block.relative * model) ** 2
    sd = np.sqrt(np.maximum(variance, LEAST_VARIANCE))
    standard = rest / sd
    along = slope / sd
    leverage = along**2 / np.sum(along**2)
    left = 1.0 - np.minimum(leverage, 1.0 - 1e-9)
    if block.sd.prior is None:
        return standard / np.sqrt(left), np.inf

    worth = values_worth(block.sd)
    freedom = max(worth + len(rest) - 1.0 - fitted, 1.0)
    others = np.sum(standard**2) - standard**2 / left
    scale = (worth + np.maximum(others, 0.0)) / freedom
    return standard / np.sqrt(left * scale), freedom

"""How far the next step may go: to the limit in cycles, or just past that in depth."""

import numpy as np

from wearlab.arrays import Array
from wearlab.life.limits import Limits
from wearlab.life.step import Node, Step

AIM = 1.1
"""How far past the expected crossing of a depth limit the last step aims."""
TREND = 0.5
"""Share of the trend of the rate over the last step that is expected to go on: wear evens out."""
MOST_TREND = 1.5
"""Largest factor by which the trend of the rate moves the expected crossing."""


def longest_step(node: Node, limits: Limits, last: Step | None) -> float:
    """Return the cycles that the next step may take, infinite where nothing wears to a limit.

    Parameters
    ----------
    node : where the march is
    limits : where it ends
    last : the last step, whose trend is expected to go on; None: no step was made
    """
    left = np.inf if limits.cycles is None else limits.cycles - node.cycle
    if limits.depth is None:
        return float(left)
    rate, missing = node.rate[limits.flank], limits.depth - node.depth[limits.flank]
    if limits.cycles is None and not node.rate.any():
        return np.inf
    due = np.divide(missing, rate, out=np.full_like(missing, np.inf), where=rate > 0.0)
    soonest = float(due.min(initial=np.inf))
    if not np.isfinite(soonest):
        return float(left)
    braked = float((due if last is None else due * _braking(due, last, limits)).min())
    return float(min(left, AIM * np.clip(braked, soonest / MOST_TREND, soonest * MOST_TREND)))


def _braking(due: Array, last: Step, limits: Limits) -> Array:
    """Return by what the trend of the last step moves the cycles due at the present rate, (n_flank,) [1].

    ``g + q g²/2 = 1`` with q the change of the rate over those cycles, relative to the rate.
    """
    trend = (last.end.rate - last.start.rate)[limits.flank] / last.size
    wears = np.isfinite(due)
    q = np.zeros_like(due)
    q[wears] = TREND * trend[wears] * due[wears] / last.end.rate[limits.flank][wears]
    return np.asarray(2.0 / (1.0 + np.sqrt(np.maximum(0.0, 1.0 + 2.0 * q))))

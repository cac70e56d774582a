"""The marks of a step beyond the stability limit: wear that alternates from node to node or step to step.

Beyond ΔN ρ = 2 an explicit step overshoots the balance of load between teeth and back. Where neighbouring
nodes relax at different speeds, or the body couples them, the profile becomes a saw; where they relax alike,
the whole flank swings from step to step. Either mark is enough.
"""

import numpy as np

from wearlab.arrays import Array

WORST_ZIGZAG = 0.2
"""Share of node-to-node alternation in the wear of one step that counts as a saw (a single jump has 0.03)."""
UNDAMPED = 0.95
"""Ratio of successive alternating changes of rate from which the swing does not die out."""
SMALLEST_SWING = 0.02
"""Change of rate, relative to the rate, below which a swing is noise."""


def zigzag(profile: Array) -> float:
    """Return the node-to-node alternation of a profile: 0 smooth, 2 for a pure ±1 saw [1].

    With ``d_i = h_i − (h_{i−1} + h_{i+1})/2``: ``√(Σ max(0, −d_i d_{i+1}) / Σ h²)``.
    """
    square = float(profile @ profile)
    if square == 0.0 or profile.size < 4:
        return 0.0
    d = profile[1:-1] - 0.5 * (profile[:-2] + profile[2:])
    return float(np.sqrt(np.maximum(0.0, -d[1:] * d[:-1]).sum() / square))


def saws(before: Array, now: Array) -> bool:
    """Whether ``now`` alternates from node to node, more than twice as much as ``before``."""
    return zigzag(now) > max(WORST_ZIGZAG, 2.0 * zigzag(before))


def grows_saw(first: Array, second: Array, third: Array) -> bool:
    """Whether the node-to-node alternation of three successive rates rises twice and has become a saw."""
    rising = zigzag(first) < zigzag(second) < zigzag(third)
    return rising and zigzag(third) > WORST_ZIGZAG


def swings(first: Array, second: Array, third: Array) -> bool:
    """Whether three successive rates alternate without dying out."""
    a, b = second - first, third - second
    before, now = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if now < SMALLEST_SWING * float(np.linalg.norm(third)) or before == 0.0:
        return False
    return float(a @ b) < -0.5 * before * now and now > UNDAMPED * before

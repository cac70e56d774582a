"""A jump of the response to another branch: the wear rate is discontinuous, and steps restart after it."""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life.counted import CountedRate
from wearlab.life.step import Node, Step, growth

CONTINUOUS = 0.2
"""Distance of a rate from both sides, over theirs from each other, that belongs to neither side."""
REMAINING = 0.7
"""Share of the change of rate that a jump still has when it is located."""
MOST_DOUBLINGS = 7
"""Doublings of the way, from what an error is worth in cycles, on which a shifted jump is looked for."""


class Jump(NamedTuple):
    """A discontinuity of the wear rate along the life.

    Parameters
    ----------
    cycle : where it lies [1]
    width : cycles within which it was located [1]
    before, after : (n,) wear rate on either side [m per cycle]
    """

    cycle: float
    width: float
    before: Array
    after: Array


def crosses_jump(steps: list[float], changes: list[float]) -> bool:
    """Whether the change of rate does not shrink with the step, over the tries from one state.

    Parameters
    ----------
    steps, changes : step size and |r(end) − r(start)| of successive tries, all but the last one rejected
    """
    return len(steps) > 1 and steps[-1] <= 0.65 * steps[0] and changes[-1] > 0.7 * changes[0] > 0.0


def locate(
    rate: CountedRate, node: Node, size: float, far: Array, memory: Any, width: float
) -> tuple[Step, Step, Jump] | None:
    """Return the step up to a jump, the step across it, and the jump; None when there is none after all.

    Bisection along the trapezoid ``h + x (r + r(x))/2`` of the near side: each try starts from the last state
    there and belongs to the side whose rate is nearer. A rate between the sides' betrays a steep but
    continuous change. An orbit that is looked for from afar may be found on another branch long before its
    own one ends: where a short step from the near side does not jump, the jump lies further on.

    Parameters
    ----------
    rate : the wear rate
    node : the start
    size : step that crosses the jump [1]
    far : (n,) rate beyond the jump
    memory : of the rate at the start
    width : cycles within which to locate it
    """
    low, high, near, whole = 0.0, size, node.rate, float(np.linalg.norm(far - node.rate))
    seen_from = 0.0
    while high - low > width or seen_from < low:
        # A far side that was seen from further back is looked for again, from where the near side is now.
        again = high - low <= width
        x = high if again else 0.5 * (low + high)
        rate.recall(memory)
        tried = rate(_along(node, low, near, x))
        to_near, to_far = float(np.linalg.norm(tried - near)), float(np.linalg.norm(tried - far))
        if min(to_near, to_far) > CONTINUOUS * np.linalg.norm(far - near):
            return None
        if to_near <= to_far:
            if x >= size:
                return None
            high = min(size, x + 2.0 * (x - seen_from)) if again else high
            low, near, memory = x, tried, rate.remember()
        else:
            high, far, seen_from = x, tried, low
    depth = _along(node, low, near, low)
    rate.recall(memory)
    near = rate(depth)  # along a steep way the last look there was at another depth
    if np.linalg.norm(far - near) < REMAINING * whole:
        return None
    before = Node(node.cycle + low, depth, near)
    after = _landed(rate, before, high - low, far, memory)
    if after is None:
        return None
    change = 0.5 * low * (near - node.rate)
    up = Step(node, before, (node.rate, near), change, growth(node, before))
    gap = after.cycle - before.cycle
    secant = (after.depth - before.depth) / gap
    across = Step(before, after, (secant, secant), gap * (after.rate - near), 1.0)
    return up, across, Jump(after.cycle, gap, near, after.rate)


def _along(node: Node, low: float, near: Array, x: float) -> Array:
    """Depth x cycles on, with the rate changing as it did up to ``low``, where it is ``near``."""
    trend = (near - node.rate) / low if low > 0.0 else 0.0
    return np.asarray(np.maximum(node.depth, node.depth + x * node.rate + 0.5 * x * x * trend))


def _landed(rate: CountedRate, before: Node, gap: float, far: Array, memory: Any) -> Node | None:
    """Return the first state beyond the jump, None where none is; the gap doubles until it is."""
    steepest = np.maximum(before.rate, far)
    for _ in range(10):
        rate.recall(memory)
        depth = before.depth + gap * steepest
        landed = rate(depth)
        if np.linalg.norm(landed - far) <= np.linalg.norm(landed - before.rate):
            return Node(before.cycle + gap, depth, landed)
        gap *= 2.0
    return None


def shift_by(rate: CountedRate, across: Step, error: Array, memory: Any) -> float:
    """Return by how many cycles a jump moves when the depth before it is off by ±``error`` [1].

    The jump is a surface in the space of depths, and how steeply a life meets it no rate tells. So it is
    looked for beside the life, where depths are off by so much, at twice the distance each time: back where
    the rate has jumped already, ahead where it has not. What is returned is at most twice too large.

    Parameters
    ----------
    rate : the wear rate
    across : the step across the jump, from a state on its near side
    error : (n,) estimated error of the depth there [m]
    memory : of the rate on the near side
    """
    before, far = across.start, across.end.rate
    fastest = float(np.abs(before.rate).max(initial=0.0))
    if fastest == 0.0 or not error.any():
        return 0.0
    unit = float(np.abs(error).max()) / fastest
    farthest = 0.0
    for sign in (1.0, -1.0):
        beside = before.depth + sign * error
        has_jumped = _is_beyond(rate, beside, before.rate, far, memory)
        x, way = 0.0, -1.0 if has_jumped else 1.0
        for doubling in range(MOST_DOUBLINGS):
            x = way * unit * 2.0**doubling
            if _is_beyond(rate, beside + x * before.rate, before.rate, far, memory) != has_jumped:
                break
        farthest = max(farthest, abs(x))
    return farthest


def _is_beyond(rate: CountedRate, depth: Array, near: Array, far: Array, memory: Any) -> bool:
    """Whether the rate at a depth is nearer to that beyond a jump."""
    rate.recall(memory)
    there = rate(np.maximum(depth, 0.0))
    return bool(np.linalg.norm(there - far) < np.linalg.norm(there - near))

"""A jump of the response to another branch: the wear rate is discontinuous, and steps restart after it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.life.counted import CountedRate
from wearlab.life.step import Node, Step, growth

Array = NDArray[np.float64]


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
    """Whether the change of rate does not shrink with the step: over the last three tries from one state.

    Parameters
    ----------
    steps, changes : step size and |r(end) − r(start)| of successive rejected tries
    """
    if len(steps) < 3:
        return False
    return steps[-1] < 0.5 * steps[-3] and changes[-1] > 0.7 * changes[-3] > 0.0


def locate(
    rate: CountedRate, node: Node, size: float, far: Array, memory: Any, width: float
) -> tuple[Step, Step, Jump] | None:
    """Return the step up to a jump, the step across it, and the jump; None when there is none after all.

    Bisection along ``h + x ΔN r``: each try starts from the memory at the start and belongs to the side whose
    rate is nearer. The step up to the jump is a trapezoid with the rate just before it (second order).

    Parameters
    ----------
    rate : the wear rate
    node : the start
    size : step that crosses the jump [1]
    far : (n,) rate beyond the jump
    memory : of the rate at the start
    width : cycles within which to locate it
    """
    low, high, near = 0.0, size, node.rate
    while high - low > width:
        middle = 0.5 * (low + high)
        rate.recall(memory)
        tried = rate(node.depth + middle * node.rate)
        if np.linalg.norm(tried - near) <= np.linalg.norm(tried - far):
            low, near = middle, tried
        else:
            high, far = middle, tried
    whole = float(np.linalg.norm(far - node.rate))
    if np.linalg.norm(far - near) < 0.5 * whole:
        return None
    return _pieces(rate, node, low, high, near, far)


def _pieces(
    rate: CountedRate, node: Node, low: float, high: float, near: Array, far: Array
) -> tuple[Step, Step, Jump]:
    mean = 0.5 * (node.rate + near)
    before = Node(node.cycle + low, node.depth + low * mean, near)
    landed = before.depth + (high - low) * np.maximum(near, far)
    after = Node(node.cycle + high, landed, rate(landed))
    up = Step(node, before, (node.rate, near), 0.5 * low * (near - node.rate), 1.0)
    secant = (landed - before.depth) / (high - low)
    across = Step(before, after, (secant, secant), (high - low) * (far - near), 1.0)
    return up._replace(growth=growth(node, before)), across, Jump(after.cycle, high - low, near, after.rate)

"""An accepted step taken once more, with another rate or from another depth."""

from collections.abc import Callable

import numpy as np

from wearlab.arrays import Array
from wearlab.life import embedded, rkc
from wearlab.life.step import EULER, Node, Step

Rate = Callable[[Array], Array]


def again(step: Step, rate: Rate, start: Node) -> Step:
    """Return a step of the same method and size from another state.

    Parameters
    ----------
    step : an accepted step
    rate : r(h) [m per cycle]
    start : the other state, at the same cycle

    Raises
    ------
    ValueError
        When the step located a jump of the rate, or held part of one that wavers: no method took it.
    """
    if step.by is None:
        raise ValueError("the wear rate jumps or wavers in this step: it cannot be taken again")
    if step.by == EULER:
        depth = start.depth + step.size * start.rate
        rate_at_end, slopes = rate(depth), (start.rate, start.rate)
        end = Node(step.end.cycle, depth, rate_at_end)
    elif isinstance(step.by, rkc.Scheme):
        depth = rkc.step(rate, start.depth, start.rate, step.size, step.by)
        end = Node(step.end.cycle, depth, rate(depth))
        slopes = (start.rate, end.rate)
    else:
        begun = embedded.begin(rate, start.depth, start.rate, step.size)
        depth, rate_at_end, *_ = embedded.complete(rate, start.depth, start.rate, step.size, begun)
        end = Node(step.end.cycle, depth, rate_at_end)
        slopes = (start.rate, rate_at_end)
    return Step(start, end, slopes, np.zeros_like(depth), 1.0, step.by)

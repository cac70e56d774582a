"""The error of a life that a depth ends: what depends on the one flank that reaches it."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.life.limits import Flanks

DEEPEST = 0.95
"""Share of the largest depth from which a node counts as one that may end the life."""
BETWEEN = 1.5
"""Weight of what the nodes miss of the deepest place: a parabola is right but for the third difference."""

LATE = 0.9
"""Share of the last depth since which a late rate is the mean."""


class End(NamedTuple):
    """The last state of a life, on the flanks whose depth may end it.

    Parameters
    ----------
    rate : wear rate where they are worn deepest [m per cycle]
    between : by how much a flank may be worn deeper between its nodes [m]
    flanks : (k,) numbers of the flanks that are as deep
    nodes : (m,) entries on these flanks where they are
    """

    rate: float
    between: float
    flanks: Index
    nodes: Index


def end_of(depth: Array, rate: Array, flank: Index, counts: Flanks) -> End:
    """Return the end of a life.

    Parameters
    ----------
    depth, rate : (n,) at the nodes of all flanks, flat [m], [m per cycle]
    flank : (n,) which flank each node is on
    counts : entries of the flanks whose depth the limit is about
    """
    numbers = np.unique(flank[counts])
    largest = np.array([depth[flank == number].max() for number in numbers])
    deep = numbers[largest >= DEEPEST * largest.max()]
    at = int(np.argmax(np.where(np.isin(flank, numbers), depth, -np.inf)))
    between = BETWEEN * max(above_nodes(depth[flank == number]) for number in deep)
    nodes = np.flatnonzero(np.isin(flank, deep) & (depth >= DEEPEST * largest.max()))
    return End(float(rate[at]), between, deep, nodes)


def late_rate(cycle: Array, depth: Array) -> Array:
    """Return the mean wear rate since the deepest place had nine tenths of its depth, (n,) [m per cycle].

    One rate of a motion that does not repeat says little of what an error is worth in cycles.

    Parameters
    ----------
    cycle, depth : (m,), (m, n) of the accepted states [1], [m]
    """
    deepest = depth.max(axis=1)
    since = max(0, int(np.searchsorted(deepest, LATE * deepest[-1])) - 1)
    way = cycle[-1] - cycle[since]
    return np.asarray((depth[-1] - depth[since]) / way if way > 0.0 else np.zeros_like(depth[-1]))


def above_nodes(depth: Array) -> float:
    """Return by how much a profile rises above its highest node [m].

    ``y(t) = y₀ + b t + c t²`` has its vertex ``−b²/4c`` higher, if it has one within an interval. Through
    that node and the next two on one side, because a node may be a corner; next to an end its neighbours.

    Parameters
    ----------
    depth : (n,) at evenly spaced nodes [m]
    """
    top = int(np.argmax(depth))
    after, before = depth[top : top + 3], depth[max(0, top - 2) : top + 1][::-1]
    rises = [_vertex(*_parabola(*side)) for side in (after, before) if len(side) == 3]
    if 2 in (len(after), len(before)):
        left, middle, right = depth[top - 1 : top + 2]
        rises.append(_vertex(0.5 * abs(right - left), 0.5 * (left + right) - middle))
    return max(rises)


def _parabola(first: float, second: float, third: float) -> tuple[float, float]:
    return (4.0 * second - 3.0 * first - third) / 2.0, (first + third - 2.0 * second) / 2.0


def _vertex(b: float, c: float) -> float:
    return float(-b * b / (4.0 * c)) if 0.0 < b < -2.0 * c else 0.0

"""Largest and smallest mesh force, and the time apart, of a response: from its steps, not from samples.

A force that pairs enter and leave is largest at a jump as often as not. Jumps of every mesh, lagging ones
too, lie between two steps, and both sides of each are among what is looked at. Within a step the force is
smooth; the few steps that come nearest to an extreme are looked into closely.
"""

from collections.abc import Iterator
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.response import Response
from wearlab.dynamics.within import forces_within

FRACTIONS = np.linspace(0.0, 1.0, 9)
"""Where within each step is looked first."""
CLOSELY = np.linspace(0.0, 1.0, 129)
"""Where within the steps that come nearest to an extreme."""
NEAREST = 6
"""Steps of every mesh, of all periods, that are looked into closely for its largest and smallest force."""
AT_ONCE = 2_000_000
"""Values of a force that are held at once."""


class Extremes(NamedTuple):
    """What is read off the mesh forces of a response, (n_mesh,) each.

    Parameters
    ----------
    least, largest : elastic mesh force [N]
    separated : fraction of time in which no drive flank touches [1]
    """

    least: Array
    largest: Array
    separated: Array


_read: WeakKeyDictionary[Response, Extremes] = WeakKeyDictionary()
"""What was read off responses that still are: estimates, doubts and the dataset ask for the same."""


def extremes(response: Response) -> Extremes:
    """Return the extreme forces of every mesh over the period, or over the kept periods, of a response."""
    if response not in _read:
        _read[response] = _over_periods(response)
    return _read[response]


def _over_periods(response: Response) -> Extremes:
    meshes, steps = len(response.system.direction), len(response.tables.width)
    block = max(1, AT_ONCE // (len(FRACTIONS) * steps * meshes))
    kept = len(response.state)
    found = [_of_periods(response, slice(at, min(at + block, kept))) for at in range(0, kept, block)]
    share = np.array([min(block, kept - at) / kept for at in range(0, kept, block)])
    return Extremes(
        np.min([one.least for one in found], axis=0),
        np.max([one.largest for one in found], axis=0),
        share @ np.array([one.separated for one in found]),
    )


def _of_periods(response: Response, kept: slice) -> Extremes:
    forces, width = forces_within(response, FRACTIONS, kept), response.tables.width
    low, high = forces.elastic.min(axis=1), forces.elastic.max(axis=1)
    closely = [
        forces_within(response, CLOSELY, slice(kept.start + turn, kept.start + turn + 1), steps).elastic
        for turn, steps in _nearest(low, high)
    ]
    apart = _positive_share(forces.clearance).mean(axis=0)
    return Extremes(
        np.min([low.min(axis=(0, 1)), *(one.min(axis=(0, 1, 2)) for one in closely)], axis=0),
        np.max([high.max(axis=(0, 1)), *(one.max(axis=(0, 1, 2)) for one in closely)], axis=0),
        width @ apart / width.sum(),
    )


def _nearest(low: Array, high: Array) -> Iterator[tuple[int, Index]]:
    """Yield periods and the steps in them that come nearest to an extreme of any mesh.

    Parameters
    ----------
    low, high : (n_periods, n_steps, n_mesh) least and largest force seen in each step [N]
    """
    steps, meshes = low.shape[1:]
    nearest = min(NEAREST, low.shape[0] * steps)
    one_after_another = np.stack([low, -high]).reshape(2, -1, meshes)
    near = np.argpartition(one_after_another, nearest - 1, axis=1)[:, :nearest]
    turn, step = np.divmod(np.unique(near), steps)
    for own in np.unique(turn):
        yield int(own), step[turn == own]


def _positive_share(values: Array) -> Array:
    """Return the share of each step in which a signal is positive, straight between its values."""
    low, high = values[:, :-1], values[:, 1:]
    lesser, larger = np.minimum(low, high), np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = larger / (larger - lesser)
    share = np.where(lesser >= 0.0, 1.0, np.where(larger <= 0.0, 0.0, crossed))
    return np.asarray(share.mean(axis=1))

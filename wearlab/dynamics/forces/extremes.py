"""Largest and smallest mesh force, and the time apart, of a response: from its steps, not from samples.

A force that pairs enter and leave is largest at a jump as often as not. Jumps of every mesh, lagging ones
too, lie between two steps, and both sides of each are among what is looked at. Within a step the force is
smooth; the few steps that come nearest to an extreme are looked into closely about where they do.
"""

from collections.abc import Iterator
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.orbits.response import Response, forces_at
from wearlab.mesh.force import NormalForces

FRACTIONS = np.linspace(0.0, 1.0, 9)
"""Where within each step is looked first."""
CLOSELY = np.linspace(-FRACTIONS[1], FRACTIONS[1], 33)
"""Where about the look that comes nearest to an extreme in a step."""
NEAREST = 6
"""Steps of every mesh, of all periods, that are looked into closely for its largest and smallest force."""
AT_ONCE = 200_000
"""Values of a force that are held at once."""


class Extremes(NamedTuple):
    """What is read off the mesh forces of a response, (n_mesh,) each.

    Parameters
    ----------
    least, largest : elastic mesh force [N]
    largest_normal : largest normal mesh force [N]
    separated : fraction of time in which no drive flank pushes [1]
    """

    least: Array
    largest: Array
    largest_normal: Array
    separated: Array


_read: WeakKeyDictionary[Response, Extremes] = WeakKeyDictionary()
"""What was read off responses that still are: estimates, doubts and the dataset ask for the same."""


def extremes(response: Response) -> Extremes:
    """Return the extreme forces of every mesh over the period, or over the kept periods, of a response."""
    if response in _read:
        return _read[response]
    meshes, steps = len(response.system.direction), len(response.tables.width)
    block = max(1, AT_ONCE // (len(FRACTIONS) * steps * meshes))
    kept = len(response.state)
    blocks = [_of_periods(response, slice(at, min(at + block, kept))) for at in range(0, kept, block)]
    share = [min(block, kept - at) / kept for at in range(0, kept, block)]
    least, largest, normal, separated = (np.array(values) for values in zip(*blocks, strict=True))
    whole = Extremes(least.min(axis=0), largest.max(axis=0), normal.max(axis=0), share @ separated)
    return _read.setdefault(response, whole)


def _of_periods(response: Response, kept: slice) -> Extremes:
    forces, width, ends = forces_within(response, FRACTIONS, kept), response.tables.width, []
    for name in ("elastic", "normal"):
        signal = getattr(forces, name)
        looks = [signal]
        for turn, step, fraction in nearest(signal):
            own = slice(kept.start + turn, kept.start + turn + 1)
            looks.append(getattr(forces_at(response, step, fraction, own), name))
        every = np.concatenate([look.reshape(-1, signal.shape[-1]) for look in looks])
        ends.append((every.min(axis=0), every.max(axis=0)))
    return Extremes(*ends[0], ends[1][1], width @ _positive_share(-forces.reserve).mean(axis=0) / width.sum())


def forces_within(response: Response, x: Array, kept: slice = slice(None)) -> NormalForces:
    """Return the forces of all meshes at fractions x (n_fractions,) of every step, (…, n_steps, …)."""
    steps = len(response.tables.width)
    forces = forces_at(response, np.tile(np.arange(steps), len(x)), np.repeat(x, steps), kept)
    return NormalForces(*(f.reshape(len(f), len(x), steps, *f.shape[2:]) for f in forces))


def nearest(elastic: Array) -> Iterator[tuple[int, Index, Array]]:
    """Yield periods, and steps and fractions in them about where an extreme of any mesh comes nearest.

    Parameters
    ----------
    elastic : (n_periods, n_fractions, n_steps, n_mesh) forces [N]
    """
    periods, _, steps, meshes = elastic.shape
    nearest = min(NEAREST, periods * steps)
    places = []
    for signed in (elastic, -elastic):
        look = signed.argmin(axis=1).reshape(-1, meshes)
        near = np.argpartition(signed.min(axis=1).reshape(-1, meshes), nearest - 1, axis=0)[:nearest]
        places.append(near * len(FRACTIONS) + np.take_along_axis(look, near, axis=0))
    turn, place = np.divmod(np.unique(places), steps * len(FRACTIONS))
    for own in np.unique(turn):
        step, look = np.divmod(place[turn == own], len(FRACTIONS))
        about = np.clip(FRACTIONS[look, None] + CLOSELY, 0.0, 1.0)
        yield int(own), np.repeat(step, len(CLOSELY)), about.ravel()


def _positive_share(values: Array) -> Array:
    """Return the share of each step in which a signal is positive, straight between its values."""
    low, high = values[:, :-1], values[:, 1:]
    lesser, larger = np.minimum(low, high), np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = larger / (larger - lesser)
    return np.asarray(np.where(lesser >= 0.0, 1.0, np.where(larger <= 0.0, 0.0, crossed)).mean(axis=1))

"""Largest and smallest mesh forces of a moved scene: looked at where those of the scene itself are."""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.forces.extremes import FRACTIONS, extremes, forces_within, nearest
from wearlab.dynamics.orbits.response import Response, forces_at


class Places(NamedTuple):
    """Where the least and the largest force of every mesh are, (2, n_mesh) each.

    Parameters
    ----------
    turn : period
    step, fraction : within it, [1] of the step
    """

    turn: Index
    step: Index
    fraction: Array


_read: WeakKeyDictionary[Response, Places] = WeakKeyDictionary()
"""Those of responses that still are: every number asks for those of the scene itself."""


def extreme_forces(response: Response, near: Response) -> Array:
    """Return the least and the largest elastic force of every mesh, (2, n_mesh) [N].

    Parameters
    ----------
    response : of a moved scene
    near : of the scene itself, in whose steps they lie; where contact changes more or less often than there
        they are looked for anew
    """
    if len(response.tables.width) != len(near.tables.width):
        whole = extremes(response)
        return np.stack([whole.least, whole.largest])
    if near not in _read:
        _read[near] = places_of_extremes(near)
    places, forces = _read[near], np.empty((2, len(response.system.direction)))
    for turn in np.unique(places.turn):
        which, mesh = np.nonzero(places.turn == turn)
        step, fraction = places.step[which, mesh], places.fraction[which, mesh]
        elastic = forces_at(response, step, fraction, slice(turn, turn + 1)).elastic[0]
        forces[which, mesh] = elastic[np.arange(len(mesh)), mesh]
    return forces


def places_of_extremes(response: Response) -> Places:
    """Return where `extremes` of a response are met."""
    forces = forces_within(response, FRACTIONS).elastic
    turn, look, step = np.indices(forces.shape[:3]).reshape(3, -1)
    looks = [(turn, step, FRACTIONS[look], forces.reshape(len(turn), -1))]
    for own, steps, fractions in nearest(forces):
        closely = forces_at(response, steps, fractions, slice(own, own + 1)).elastic[0]
        looks.append((np.full(len(steps), own), steps, fractions, closely))
    turns, steps, fractions, elastic = (np.concatenate(part) for part in zip(*looks, strict=True))
    place = np.stack([elastic.argmin(axis=0), elastic.argmax(axis=0)])
    return Places(turns[place], steps[place], fractions[place])

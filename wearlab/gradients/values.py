"""What can be differentiated: read off the first and the last state of a life."""

from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.forces.extremes import FRACTIONS, extremes, forces_within, nearest
from wearlab.dynamics.orbits.response import Response, forces_at
from wearlab.gradients.lived import Ends, LivedSteps
from wearlab.gradients.numbers import GradientError
from wearlab.life.coupled import WearState
from wearlab.scene.build import Parts
from wearlab.simulation.static import by_flank
from wearlab.simulation.vibration import phase_forces

Reading = Callable[[Parts, WearState, WearState], Array]


class Value(NamedTuple):
    """Something a run says.

    Parameters
    ----------
    dims : its dimensions in each state
    unit : SI
    read : from a state, and that of the scene itself beside it; None: of the life as a whole
    moves : whether it needs dynamics
    wears : whether it needs a wear law
    """

    dims: tuple[str, ...]
    unit: str
    read: Reading | None
    moves: bool = False
    wears: bool = False


def _extremes(state: WearState, near: WearState) -> Array:
    assert state.response is not None and near.response is not None
    return extreme_forces(state.response, near.response)


def _static(parts: Parts) -> Array:
    return np.array([parts.kinds[mesh.kind].analysis.load for mesh in parts.meshes])


def _dynamic_factor(parts: Parts, state: WearState, near: WearState) -> Array:
    return np.asarray(_extremes(state, near)[1] / _static(parts))


def _force(parts: Parts, state: WearState, near: WearState) -> Array:
    assert state.response is not None
    return phase_forces(parts, state, state.response).transpose(1, 0, 2)


def _deflection(parts: Parts, state: WearState, near: WearState) -> Array:
    assert parts.vibration is not None and state.response is not None
    motions = parts.vibration.motions(state.response, parts.vibration.look(parts.phase))
    return motions.deflection.transpose(1, 0, 2)


def _depth(parts: Parts, state: WearState, near: WearState) -> Array:
    return by_flank(parts, list(state.wear))


def _rate(parts: Parts, state: WearState, near: WearState) -> Array:
    return by_flank(parts, list(state.rate))


PHASES = ("mesh", "mesh_period", "phase")
NODES = ("flank", "profile")
VALUES = {
    "life": Value((), "1", None, wears=True),
    "dynamic_factor": Value(("mesh",), "1", _dynamic_factor, moves=True),
    "mesh_force_max": Value(("mesh",), "N", lambda p, s, n: _extremes(s, n)[1], moves=True),
    "mesh_force_min": Value(("mesh",), "N", lambda p, s, n: _extremes(s, n)[0], moves=True),
    "dynamic_mesh_force": Value(PHASES, "N", _force, moves=True),
    "mesh_deflection": Value(PHASES, "m", _deflection, moves=True),
    "wear_depth": Value(NODES, "m", _depth, wears=True),
    "wear_rate": Value(NODES, "m", _rate, wears=True),
    "max_wear_rate": Value(("flank",), "m", lambda p, s, n: np.nanmax(_rate(p, s, n), axis=-1), wears=True),
    "max_wear_depth": Value(("flank",), "m", lambda p, s, n: np.nanmax(_depth(p, s, n), axis=-1), wears=True),
}


def wanted(names: tuple[str, ...], lived: LivedSteps) -> dict[str, Value]:
    """Return the values of some names that a life has.

    Raises
    ------
    GradientError
        For a name that is not known, or nothing the scene has.
    """
    for name in names:
        if name not in VALUES:
            raise GradientError(f"of: {name!r} has no derivative here; there are {', '.join(VALUES)}")
        value, state = VALUES[name], lived.ends.states[0]
        if value.moves and not state.responses:
            raise GradientError(f"of: {name} needs [dynamics]")
        if value.moves and len(state.responses) > 1:
            raise GradientError(f"of: {name} has a value at every error angle; freeze the slow errors")
        if value.wears and not state.wears:
            raise GradientError(f"of: {name} needs a wear law")
        if name == "life" and not lived.reached:
            raise GradientError("of: life needs wear.until.depth, and a life that reaches it")
    return {name: VALUES[name] for name in names}


def read(value: Value, lived: LivedSteps, ends: Ends) -> Array:
    """Return a value in every state, (n_states, …), of the ends of a life; the life itself is one number."""
    if value.read is None:
        return np.asarray(lived.life_of(ends))
    beside = zip(ends.states, lived.ends.states, strict=True)
    return np.stack([value.read(ends.parts, state, near) for state, near in beside])


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

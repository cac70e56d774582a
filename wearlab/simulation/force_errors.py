"""Errors of mesh and bearing forces: what half the steps and nodes, and errors of the wear, change of them.

A rougher twin shows the one; the twin worn by as much more as the depth may be off shows the other. Both are
taken at every instant, and a largest force can be off by no more than the error where it may lie, or by what
reading it off the steps of the twin changes of it.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces import extremes, mesh_forces
from wearlab.dynamics.orbits.response import Response
from wearlab.life.coupled import WearState
from wearlab.mesh import excitation, force
from wearlab.mesh.clock import Instants, look_within
from wearlab.scene.build import Parts
from wearlab.simulation.vibration import bearing_values, has_bearings

FORCE_SHARE = 2.0
"""Weight of the change by half the steps and nodes, set on seed 1 of `tests/validation/estimates.py`."""
INSTANT_SHARE = 1.75
"""Weight of the largest error at any instant, set on seed 129943 of `tests/validation/estimates.py`."""
LARGEST_SHARE = 0.4
"""Weight of the error where the largest force may lie: errors are largest beside jumps, not there."""
NEAR = 0.2
"""How far below the largest, over the range of a force, counts as near it at least."""
NODES = 3
"""Instants within a step: its ends and its middle."""


class ForceErrors(NamedTuple):
    """Estimated errors of the forces of one state [N].

    Parameters
    ----------
    mesh : of the elastic mesh force at any instant, the largest over the meshes
    largest : of the largest mesh force, the largest over the meshes
    bearing : of the force of a bearing along one axis, the largest of all; NaN without bearings
    """

    mesh: float
    largest: float
    bearing: float


class ForcesAtInstants(NamedTuple):
    """Forces of a response at the same instants of every mesh period, both sides of every jump.

    Parameters
    ----------
    mesh : (n_periods, n_mesh, n_instants) [N]
    bearing : (n_periods, n_members · n_axes, n_instants) [N]
    """

    mesh: Array
    bearing: Array


def force_errors(
    parts: Parts, rough: Parts, states: tuple[WearState, WearState, WearState], weight: float
) -> ForceErrors:
    """Return the errors of the forces of a state, the largest over its responses.

    Parameters
    ----------
    parts, rough : the physics, and that of half the steps and nodes
    states : the state, its rougher twin, and that worn by as much further as the depth may be off
    weight : of the change by the rougher twin [1]
    """
    errors = [
        _of_responses(parts, rough, states, at, FORCE_SHARE * weight)
        for at in range(len(states[0].responses))
    ]
    return ForceErrors(*np.max(errors, axis=0))


def _of_responses(
    parts: Parts, rough: Parts, states: tuple[WearState, WearState, WearState], at: int, weight: float
) -> ForceErrors:
    assert parts.vibration is not None
    phase, segment, _ = mesh_forces.within_steps(parts.vibration.sampling.grid, NODES)
    when = Instants(phase, segment)
    own, twin, worse = (
        forces_of(physics, state, state.responses[at], when)
        for physics, state in zip((parts, rough, rough), states, strict=True)
    )
    turns = (
        range(len(own.mesh)) if parts.vibration.hunting == 1 else (0,)
    )  # hunting teeth say where it begins
    turn = min(turns, key=lambda turn: float(np.abs(_turned(twin.mesh, turn) - own.mesh).max()))
    by_steps, by_wear = (
        ForcesAtInstants(
            *(np.abs(_turned(first - second, turn)) for first, second in zip(*pair, strict=True))
        )
        for pair in ((twin, ForcesAtInstants(*(_turned(force, -turn) for force in own))), (worse, twin))
    )
    both = ForcesAtInstants(*(weight * steps + wear for steps, wear in zip(by_steps, by_wear, strict=True)))
    errors = _largest(own, both)
    read = (
        extremes.extremes(states[0].responses[at]).largest
        - extremes.extremes(states[1].responses[at]).largest
    )
    return errors._replace(largest=max(errors.largest, weight * float(np.abs(read).max())))


def _largest(own: ForcesAtInstants, error: ForcesAtInstants) -> ForceErrors:
    at_largest = max(
        error_of_largest(own.mesh[:, mesh].ravel(), error.mesh[:, mesh].ravel())
        for mesh in range(own.mesh.shape[1])
    )
    bearing = float(error.bearing.max()) if error.bearing.size else np.nan
    return ForceErrors(INSTANT_SHARE * float(error.mesh.max()), at_largest, INSTANT_SHARE * bearing)


def _turned(values: Array, turn: int) -> Array:
    return np.roll(values, turn, axis=0)


def error_of_largest(values: Array, error: Array) -> float:
    """Return by how much the largest of values that are off by ``error`` may be off, both (n,).

    The true largest lies where ``f ≥ max f − 2 E``, E the largest error there: found by narrowing, though not
    below `NEAR`, for an error may be small at one instant by chance.
    """
    there, largest = np.ones(len(values), bool), float(error.max())
    below = values.max() - values
    while True:
        narrower = there & (below <= max(2.0 * largest, NEAR * float(below.max())))
        if narrower.sum() == there.sum():
            return LARGEST_SHARE * largest
        there, largest = narrower, float(error[narrower].max())


def forces_of(parts: Parts, state: WearState, response: Response, when: Instants) -> ForcesAtInstants:
    """Return mesh and bearing forces of a response at instants that lie in steps of equal length."""
    vibration = parts.vibration
    assert vibration is not None
    kinds = parts.coupling.flanks_of(state)
    motions = vibration.motions(response, when)
    mesh = np.stack(
        [_mesh_force(parts, kinds, mesh, when, motions) for mesh in range(len(parts.meshes))],
        axis=1,
    )
    if not has_bearings(parts):
        return ForcesAtInstants(mesh, np.empty((len(mesh), 0, len(when.phase))))
    position, velocity = vibration.coordinates(response, when)
    bearing = bearing_values(parts, position, velocity, np.moveaxis(mesh, 1, 0))
    return ForcesAtInstants(mesh, bearing.reshape(-1, *bearing.shape[2:]).transpose(1, 0, 2))


def _mesh_force(
    parts: Parts, kinds: list[excitation.MeshFlanks], mesh: int, when: Instants, motions: force.Deflections
) -> Array:
    """Return the elastic force of one mesh, (n_periods, n_instants) [N]."""
    own_mesh, vibration = parts.meshes[mesh], parts.vibration
    assert vibration is not None
    inside = when.phase.reshape(-1, NODES)
    where = look_within(kinds[own_mesh.kind].analysis.grid, [own_mesh.lag], inside, inside.mean(axis=1))
    motion = force.Deflections(*(values[:, mesh] for values in motions))
    flanks = kinds[own_mesh.kind]
    return mesh_forces.mesh_forces(vibration.system, mesh, flanks, where, motion, vibration.period).elastic

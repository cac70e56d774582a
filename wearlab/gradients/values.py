"""Results of a run that have derivatives."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.gradients.numbers import GradientError
from wearlab.gradients.replayed_life import LifeEnds, ReplayedLife
from wearlab.life.coupled import WearState
from wearlab.simulation.dataset.coordinates import by_flank
from wearlab.simulation.dataset.dynamics import phase_forces

MOTION = "[dynamics]"
WEAR = "a wear law"
PHASES = ("mesh", "mesh_period", "phase")
NODES = ("flank", "profile")

Reading = Callable[[assembly.GearModel, WearState], Array]


class Value(NamedTuple):
    """A result of a run.

    Parameters
    ----------
    dims : its dimensions in each state
    unit : SI
    read : from a state; None: of the life as a whole
    needs : what a scene has to have, `MOTION` or `WEAR`
    """

    dims: tuple[str, ...]
    unit: str
    read: Reading | None
    needs: str = MOTION


def _largest_force(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the largest force of every mesh [N]."""
    return extremes(state.responses[0]).largest


def _least_force(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the least force of every mesh [N]."""
    return extremes(state.responses[0]).least


def _dynamic_factor(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the largest over the static force of every mesh [1]."""
    loads = [parts.kinds[mesh.kind].analysis.load for mesh in parts.meshes]
    return np.asarray(_largest_force(parts, state) / np.array(loads))


def _force(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the forces at the stored phases, (mesh, mesh_period, phase) [N]."""
    return phase_forces(parts, state, state.responses[0]).transpose(1, 0, 2)


def _deflection(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the deflections at the stored phases, (mesh, mesh_period, phase) [m]."""
    places = parts.moving.look(parts.phase)
    motions = parts.moving.motions(state.responses[0], places)
    return motions.deflection.transpose(1, 0, 2)


def _depth(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the wear depth, (flank, profile) [m]."""
    return by_flank(parts, list(state.wear))


def _rate(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the wear rate, (flank, profile) [m per cycle]."""
    return by_flank(parts, list(state.rate))


def _largest_depth(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the largest wear depth of every flank [m]."""
    return np.asarray(np.nanmax(_depth(parts, state), axis=-1))


def _largest_rate(parts: assembly.GearModel, state: WearState) -> Array:
    """Return the largest wear rate of every flank [m per cycle]."""
    return np.asarray(np.nanmax(_rate(parts, state), axis=-1))


VALUES = {
    "life": Value((), "1", None, WEAR),
    "dynamic_factor": Value(("mesh",), "1", _dynamic_factor),
    "mesh_force_max": Value(("mesh",), "N", _largest_force),
    "mesh_force_min": Value(("mesh",), "N", _least_force),
    "dynamic_mesh_force": Value(PHASES, "N", _force),
    "mesh_deflection": Value(PHASES, "m", _deflection),
    "wear_depth": Value(NODES, "m", _depth, WEAR),
    "wear_rate": Value(NODES, "m", _rate, WEAR),
    "max_wear_rate": Value(("flank",), "m", _largest_rate, WEAR),
    "max_wear_depth": Value(("flank",), "m", _largest_depth, WEAR),
}


def values_of(names: tuple[str, ...], life: ReplayedLife) -> dict[str, Value]:
    """Return the values of some names that a life has.

    Parameters
    ----------
    names : among `VALUES`
    life : of the scene

    Raises
    ------
    GradientError
        For a name that is not known, or nothing the scene has.
    """
    for name in names:
        _check_value(name, life)
    return {name: VALUES[name] for name in names}


def _check_value(name: str, life: ReplayedLife) -> None:
    """Refuse a name that is not known, or nothing the scene has."""
    if name not in VALUES:
        raise GradientError(
            f"of: {name!r} has no derivative here; there are {', '.join(VALUES)}"
        )
    state = life.ends.states[0]
    needs = VALUES[name].needs
    if not (state.wears if needs == WEAR else state.responses):
        raise GradientError(f"of: {name} needs {needs}")
    if needs != WEAR and len(state.responses) > 1:
        raise GradientError(
            f"of: {name} has a value at every error angle; freeze the slow errors"
        )
    if name == "life" and not life.reached:
        raise GradientError(
            "of: life needs wear.until.depth, and a life that reaches it"
        )


def read(value: Value, life: ReplayedLife, ends: LifeEnds) -> Array:
    """Return a value in every state, (n_states, …); the life itself is one number.

    Parameters
    ----------
    value : what is read
    life : whose steps were taken
    ends : from which it is read
    """
    if value.read is None:
        return np.asarray(life.life_of(ends))
    return np.stack([value.read(ends.parts, state) for state in ends.states])

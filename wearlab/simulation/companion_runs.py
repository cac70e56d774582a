"""Rougher twins of wear states: evaluated again with half the steps and nodes.

Where these are so far off that their difference says little of the error, and for the
forces of sets, finer twins serve, of twice the steps and nodes: wear that loads depend
on steeply is not carried to every second node without loss.

Errors of mesh and bearing forces: what half the steps and nodes, and errors of the
wear, change of them.

A rougher twin shows the one; the twin worn by as much more as the depth may be off
shows the other. Both are taken at every instant, and a largest force can be off by no
more than the error where it may lie, or by what reading it off the steps of the twin
changes of it. A finer twin shows both at once: its rate tells by how much the wear is
off, with its sign, and worn by that it is the state as it would be on its own nodes,
whose extremes are compared wherever they lie. Beside steps of the force, errors at an
instant are as large as the step.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array, Index
from wearlab.dynamics.forces import mesh_forces
from wearlab.gears.specification import GearError
from wearlab.life import history, limits
from wearlab.life.coupled import Coupled, StartingPoint, Wear, WearState
from wearlab.life.vibration import Responses
from wearlab.mesh import clock, profile
from wearlab.simulation.dataset import bearings

COARSENED = 0.5
LESS_COARSENED = 0.75
"""Share of the nodes and steps that a twin keeps, and where those respond otherwise all
along."""
SCALED = (COARSENED**-2 - 1.0) / (LESS_COARSENED**-2 - 1.0)
"""What the change against the latter is worth as one against the former, at second
order."""
REFINED = 2.0
"""Steps and nodes of a finer twin over those of the state."""
OF_FINER = 1.0 / (1.0 - REFINED**-2)
"""What the change against a finer twin is worth: the error itself at second order,
without extrapolation."""


class Rougher(NamedTuple):
    """One state evaluated once more, with half the steps and half the nodes.

    Parameters
    ----------
    cycle : of the state [1]
    wear : (n_rough,) its wear depth at the rougher nodes of all flanks [m]
    rate : (n_rough,) change of the wear rate times what it is worth, None without a
        wear law [m]
    parts, state : the rougher physics and what the state is there
    weight : what its changes are worth as ones of half the steps and nodes [1]
    between : what its nodes alone do not tell of the wear between them, at most, times
        the weight, (n_flanks,) of the flanks of all kinds [m]
    shares, conditions : of the cycles [1], and the twins in all conditions of
        operation, of which this is one
    is_finer : whether it has more steps and nodes than the state
    """

    cycle: float
    wear: Array
    rate: Array | None
    parts: assembly.GearModel
    state: WearState
    weight: float = 1.0
    between: Array = np.zeros(1)
    shares: Array = np.ones(1)
    conditions: "tuple[Rougher, ...]" = ()
    is_finer: bool = False


Twins = list[Rougher | None]
"""Those of several states, None where one responds otherwise or not at all."""


def rough_parts(
    parts: assembly.GearModel, share: float = COARSENED
) -> assembly.GearModel | None:
    """Return the physics with a share of the steps and nodes, None if that cannot be.

    Parameters
    ----------
    parts : the physics of the scene
    share : of the steps of a mesh period and of the nodes of a profile [1]
    """
    changed: dict[str, int] = {
        "profile_points": max(9, int(share * assembly.mesh.profile_points(parts.scene)))
    }
    if parts.vibration is not None:
        changed["steps_per_period"] = max(
            4, int(share * len(parts.vibration.sampling.grid.width))
        )
    numerics = parts.scene.numerics.model_copy(update=changed)
    try:
        return assembly.build(parts.scene.with_sections(numerics=numerics))
    except GearError:
        return None


def carried(
    fine: profile.ProfileGrid, values: Array, rough: profile.ProfileGrid
) -> Array:
    """Return values at the nodes of a grid on those of another with the same breaks.

    Parameters
    ----------
    fine : the grid
    values : (k, n) at its nodes
    rough : the other grid

    Returns
    -------
    (k, n') at the nodes of the other
    """
    phases, _ = rough.phase_nodes
    segment = np.repeat(np.arange(len(rough.intervals)), rough.intervals + 1)
    where = profile.lookup(fine, phases, segment)
    pairs = rough.pairs_at_phase_nodes
    present = pairs >= 0
    depths = np.empty((len(values), len(rough.contact_position)))
    depths[:, pairs[present]] = profile.interpolate(
        fine, where, fine.beyond(values), 0.0
    )[:, present]
    return depths[:, rough.on_flank]


def alike(
    parts: assembly.GearModel,
    wear: Wear,
    start: StartingPoint,
    reference: WearState,
    *,
    rate_only: bool = False,
) -> WearState | None:
    """Return a wear state, None where it responds with other periods than another.

    Parameters
    ----------
    parts : the physics
    wear : of every kind of mesh [m]
    start : what a state near it leaves to start from
    reference : the other state
    rate_only : whether its wear rate is all that is asked: where the static force
        wears, it then responds to nothing
    """
    coupling: Coupled = parts.coupling_like(reference)
    if rate_only:
        coupling = coupling.rate_only()
    try:
        state = coupling.evaluate(wear, start)
    except (limits.StopWear, GearError):  # or its steps are too rough for any motion
        return None
    if not state.responses:
        return state
    periods = [
        [response.period for response in periods_of]
        for periods_of in (state.responses, reference.responses)
    ]
    return state if periods[0] == periods[1] else None


def _permanent_contact(responses: Responses) -> bool:
    """Whether one pass was exact: no flank parted."""
    return all(
        response.period == 1 and response.counts.newton_iterations == 1
        for response in responses
    )


def carried_wear(
    parts: assembly.GearModel, values: Wear, rough: assembly.GearModel
) -> Wear:
    """Return depths or rates of every kind, (2, n), on the nodes of another physics.

    Parameters
    ----------
    parts : the physics whose nodes they are at
    values : of every kind of mesh, (2, n) each
    rough : the other physics
    """
    kinds = zip(parts.kinds, values, rough.kinds, strict=True)
    return tuple(
        carried(fine.analysis.grid, value, coarse.analysis.grid)
        for fine, value, coarse in kinds
    )


def carried_forces(
    parts: assembly.GearModel, state: WearState, rough: assembly.GearModel
) -> tuple[Array, ...]:
    """Return the forces that make the patches of a state, on the nodes of another.

    Parameters
    ----------
    parts : the physics of the state
    state : the wear state in one condition
    rough : the other physics
    """
    forces = [
        carried(fine.analysis.grid, of_kind.patch_force[None], coarse.analysis.grid)[0]
        for fine, of_kind, coarse in zip(
            parts.kinds, state.kind, rough.kinds, strict=True
        )
    ]
    return tuple(np.maximum(0.0, force) for force in forces)


def between_nodes(
    parts: assembly.GearModel, wear: Wear, rough: assembly.GearModel
) -> Array:
    """Return how much of the wear is lost on rougher nodes and back, (n_flanks,) [m].

    Parameters
    ----------
    parts : the physics
    wear : of every kind of mesh [m]
    rough : the physics on the rougher nodes
    """
    back = carried_wear(rough, carried_wear(parts, wear, rough), parts)
    lost = [
        np.abs(carried - depth).max(axis=1)
        for carried, depth in zip(back, wear, strict=True)
    ]
    return np.concatenate(lost)


def flank_of_nodes(parts: assembly.GearModel) -> Index:
    """Return which flank of all kinds each entry of the flat wear is on."""
    sizes = [len(kind.analysis.grid.position) for kind in parts.kinds for _ in (0, 1)]
    return np.repeat(np.arange(len(sizes)), sizes)


def twins_of(parts: assembly.GearModel, life_history: history.History) -> Twins:
    """Return the rougher twins of the sampled states in one condition.

    Parameters
    ----------
    parts : the physics in that condition
    life_history : the life in that condition
    """
    twins = _of_share(parts, life_history.samples, COARSENED)
    if any(twins) or not any(map(is_periodic, life_history.samples.state)):
        return twins
    return _of_share(parts, life_history.samples, LESS_COARSENED, SCALED)


def finer_twins_of(parts: assembly.GearModel, life_history: history.History) -> Twins:
    """Return twins of the sampled states with twice the steps and nodes.

    Parameters
    ----------
    parts : the physics in one condition
    life_history : the life in that condition
    """
    return _of_share(parts, life_history.samples, REFINED, OF_FINER)


def _of_share(
    parts: assembly.GearModel,
    samples: history.History,
    share: float,
    weight: float = 1.0,
) -> Twins:
    """Return the twins of states with a share of the steps and nodes.

    None stands where one responds otherwise.

    While no flank parts the orbit is the only one, and is soonest found from the twin
    before on the same steps; any other from its own state, whose branch it has to be
    on.
    """
    rough = rough_parts(parts, share)
    twins = Twins()
    near = None
    for cycle, state in zip(samples.cycle, samples.state, strict=True):
        twins.append(None)
        if rough is None or not is_periodic(state):
            continue
        start = state.responses
        flat = rough.coupling.flat
        if near is not None and _permanent_contact(start) and _permanent_contact(near):
            start = near
        wear = tuple(
            np.maximum(0.0, depth) for depth in carried_wear(parts, state.wear, rough)
        )
        forces = carried_forces(parts, state, rough)
        companion = alike(rough, wear, StartingPoint(start, forces), state)
        if companion is not None:
            near = companion.responses
            rate = None
            if state.wears and companion.wears:
                carried_rate = flat(carried_wear(parts, state.rate, rough))
                rate = weight * (flat(companion.rate) - carried_rate)
            missed = weight * between_nodes(parts, state.wear, rough)
            twins[-1] = Rougher(
                float(cycle),
                flat(companion.wear),
                rate,
                rough,
                companion,
                weight,
                missed,
                is_finer=share > 1.0,
            )
    return twins


def is_periodic(state: WearState) -> bool:
    """Return whether a state responds periodically in every condition.

    Without dynamics it does.
    """
    return all(response.period > 0 for response in state.responses) and all(
        map(is_periodic, state.block)
    )


def together(twins: Sequence[Rougher | None], shares: Array) -> Rougher | None:
    """Return the twins of one state in all conditions as one, None if one is missing.

    Parameters
    ----------
    twins : of the state in each condition
    shares : of the cycles of each condition [1]
    """
    companions = tuple(twin for twin in twins if twin is not None)
    if len(companions) < len(twins):
        return None
    rates = [twin.rate for twin in companions if twin.rate is not None]
    rate = (
        np.asarray(sum(map(np.multiply, shares, rates)))
        if len(rates) == len(companions)
        else None
    )
    return companions[0]._replace(rate=rate, shares=shares, conditions=companions)


FORCE_SHARE = 2.0
"""Weight of the change by half the steps and nodes, set on seed 1 of
`tests/benchmarks/estimates.py`."""
EXTREMES_OF_ROUGHER = 1.25
"""Weight of what half the steps and nodes tell of largest and least force, set on
150 drawn scenes of the seed 33673807."""
EXTREMES_OF_FINER = 2.25
"""Weight of what twice the steps and nodes change of largest and least force: with
`OF_FINER` half as much again as at first order."""
CHANCE_OF_FINER = 0.1
"""Weight of the largest change at any instant by them. Both are set on 85 states of
NGW11-6 drawn with the seeds 60611 and 60612."""
INSTANT_SHARE = 1.75
"""Weight of the largest error at any instant, set on seed 129943 of
`tests/benchmarks/estimates.py`."""
NODES = 3
"""Instants within a step: its ends and its middle."""


class ForceErrors(NamedTuple):
    """Estimated errors of the forces of one state, or (n_updates,) of several [N].

    Parameters
    ----------
    mesh : of the elastic mesh force at any instant, the largest over the meshes
    largest, least : of the largest and the least mesh force, the largest over the
        meshes
    bearing : of the force of a bearing along one axis, the largest of all; NaN without
        bearings
    """

    mesh: Any
    largest: Any
    least: Any
    bearing: Any


def force_errors(
    parts: assembly.GearModel, state: WearState, twin: Rougher, worse: WearState
) -> ForceErrors:
    """Return the errors of the forces of a state, the largest over its responses.

    Parameters
    ----------
    parts, state : the physics and the state
    twin, worse : its rougher or finer twin, and what that is worn by as much further as
        the depth may be off
    """
    weight = FORCE_SHARE * twin.weight
    meshes = len(parts.meshes)
    errors = list[tuple[float, ...]]()
    when = clock.Instants(
        *mesh_forces.within_steps(parts.moving.sampling.grid, NODES)[:2]
    )
    physics = (parts, twin.parts, twin.parts)
    states = (state, twin.state, worse)
    for at in range(len(state.responses)):
        forces, coarse, further = (
            forces_of(of, there, at, when)
            for of, there in zip(physics, states, strict=True)
        )
        turns = (
            len(forces) if parts.moving.hunting == 1 else 1
        )  # hunting teeth say where it begins
        off = [
            np.abs(np.roll(coarse, turn, axis=0) - forces)[:, :meshes].max()
            for turn in range(turns)
        ]
        turn = int(np.argmin(off))
        coarse = np.roll(coarse, turn, axis=0)
        further = np.roll(further, turn, axis=0)
        error = weight * np.abs(coarse - forces) + np.abs(further - coarse)
        curves = np.stack([values[:, :meshes] for values in (forces, coarse, further)])
        extremes = [
            mesh_forces.extremes(there.responses[at]) for there in (state, twin.state)
        ]
        of_extremes = _by_rougher(curves, extremes, weight)
        if twin.is_finer:
            extremes[1] = mesh_forces.extremes(worse.responses[at])
            of_extremes = _by_finer(curves, extremes, EXTREMES_OF_FINER * twin.weight)
        of_meshes = INSTANT_SHARE * error[:, :meshes].max(), *of_extremes
        bearing = error[:, meshes:].max() if bearings.has_bearings(parts) else np.nan
        errors.append((*of_meshes, INSTANT_SHARE * bearing))
    return ForceErrors(*np.max(errors, axis=0))


def _by_rougher(
    curves: Array, extremes: Sequence[mesh_forces.Extremes], weight: float
) -> tuple[float, float]:
    """Return by how much largest and least force may be off by a rougher twin [N].

    Parameters
    ----------
    curves : (3, n_periods, n_meshes, n_instants) forces of a state, of its twin, and of
        that worn further [N]
    extremes : of the state and of its twin
    weight : of the change by the twin [1]
    """
    read, twice = extremes
    of_largest = max(
        _of_largest(curves, weight),
        weight * float(np.abs(read.largest - twice.largest).max()),
    )
    of_least = max(
        _of_largest(-curves, weight),
        weight * float(np.abs(read.least - twice.least).max()),
    )
    return EXTREMES_OF_ROUGHER * of_largest, EXTREMES_OF_ROUGHER * of_least


def _by_finer(
    curves: Array, extremes: Sequence[mesh_forces.Extremes], weight: float
) -> tuple[float, float]:
    """Return by how much largest and least force may be off by a finer twin [N].

    By what the extremes change, wherever they lie, and a share of the change at any
    instant: they may agree by chance.

    Parameters
    ----------
    curves : as of `_by_rougher`
    extremes : of the state, and of its twin worn further
    weight : of the change of the extremes [1]
    """
    forces, _, further = curves
    by_chance = CHANCE_OF_FINER * float(np.abs(further - forces).max())
    read, closer = extremes
    return (
        weight * float(np.abs(read.largest - closer.largest).max()) + by_chance,
        weight * float(np.abs(read.least - closer.least).max()) + by_chance,
    )


def _of_largest(curves: Array, weight: float) -> float:
    """Return by how much the largest force of a mesh may be off, the most of all [N].

    Curves are (3, n_periods, n_meshes, n_instants): those of a state, of its rougher
    twin, and of that worn further.
    """
    errors = []
    for mesh in range(curves.shape[2]):
        values, twin, worn = curves[:, :, mesh].reshape(3, -1)
        at_instants = weight * np.abs(twin - values) + np.abs(worn - twin)
        errors.append(error_of_largest(values, at_instants))
    return max(errors)


def error_of_largest(values: Array, error: Array) -> float:
    """Return by how much the largest of values may be off.

    With ``f`` off by ``E`` at each instant, the true largest lies between
    ``f(t) − E(t)`` at the instant of the largest and ``max(f + E)``: errors beside
    jumps, where the force is far from its largest, do not count.

    Parameters
    ----------
    values : f, (n,)
    error : E, (n,)
    """
    top = int(np.argmax(values))
    above = float((values + error).max() - values[top])
    return max(float(error[top]), above)


def forces_of(
    parts: assembly.GearModel, state: WearState, at: int, when: clock.Instants
) -> Array:
    """Return the forces of meshes, and of bearings after them.

    Of its response at an error angle, at the same instants of every mesh period, which
    lie in steps of equal length: both sides of every jump.

    Parameters
    ----------
    parts : the physics
    state : the wear state
    at : number of the error angle
    when : the instants

    Returns
    -------
    (n_periods, n_forces, n_instants) [N]
    """
    kinds = state.flanks
    response = state.responses[at]
    of_meshes = []
    motions = parts.moving.motions(response, when)
    inside = when.phase.reshape(-1, NODES)
    for number, mesh in enumerate(parts.meshes):
        where = clock.locate_within_steps(
            kinds[mesh.kind].analysis.grid, [mesh.lag], inside, inside.mean(axis=1)
        )
        of_meshes.append(parts.forces(kinds, number, where, motions).elastic)
    if not bearings.has_bearings(parts):
        return np.stack(of_meshes, axis=1)
    bearing = bearings.bearing_values(
        parts, *parts.moving.coordinates(response, when), np.stack(of_meshes)
    )
    return np.stack([*of_meshes, *bearing.reshape(-1, *bearing.shape[2:])], axis=1)

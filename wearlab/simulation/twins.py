"""The rougher twins of wear states: each state evaluated once more with half the steps and half the nodes.

Where these are so far off that their difference says little of the error, finer twins serve, of twice the
steps and nodes: wear that loads depend on steeply is not carried to every second node without loss.

Errors of mesh and bearing forces: what half the steps and nodes, and errors of the wear, change of them.

A rougher twin shows the one; the twin worn by as much more as the depth may be off shows the other. Both are
taken at every instant, and a largest force can be off by no more than the error where it may lie, or by what
reading it off the steps of the twin changes of it.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.forces import extremes, mesh_forces
from wearlab.dynamics.orbits.response import Response
from wearlab.gears.specification import GearError
from wearlab.life import history, limits, vibration
from wearlab.life.coupled import Wear, WearState
from wearlab.mesh import excitation, force
from wearlab.mesh.clock import Instants, look_within
from wearlab.mesh.profile import ProfileGrid, interpolate, lookup
from wearlab.scene.build import Parts, build, mesh
from wearlab.simulation.vibration import bearing_values, has_bearings

COARSENED = 0.5
LESS_COARSENED = 0.75
"""Share of the nodes and steps that a twin keeps, and where those respond otherwise all along."""
SCALED = (COARSENED**-2 - 1.0) / (LESS_COARSENED**-2 - 1.0)
"""What the change against the latter is worth as one against the former, at second order."""
REFINED = 2.0
"""Steps and nodes of a finer twin over those of the state."""
OF_FINER = 1.0 / (1.0 - REFINED**-2)
"""What the change against a finer twin is worth: the error itself at second order, without extrapolation."""


class Rougher(NamedTuple):
    """One state evaluated once more, with half the steps and half the nodes.

    Parameters
    ----------
    cycle : of the state [1]
    wear : (n_rough,) its wear depth at the rougher nodes of all flanks [m]
    rate : (n_rough,) change of the wear rate, None without a wear law [m]
    flank : (n_rough,) which flank each node is on
    parts, state : the rougher physics and what the state is there
    weight : what its changes are worth as ones of half the steps and nodes [1]
    between : what its nodes alone do not tell of the wear between them, at most [m]
    """

    cycle: float
    wear: Array
    rate: Array | None
    flank: Index
    parts: Parts
    state: WearState
    weight: float = 1.0
    between: float = 0.0

    def scaled(self, weight: float) -> "Rougher":
        """Return the twin with changes that are worth so much as ones of half the steps and nodes [1]."""
        rate = None if self.rate is None else weight * self.rate
        return self._replace(rate=rate, weight=weight, between=weight * self.between)


def rough_parts(parts: Parts, share: float = COARSENED) -> Parts | None:
    """Return the scene's physics with a share of the steps and of the nodes, None when that cannot be."""
    changed: dict[str, int] = {"profile_points": max(9, int(share * mesh.profile_points(parts.scene)))}
    if parts.vibration is not None:
        changed["steps_per_period"] = max(4, int(share * len(parts.vibration.sampling.grid.width)))
    numerics = parts.scene.numerics.model_copy(update=changed)
    try:
        return build(parts.scene.model_copy(update={"numerics": numerics}))
    except GearError:
        return None


def carried(fine: ProfileGrid, values: Array, rough: ProfileGrid) -> Array:
    """Return values (k, n) at the nodes of a grid on those of another that has the same breaks, (k, n')."""
    phases, _ = rough.phase_nodes
    segment = np.repeat(np.arange(len(rough.intervals)), rough.intervals + 1)
    where = lookup(fine, phases, segment)
    pairs = rough.pairs_at_phase_nodes
    present = pairs >= 0
    depths = np.empty((len(values), len(rough.contact_position)))
    for row, removed in zip(depths, fine.beyond(values), strict=True):
        at_phases = np.empty(pairs.shape)
        interpolate(fine.first, where, np.ascontiguousarray(removed), 0.0, at_phases)
        row[pairs[present]] = at_phases[present]
    return depths[:, rough.on_flank]


def rougher(
    parts: Parts, rough: Parts, cycle: float, state: WearState, before: Rougher | None = None
) -> Rougher | None:
    """Evaluate one state once more, None when the response is another one or none.

    While no flank parts the orbit is the only one, and is soonest found from the twin ``before`` on the same
    steps; any other from its own state, whose branch it has to be on.
    """
    responses = state.responses
    if not is_periodic(state):
        return None
    start = responses
    if before is not None and _permanent_contact(responses) and _permanent_contact(before.state.responses):
        start = before.state.responses
    wear = tuple(np.maximum(0.0, depth) for depth in _carried(parts, state.wear, rough))
    again = alike(rough, wear, start, responses)
    if again is None:
        return None
    rate = None
    if state.wears and again.wears:
        rate = rough.coupling.flat(again.rate) - rough.coupling.flat(_carried(parts, state.rate, rough))
    flat = rough.coupling.flat(again.wear)
    between = between_nodes(parts, state.wear, rough)
    return Rougher(cycle, flat, rate, flank_of_nodes(rough), rough, again, between=between)


def alike(
    parts: Parts, wear: Wear, start: vibration.Responses, wanted: vibration.Responses
) -> WearState | None:
    """Return a wear state, None where it does not respond with the periods that are wanted."""
    try:
        found = parts.coupling.evaluate(wear, start)
    except (limits.StopWear, GearError):  # or its steps are too rough for any motion
        return None
    periods = [[response.period for response in each] for each in (found.responses, wanted)]
    return found if periods[0] == periods[1] else None


def _permanent_contact(responses: vibration.Responses) -> bool:
    """Whether one pass was exact: no flank parted."""
    return all(response.period == 1 and response.counts.newton_iterations == 1 for response in responses)


def _carried(parts: Parts, values: Wear, rough: Parts) -> Wear:
    return tuple(
        carried(fine.analysis.grid, value, other.analysis.grid)
        for fine, value, other in zip(parts.kinds, values, rough.kinds, strict=True)
    )


def between_nodes(parts: Parts, wear: Wear, rough: Parts) -> float:
    """Return by how much wear is missed when it is carried to rougher nodes and back [m]."""
    back = _carried(rough, _carried(parts, wear, rough), parts)
    return max(float(np.abs(carried - own).max()) for carried, own in zip(back, wear, strict=True))


def flank_of_nodes(parts: Parts) -> Index:
    """Return which flank each entry of the flat wear is on."""
    sizes = [len(kind.analysis.grid.position) for kind in parts.kinds for _ in (0, 1)]
    return np.repeat(np.arange(len(sizes)), sizes)


def twins_of(parts: Parts, lived: history.History) -> list[Rougher | None]:
    """Return the rougher twins of the sampled states in one condition."""
    twins = _of_share(parts, lived.samples, COARSENED)
    if any(twins) or not any(map(is_periodic, lived.samples.state)):
        return twins
    return _of_share(parts, lived.samples, LESS_COARSENED, SCALED)


def finer_twins_of(parts: Parts, lived: history.History) -> list[Rougher | None]:
    """Return twins of the sampled states in one condition that have twice the steps and nodes."""
    return _of_share(parts, lived.samples, REFINED, OF_FINER)


def _of_share(parts: Parts, own: history.History, share: float, weight: float = 1.0) -> list[Rougher | None]:
    rough = rough_parts(parts, share)
    twins: list[Rougher | None] = [None] * len(own.state)
    if rough is None:
        return twins
    before: Rougher | None = None
    for number, (cycle, state) in enumerate(zip(own.cycle, own.state, strict=True)):
        twin = rougher(parts, rough, float(cycle), state, before)
        twins[number], before = twin and twin.scaled(weight), twin or before
    return twins


def is_periodic(state: WearState) -> bool:
    """Return whether a state responds periodically in every condition; without dynamics it does."""
    return all(response.period > 0 for response in state.responses) and all(map(is_periodic, state.block))


def together(twins: list[Rougher | None], weight: Array) -> Rougher | None:
    """Return the twins of one state in all conditions as one, None where one is missing."""
    known = [twin for twin in twins if twin is not None]
    if len(known) < len(twins):
        return None
    rates = [twin.rate for twin in known if twin.rate is not None]
    rate = None
    if len(rates) == len(known):
        rate = np.asarray(sum(w * own for w, own in zip(weight, rates, strict=True)))
    return known[0]._replace(rate=rate)


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
    own, inside = parts.meshes[mesh], when.phase.reshape(-1, NODES)
    where = look_within(kinds[own.kind].analysis.grid, [own.lag], inside, inside.mean(axis=1))
    return parts.forces(kinds, mesh, where, motions).elastic

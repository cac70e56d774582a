"""Estimates of the numerical error over the face.

The first and the last state are evaluated once more with half the nodes and half the
slices, and the life is lived on these: what that changes of the rates and of what was
worn counts. Where teeth bear hardest at an end of the face, wear is deepest there, half
a slice beyond the outermost one: that counts as well. What a mesh period comes to is
looked at on twice the nodes besides.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.gears.specification import GearError
from wearlab.life import coupled, history, limits
from wearlab.mesh.face.grid import FaceGrid
from wearlab.simulation import companion_runs, operating
from wearlab.simulation.estimates import Estimates, steps_error
from wearlab.simulation.face_period_estimates import (
    LoadedState,
    Twins,
    face_periods_along_life,
    felt_wear,
    line_loads,
    static_loads,
)
from wearlab.simulation.life_run import integration

WEIGHT = 2.0
"""Of what half the nodes and half the slices change of the deepest wear of a life, out
to the ends of the face: nodes may be of first order, which leaves all of it."""
OF_RATES = 0.3
"""Of what they change of the rates where wear is fast: what nodes and slices do to the
deepest wear may cancel by chance. Both weights are set on the seeds 771 and 772 of
`tests/benchmarks/face_life_estimates.py`."""

BUSY = 0.5
"""Share of the fastest rate from which a node counts: where wear is deepest."""


def rougher_over_face(parts: assembly.GearModel) -> assembly.GearModel:
    """Return the physics of a scene on half the nodes and half the slices.

    Parameters
    ----------
    parts : its physics
    """
    scene = parts.scene
    mesh = parts.scene.mesh
    for kind in parts.gears.kinds:
        fewer = {"face_points": max(3, assembly.face.slices_of(scene, kind) // 2)}
        of_section = scene.mesh.of(kind.section).model_copy(update=fewer)
        mesh = mesh.model_copy(
            update={kind.section: of_section} if kind.section else fewer
        )
    numerics = scene.numerics.model_copy(
        update={"profile_points": assembly.mesh.profile_points(scene) // 2}
    )
    return assembly.build(scene.with_sections(mesh=mesh, numerics=numerics))


def estimated_over_face(
    stage: operating.OperatingCondition,
    life_history: history.History,
    inherited: float = 0.0,
) -> Estimates:
    """Estimate the errors of a life at its kept states.

    Parameters
    ----------
    stage : what runs, in all its conditions
    life_history : its history
    inherited : error of the wear that the run starts from [m]
    """
    life = life_history.life
    first = stage.first
    if life is None:
        with first.coupling.account.timed("estimates"):
            rougher = [rougher_over_face(parts) for parts in stage.parts]
            twins = _twins_of_unworn(stage, rougher, life_history.state[0])
            period = face_periods_along_life(stage.parts, life_history, twins)
        return Estimates(None, None, None, period=period)
    ends = [life_history.state[0], life_history.state[-1]]
    with first.coupling.account.timed("estimates"):
        rougher = [rougher_over_face(parts) for parts in stage.parts]
        rough_ends = _on_rougher_nodes(stage, rougher, ends)
        rough_wear = _worn_as_long(stage, rougher, rough_ends[0].wear, life_history)
        rougher_life = _RougherLife(rougher, ends, rough_ends, rough_wear)
        share = _share_of_depth(stage, rougher_life)
        twins = _twins_of_ends(stage, rougher_life)
        period = face_periods_along_life(stage.parts, life_history, twins)

    force = None
    if ends[0].responses:
        # mesh forces at any phase are off by no more, nor are bearings, which carry
        # less
        force = tuple(
            companion_runs.ForceErrors(*np.full((4, len(life_history.state)), off))
            for off in _differences_of_forces(ends, rough_ends)
        )

    flat = first.coupling.flat
    start = flat(life_history.state[0].wear)
    worn = np.array(
        [float((flat(state.wear) - start).max()) for state in life_history.state]
    )
    depth = inherited + steps_error(life_history, life_history.cycle) + share * worn
    of_life = None
    if life.worn_out:
        fastest = float(flat(ends[1].rate).max())
        of_life = life.error_estimate_life + share * float(worn[-1]) / fastest
    return Estimates(depth, force, of_life, period=period)


class _RougherLife(NamedTuple):
    """A life on half the slices and nodes, beside the life itself.

    Parameters
    ----------
    physics : on these, in every condition
    ends, rough_ends : first and last state of the life itself, and what they are on
        these
    wear : of the rougher life where the life itself ends; None: not known [m]
    """

    physics: list[assembly.GearModel]
    ends: list[coupled.WearState]
    rough_ends: list[coupled.WearState]
    wear: coupled.Wear | None


def _on_other_nodes(
    state: coupled.WearState, grids: list[FaceGrid], targets: list[FaceGrid]
) -> tuple[Array, ...]:
    """Return the wear of a state at the slices and nodes of other grids [m]."""
    of_kinds = zip(state.wear, grids, targets, strict=True)
    return tuple(moved(depth, grid, target) for depth, grid, target in of_kinds)


def _on_rougher_nodes(
    stage: operating.OperatingCondition,
    rougher: list[assembly.GearModel],
    states: list[coupled.WearState],
) -> list[coupled.WearState]:
    """Return states evaluated at the slices and nodes of rougher physics."""
    together = operating.taking_turns(rougher, stage.weight, stage.weight)
    grids = _grids(stage.first)
    rough_grids = _grids(rougher[0])
    rough = []
    for state in states:
        wear = _on_other_nodes(state, grids, rough_grids)
        rough.append(together.evaluate(wear))
    return rough


def _twins_of_unworn(
    stage: operating.OperatingCondition,
    rougher: list[assembly.GearModel],
    state: coupled.WearState,
) -> list[list[Twins]]:
    """Return the twins of a state that wears no further, in every condition."""
    twins = []
    for block, (parts, rough) in enumerate(zip(stage.parts, rougher, strict=True)):
        rough_twin = _static_twin(rough, parts, state)
        (finer,) = _finer_twins(parts, [state.conditions[block]])
        twins.append([Twins(rough_twin, None, finer)])
    return twins


def _twins_of_ends(
    stage: operating.OperatingCondition, rougher: _RougherLife
) -> list[list[Twins]]:
    """Return the twins of the first and the last state of a life, in every condition.

    Parameters
    ----------
    stage : what runs, in all its conditions
    rougher : the life on half the slices and nodes
    """
    twins = []
    of_conditions = zip(stage.parts, rougher.physics, strict=True)
    for block, (parts, rough) in enumerate(of_conditions):
        ends = [end.conditions[block] for end in rougher.ends]
        rough_ends = [
            LoadedState(rough, line_loads(end.conditions[block]))
            for end in rougher.rough_ends
        ]
        finer_ends = _finer_twins(parts, ends)
        first, last = (
            Twins(rough_end, None, finer)
            for rough_end, finer in zip(rough_ends, finer_ends, strict=True)
        )
        if rougher.wear is not None:
            lived = LoadedState(rough, static_loads(rough, rougher.wear))
            last = last._replace(lived=lived)
        twins.append([first, last])
    return twins


def _finer_twins(
    parts: assembly.GearModel, states: list[coupled.WearState]
) -> list[LoadedState | None]:
    """Return states in one condition on twice the nodes, None where these cannot be.

    What the mesh feels of the wear is carried there: to work out patches on so many
    nodes takes longer than all else.
    """
    finer = companion_runs.rough_parts(parts, companion_runs.REFINED)
    if finer is None:
        return [None] * len(states)
    try:
        return [_felt_twin(finer, parts, state) for state in states]
    except GearError:  # where no loads balance on these nodes
        return [None] * len(states)


def _felt_twin(
    finer: assembly.GearModel, parts: assembly.GearModel, state: coupled.WearState
) -> LoadedState:
    """Return a state on finer nodes, worn by what it feels on those of the run."""
    assert finer.face is not None
    contacts = [kind.contact for kind in finer.face.kinds]
    of_kinds = zip(contacts, felt_wear(state), _grids(parts), strict=True)
    loads = [
        contact.solve(moved(felt, grid, contact.grid))
        for contact, felt, grid in of_kinds
    ]
    return LoadedState(finer, loads)


def _static_twin(
    other: assembly.GearModel, parts: assembly.GearModel, state: coupled.WearState
) -> LoadedState:
    """Return a state of some physics on the slices and nodes of other physics."""
    wear = _on_other_nodes(state, _grids(parts), _grids(other))
    return LoadedState(other, static_loads(other, wear))


def _differences_of_forces(
    states: list[coupled.WearState], rough: list[coupled.WearState]
) -> list[float]:
    """Return by how much largest forces differ from those of rougher twins [N].

    Of every condition of operation the most in any state.
    """
    by_condition = [0.0] * len(states[0].conditions)
    for state, twin in zip(states, rough, strict=True):
        pairs = zip(state.conditions, twin.conditions, strict=True)
        for number, (fine, coarse) in enumerate(pairs):
            largest = extremes(fine.responses[0]).largest
            largest_of_twin = extremes(coarse.responses[0]).largest
            off = float(np.abs(largest - largest_of_twin).max())
            by_condition[number] = max(by_condition[number], off)
    return by_condition


def _grids(parts: assembly.GearModel) -> list[FaceGrid]:
    """Return the grids over the face, one for each kind of mesh."""
    assert parts.face is not None
    return [kind.contact.grid for kind in parts.face.kinds]


def _share_of_depth(
    stage: operating.OperatingCondition, rougher: _RougherLife
) -> float:
    """Return the error of the deepest wear by slices and nodes, over what wore [1].

    By how much deeper the ends of the face wear than any slice, and by the same life on
    half of both.

    Parameters
    ----------
    stage : what runs, in all its conditions
    rougher : the life on half the slices and nodes
    """
    grids = _grids(stage.first)
    rough_grids = _grids(rougher.physics[0])
    of_rates = [
        _difference_of_rates(state, twin, grids, rough_grids)
        for state, twin in zip(rougher.ends, rougher.rough_ends, strict=True)
    ]
    first, last = rougher.ends
    most = float((_deepest(last.wear) - _deepest(first.wear)).max())
    if most <= 0.0:
        return 0.0
    grown = _deepest_to_ends(last.wear, grids) - _deepest_to_ends(first.wear, grids)
    beyond_slices = max(0.0, float(grown.max()) - most) / most
    if rougher.wear is None:
        return beyond_slices + WEIGHT * max(of_rates)

    rough_first = rougher.rough_ends[0].wear
    rough_grown = _deepest_to_ends(rougher.wear, rough_grids) - _deepest_to_ends(
        rough_first, rough_grids
    )
    missed = float(np.abs(rough_grown - grown).max()) / most
    return beyond_slices + WEIGHT * missed + OF_RATES * float(np.mean(of_rates))


def _worn_as_long(
    stage: operating.OperatingCondition,
    rougher: list[assembly.GearModel],
    wear: coupled.Wear,
    life_history: history.History,
) -> coupled.Wear | None:
    """Return the wear of rougher physics after as many cycles, None: they end before.

    Parameters
    ----------
    stage : what runs, in all its conditions
    rougher : its physics on half the slices and nodes
    wear : at the beginning of the life [m]
    life_history : the life
    """
    first = rougher[0]
    together = operating.taking_turns(rougher, stage.weight, stage.weight)
    cycles = float(life_history.cycle[-1])
    until = limits.Limits(cycles, None, slice(None))
    rate = history.SetRate(together)
    try:
        life = integration(first.scene, first, until)(rate, together.flat(wear))
    except limits.StopWear:
        return None
    if life.end_reason != limits.ALL_CYCLES:
        return None
    return together.split(life.depth[-1])


def _deepest(wear: coupled.Wear) -> Array:
    """Return the deepest wear of every flank at the middles of slices, (n_flanks,) [m].

    Parameters
    ----------
    wear : of every kind of mesh, (2, n_face, n) each [m]
    """
    return np.concatenate([depth.reshape(2, -1).max(axis=1) for depth in wear])


def _deepest_to_ends(wear: coupled.Wear, grids: list[FaceGrid]) -> Array:
    """Return the deepest wear of every flank out to the ends of its face, (n_flanks,).

    Outermost slices have the wear of their middles, half a slice before the end: on to
    it by a straight line through the two outermost.

    Parameters
    ----------
    wear : of every kind of mesh, (2, n_face, n) each [m]
    grids : over the face, of every kind

    Returns
    -------
    (n_flanks,) [m]
    """
    found = []
    for depth, grid in zip(wear, grids, strict=True):
        deepest = _deepest((depth,))
        for end, beside in ((0, 1), (-1, -2)):
            apart = abs(grid.position[end] - grid.position[beside])
            half = 0.5 * grid.width[end]
            slope = (depth[:, end] - depth[:, beside]) / apart
            at_end = depth[:, end] + half * slope
            deepest = np.maximum(deepest, at_end.max(axis=1))
        found.append(deepest)
    return np.concatenate(found)


def _difference_of_rates(
    fine: coupled.WearState,
    rough: coupled.WearState,
    grids: list[FaceGrid],
    rough_grids: list[FaceGrid],
) -> float:
    """Return by how much the rate of the rougher twin differs, over the fastest [1].

    The root mean square of the nodes where wear is fast.
    """
    fastest = max(float(rate.max()) for rate in fine.rate)
    squares = list[Array]()
    for rate, rough_rate, grid, rough_grid in zip(
        fine.rate, rough.rate, grids, rough_grids, strict=True
    ):
        difference = moved(rough_rate, rough_grid, grid) - rate
        squares.append(difference[rate >= BUSY * fastest] ** 2)
    if fastest <= 0.0:
        return 0.0
    return float(np.sqrt(np.concatenate(squares).mean())) / fastest


def moved(values: Array, grid: FaceGrid, target: FaceGrid) -> Array:
    """Return values at slices and nodes of another grid, linear between them.

    Parameters
    ----------
    values : (2, n_face, n) on the grid ``grid``
    grid, target : grids of one pair
    """
    axes = (grid.position, _apart_at_steps(grid))
    places = (target.position, _apart_at_steps(target))
    at = [
        np.clip(place, axis[0], axis[-1])
        for axis, place in zip(axes, places, strict=True)
    ]
    linear = RegularGridInterpolator(axes, np.moveaxis(values, 0, -1))
    return np.moveaxis(linear(tuple(np.meshgrid(*at, indexing="ij"))), -1, 0)


def _apart_at_steps(grid: FaceGrid) -> Array:
    """Return path positions with the nodes of a step set apart, (n,) [m]."""
    position = grid.profile.position
    return position + 1e-9 * (position[-1] - position[0]) * np.arange(len(position))

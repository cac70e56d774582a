"""Estimates of the numerical error over the face.

The first and the last state are evaluated once more with half the nodes and half the
slices; what the wear rate changes by there, relative to the fastest, counts for all
that was worn.
"""

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.life import coupled, history
from wearlab.mesh.face.grid import FaceGrid
from wearlab.simulation import companion_runs, operating
from wearlab.simulation.estimates import Estimates, steps_error
from wearlab.simulation.face_period_estimates import (
    face_periods_along_life,
    line_loads,
    static_loads,
)

WEIGHT = 0.5
"""Of the rougher twin's change of rate: a third is what halving a grid of second order
leaves."""
OF_ENDS = 1.5
"""The same at the ends of the face of spur gears, and of slices apart: an outermost
slice has the gap of its middle, which is of first order at most, and leaves all of it
or more (tests/benchmarks/face_life_estimates.py)."""


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
            grids = _grids(first), _grids(rougher[0])
            wear = _on_other_nodes(life_history.state[0], *grids)
            rough_loads = [[static_loads(rough, wear)] for rough in rougher]
            period = face_periods_along_life(
                stage.parts, rougher, life_history, rough_loads
            )
        return Estimates(None, None, None, period=period)
    ends = [life_history.state[0], life_history.state[-1]]
    with first.coupling.account.timed("estimates"):
        rougher = [rougher_over_face(parts) for parts in stage.parts]
        rough_ends = _on_rougher_nodes(stage, rougher, ends)
        differences = [
            _difference(state, twin, _grids(first), _grids(rougher[0]))
            for state, twin in zip(ends, rough_ends, strict=True)
        ]
        share = _weight(first) * max(differences)
        rough_loads = [
            [line_loads(state.conditions[block]) for state in rough_ends]
            for block in range(len(rougher))
        ]
        period = face_periods_along_life(
            stage.parts, rougher, life_history, rough_loads
        )

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
        of_life = life.error_estimate_life + share * float(life.cycle[-1])
    return Estimates(depth, force, of_life, period=period)


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


def _weight(parts: assembly.GearModel) -> float:
    """Return what the difference of the rates is worth: more where slices end."""
    assert parts.face is not None
    contacts = [kind.contact for kind in parts.face.kinds]
    sliced = any(
        contact.solid is None and contact.shear_length == 0.0 for contact in contacts
    )
    return OF_ENDS if sliced or not contacts[0].helix.angle else WEIGHT


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


def _difference(
    fine: coupled.WearState,
    rough: coupled.WearState,
    grids: list[FaceGrid],
    rough_grids: list[FaceGrid],
) -> float:
    """Return by how much the rate of the rougher twin differs, over the fastest [1].

    Where wear is fast counts.
    """
    fastest = max(float(rate.max()) for rate in fine.rate)
    differences = [0.0]
    for rate, rough_rate, grid, rough_grid in zip(
        fine.rate, rough.rate, grids, rough_grids, strict=True
    ):
        difference = np.abs(moved(rough_rate, rough_grid, grid) - rate)
        busy = rate >= BUSY * fastest
        differences.append(float(difference[busy].max(initial=0.0)))
    return max(differences) / fastest if fastest > 0.0 else 0.0


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

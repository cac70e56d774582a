"""The arrays of a gear set's steady responses, named as the dataset names them."""

from itertools import pairwise
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces.extremes import extremes
from wearlab.dynamics.forces.mesh_forces import (
    friction_force,
    load_factors,
    mean_force_residual,
    mesh_forces,
    moments,
    within_steps,
)
from wearlab.dynamics.orbits.response import Response
from wearlab.dynamics.supports import bearing_forces
from wearlab.life.history import History
from wearlab.life.load import equivalent_force
from wearlab.life.state import WearState
from wearlab.life.vibration import Vibration
from wearlab.mesh.clock import Instants, look_within
from wearlab.mesh.excitation import Touching
from wearlab.mesh.force import Deflections
from wearlab.mesh.harmonics import Harmonics, harmonics
from wearlab.scene.build import Parts
from wearlab.scene.build.modes import SceneModes
from wearlab.simulation.energy import energy_values
from wearlab.simulation.label import padded
from wearlab.simulation.monitoring import monitoring_values
from wearlab.simulation.static import pair_slots

Values = dict[str, Any]


def dynamic_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return the steady responses at the stored phases, and what is read off them.

    Averaged slow errors that the set answers to make one response an angle, along ``error_angle``.
    """
    vibration = parts.vibration
    assert vibration is not None
    along_periods = {"bearing_force": 2, "pair_force": 2, "pair_normal_force": 2}
    angles = len(states[0].responses)
    each = []
    for angle in range(angles):
        responses = [_response_values(parts, vibration, state, state.responses[angle]) for state in states]
        each.append(
            {
                name: stacked(
                    [np.asarray(response[name]) for response in responses], along_periods.get(name, 1)
                )
                for name in responses[0]
            }
        )
    asked = monitoring_values(parts, states)
    if angles == 1:
        return each[0] | asked
    return {
        name: np.moveaxis(stacked([values[name] for values in each], None), 0, 1) for name in each[0]
    } | asked


def stacked(arrays: list[Array], along: int | None) -> Array:
    """Stack arrays; those that differ in length along the mesh periods are padded with NaN."""
    if arrays[0].ndim == 0 or len({array.shape for array in arrays}) == 1:
        return np.stack(arrays)
    if along is None:
        along = next(i for i in range(arrays[0].ndim) if len({array.shape[i] for array in arrays}) > 1)
    return padded(arrays, along)


def _response_values(parts: Parts, vibration: Vibration, state: WearState, response: Response) -> Values:
    when = vibration.look(parts.phase)
    motions = vibration.motions(response, when)
    position, velocity = vibration.coordinates(response, when)
    touching = parts.coupling.touching(state)
    meshes = [
        _mesh_response(parts, vibration, touching, mesh, _of_mesh(motions, mesh))
        for mesh in range(len(parts.meshes))
    ]
    pairs = max(each_mesh["pair_force"].shape[0] for each_mesh in meshes)
    for each_mesh in meshes:
        short = pairs - each_mesh["pair_force"].shape[0]
        for name in ("pair_force", "pair_normal_force"):
            each_mesh[name] = np.pad(each_mesh[name], ((0, short), (0, 0), (0, 0)))
    values: Values = {name: np.stack([each_mesh[name] for each_mesh in meshes]) for name in meshes[0]}
    transmission = transmission_error(vibration, position) + parts.constant_error[:, None]
    series = [_over_periods(own, parts.phase, parts.harmonics) for own in np.moveaxis(transmission, 1, 0)]
    values["dynamic_transmission_error"] = np.moveaxis(transmission, 1, 0)
    values["dte_harmonics"] = np.stack([own.amplitude for own in series])
    values["dte_rms"] = [own.rms for own in series]
    means = [mean_moments(parts, vibration, touching, kind, response) for kind in range(len(touching))]
    if parts.gears.shares:
        of_kinds = zip(parts.gears.kinds, means, strict=True)
        values["mesh_load_factor"] = np.concatenate([load_factors(*mesh_kind) for mesh_kind in of_kinds])
    values |= {
        **extreme_values(parts, response),
        "response_period": response.period * vibration.hunting,
        "floquet_multiplier": _as_parts(response, 2 * len(vibration.system.coordinates)),
        "residual_mean_force": mean_force_residual(
            parts.gears.kinds, [mine.analysis.load for mine in touching], means, parts.friction is not None
        ),
        "residual_orbit": response.residual,
        **energy_values(parts, vibration, response),
    }
    if parts.wohler_slope is not None:
        equivalent = [
            parts.gears.lever(k)
            * equivalent_force(
                parts.kinds[k].analysis, kind_state.weight, kind_state.drive, parts.wohler_slope
            )
            for k, kind_state in enumerate(state.kind)
        ]
        values["equivalent_load"] = [equivalent[mesh.kind] for mesh in parts.meshes]
    if has_bearings(parts):
        force = bearing_forces(vibration.system.supports, parts.gears.members, position, velocity)
        values["bearing_force"] = force * _sense_of_axes(parts)
    return values


def phase_forces(parts: Parts, state: WearState, response: Response) -> Array:
    """Return the elastic force of every mesh at the stored phases, (n_periods, n_mesh, n_phases) [N]."""
    vibration = parts.vibration
    assert vibration is not None
    motions = vibration.motions(response, vibration.look(parts.phase))
    touching = parts.coupling.touching(state)
    each = [
        mesh_forces(
            vibration.system, mesh, touching[own.kind], parts.look(mesh, parts.phase),
            _of_mesh(motions, mesh), vibration.period,
        ).elastic
        for mesh, own in enumerate(parts.meshes)
    ]  # fmt: skip
    return np.stack(each, axis=1)


def _of_mesh(motions: Deflections, mesh: int) -> Deflections:
    """Return the motion of one mesh, (n_periods, n) each."""
    return Deflections(motions.deflection[:, mesh], motions.rate[:, mesh])


def _mesh_response(
    parts: Parts, vibration: Vibration, touching: list[Touching], mesh: int, motion: Deflections
) -> dict[str, Array]:
    """Return what one mesh does at the stored phases, the mesh periods first (the pairs before them)."""
    own_mesh, where = parts.meshes[mesh], parts.look(mesh, parts.phase)
    mine = touching[own_mesh.kind]
    forces = mesh_forces(vibration.system, mesh, mine, where, motion, vibration.period)
    deflection, rate = motion
    values = {
        "dynamic_mesh_force": forces.elastic,
        "normal_mesh_force": forces.normal,
        "mesh_damping_force": forces.normal - forces.elastic,
        "mesh_deflection": deflection,
        "mesh_deflection_rate": rate,
        "pair_force": np.stack([pair_slots(row, mine.analysis.grid) for row in forces.pair], axis=1),
        "pair_normal_force": np.stack(
            [pair_slots(row, mine.analysis.grid) for row in forces.pair_normal], axis=1
        ),
        "poincare_deflection": deflection[:, 0],
        "poincare_rate": rate[:, 0],
    }
    if parts.friction is not None:
        values["friction_force"] = friction_force(forces, mine, where, parts.friction)
    if mine.series is not None:
        own = where.phase
        values["excitation_stiffness"] = mine.series.stiffness.value(own)
        values["excitation_error"] = mine.series.error.value(own) + own_mesh.error.value(own)
    return values


def extreme_values(parts: Parts, response: Response) -> Values:
    """Return the extreme forces of every mesh and the time it is apart, from the steps of its response."""
    extremes_found = extremes(response)
    static = np.array([parts.kinds[mesh.kind].analysis.load for mesh in parts.meshes])
    return {
        "mesh_force_min": extremes_found.least,
        "mesh_force_max": extremes_found.largest,
        "dynamic_factor": np.divide(
            extremes_found.largest, static, out=np.full(len(static), np.nan), where=static > 0.0
        ),
        "normal_force_factor": np.divide(
            extremes_found.largest_normal, static, out=np.full(len(static), np.nan), where=static > 0.0
        ),
        "separation_fraction": extremes_found.separated,
    }


def mean_moments(
    parts: Parts, vibration: Vibration, touching: list[Touching], kind: int, response: Response
) -> Array:
    """Return the mean moments of each mesh of a kind over base radius, (n_mesh, (driving, driven)) [N]."""
    mine, grid = touching[kind], vibration.sampling.grid
    phase, segment, weight = within_steps(grid)
    middle = grid.start + 0.5 * grid.width
    motions = vibration.motions(response, Instants(phase, segment))
    values = []
    for mesh in parts.coupling.kinds[kind].meshes:
        where = look_within(
            mine.analysis.grid, [parts.meshes[mesh].lag], phase.reshape(len(middle), -1), middle
        )
        forces = mesh_forces(vibration.system, mesh, mine, where, _of_mesh(motions, mesh), vibration.period)
        each = moments(forces, mine, parts.kinds[kind].pair, where, parts.friction)
        values.append((each @ weight).mean(axis=1))
    return np.array(values)


def transmission_error(vibration: Vibration, position: Array) -> Array:
    """Return r_b1 θ1 − r_b2 θ2 of every mesh, (n_periods, n_mesh, n_phases) [m].

    What the rotations alone do along each line of action; in a planetary set those beside the carrier's.

    Parameters
    ----------
    vibration : the dynamics
    position : (n_periods, n, n_phases) coordinates [m]
    """
    system = vibration.system
    turns = [name == "mesh.x" or name.endswith(".u") for name in system.coordinates]
    return np.asarray(np.einsum("pi...,mi->pm...", position, np.where(turns, system.direction, 0.0)))


def _over_periods(values: Array, phase: Array, count: int) -> Harmonics:
    periods = len(values)
    turned = (np.arange(periods)[:, None] + phase).ravel()
    return harmonics(turned, np.full(values.size, 1.0 / values.size), values.ravel(), count)


def has_bearings(parts: Parts) -> bool:
    """Whether a member moves on its support."""
    return parts.vibration is not None and any(support.bears for support in parts.vibration.system.supports)


def _sense_of_axes(parts: Parts) -> Array:
    """Return the senses of x and y as the model counts them, (2, 1, 1): y of a mirrored set points back."""
    return np.array([1.0, parts.gears.sense])[:, None, None]


def _as_parts(response: Response, count: int) -> Array:
    """Return the multipliers by descending modulus, (count, 2) real and imaginary, NaN when aperiodic."""
    values = np.full((count, 2), np.nan)
    multipliers = response.multipliers[np.argsort(-np.abs(response.multipliers), kind="stable")]
    values[: len(multipliers)] = np.stack([multipliers.real, multipliers.imag], axis=1)
    return values


def mode_values(modes: SceneModes) -> Values:
    """Return natural frequencies and the speeds at which the mesh frequency meets them."""
    values = {
        "natural_frequency": modes.modes.frequency,
        "critical_speed": modes.critical_speed[0],
        "mode_participation": modes.modes.participation.T,
    }
    return values if modes.kinds is None else values | {"mode_kind": list(modes.kinds)}


def attractor(lived: History) -> Array:
    """Return which branch each kept response is on, counted from 1 along the life, (n_updates,).

    The count rises where the wear rate jumped, and where the period of the response changes.
    """
    jumps = [] if lived.life is None else [jump.cycle for jump in lived.life.jumps]
    periods = [tuple(response.period for response in state.responses) for state in lived.state]
    branch = [1]
    for (before, after), (start, end) in zip(pairwise(periods), pairwise(lived.cycle), strict=True):
        passed = sum(start < jump <= end for jump in jumps)
        branch.append(branch[-1] + max(passed, int(before != after)))
    return np.array(branch, float)

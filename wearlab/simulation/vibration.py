"""The arrays of a gear set's steady responses, named as the dataset names them; its energy and its modes."""

from itertools import pairwise
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces import energy, extremes, mesh_forces
from wearlab.dynamics.orbits.response import Response
from wearlab.dynamics.supports import bearing_forces
from wearlab.gears.specification import GearError
from wearlab.life import coupled, history, loads
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, excitation, force, gear_set, harmonics, stages
from wearlab.scene import Scene, build
from wearlab.simulation import label, monitoring
from wearlab.simulation.label import Values


def dynamic_values(parts: build.Parts, states: tuple[coupled.WearState, ...]) -> Values:
    """Return the steady responses at the stored phases, and what is read off them.

    Averaged slow errors that the set answers to make one response an angle, along ``error_angle``.
    """
    lines, asked = monitoring.lines_of(parts.moving, states), parts.scene.store.requested
    each = [[_response_values(parts, state, one, lines) for one in state.responses] for state in states]
    values = {name: label.of_states([[own[name] for own in row] for row in each]) for name in each[0][0]}
    return values | ({"order": lines} if any(name.endswith("_orders") for name in asked) else {})


def _response_values(
    parts: build.Parts, state: coupled.WearState, response: Response, lines: Array
) -> Values:
    vibration, kinds = parts.moving, state.flanks
    when = vibration.look(parts.phase)
    motions, (position, velocity) = vibration.motions(response, when), vibration.coordinates(response, when)
    meshes = [_mesh_response(parts, kinds, mesh, motions) for mesh in range(len(parts.meshes))]
    values: Values = {name: label.padded([own[name] for own in meshes], fill=0.0) for name in meshes[0]}
    transmission = transmission_error(vibration, position) + parts.constant_error[:, None]
    each = values["dynamic_transmission_error"] = np.moveaxis(transmission, 1, 0)
    phase = (np.arange(len(position))[:, None] + parts.phase).ravel()
    equal = np.full(len(phase), 1.0 / len(phase))
    series = [harmonics.harmonics(phase, equal, own.ravel(), parts.harmonics) for own in each]
    values["dte_harmonics"] = np.stack([own.amplitude for own in series])
    values["dte_rms"] = [own.rms for own in series]
    means = [mean_moments(parts, kinds, kind, response) for kind in range(len(kinds))]
    if parts.gears.shares:
        factors = list(map(mesh_forces.load_factors, parts.gears.kinds, means))
        values["mesh_load_factor"] = np.concatenate(factors)
    found, of_kind = extremes.extremes(response), np.array([kind.analysis.load for kind in parts.kinds])
    load = of_kind[[mesh.kind for mesh in parts.meshes]]
    multipliers, known = np.full((2 * len(vibration.system.coordinates), 2), np.nan), response.multipliers
    multipliers[: len(known)] = np.stack([np.real(known), np.imag(known)], axis=-1)
    values |= {
        "mesh_force_min": found.least,
        "mesh_force_max": found.largest,
        "dynamic_factor": monitoring.over(found.largest, load),
        "normal_force_factor": monitoring.over(found.largest_normal, load),
        "separation_fraction": found.separated,
        "response_period": response.period * vibration.hunting,
        "floquet_multiplier": multipliers,
        "residual_mean_force": mesh_forces.mean_force_residual(
            parts.gears.kinds, list(of_kind), means, parts.friction is not None
        ),
        "residual_orbit": response.residual,
    }
    if vibration.nominal is not None and parts.friction is not None:
        balance = energy.energy_balance(response, vibration.nominal)
        values |= {f"energy_{name}": power for name, power in balance._asdict().items()}
        values |= {"residual_energy": balance.residual, "efficiency": balance.efficiency}
    if parts.wohler_slope is not None:
        equivalent = [
            loads.equivalent_force(own.flanks.analysis, own.weight, own.drive, parts.wohler_slope)
            for own in state.kind
        ]
        levers = [parts.gears.lever(mesh.kind) * equivalent[mesh.kind] for mesh in parts.meshes]
        values["equivalent_load"] = levers
    if has_bearings(parts):
        values["bearing_force"] = bearing_values(parts, position, velocity, values["normal_mesh_force"])
    return values | monitoring.of_response(parts, response, lines)


def bearing_values(parts: build.Parts, position: Array, velocity: Array, normal: Array) -> Array:
    """Return the forces of the bearings on the members, (n_members, 2 or 3, n_periods, n_instants) [N].

    Along x, y and, of helical gears, z. A bearing that does not give way holds what the meshes push at once.

    Parameters
    ----------
    parts : the physics
    position, velocity : (n_periods, n, n_instants) coordinates q [m] and q̇ [m/s]
    normal : (n_mesh, n_periods, n_instants) forces of the meshes in the plane of action [N]
    """
    gears, supports = parts.gears, parts.moving.system.supports
    force = bearing_forces(supports, gears.members, position, velocity)
    force[:, 1] *= gears.sense  # y of a mirrored set points back
    slope = 0.0 if parts.face is None else parts.face.slope
    if not slope:
        return force[:, :2]
    moving = {(support.member, support.axis) for support in supports}
    rigid = [(member, "z") not in moving for member in gears.members]
    force[rigid, 2] = rigid_bearing_forces(gears, slope, normal)[rigid]
    if all(axis != "y" for _, axis in moving):  # a pair that only turns and moves along its axes
        force[:, 1] = rigid_bearing_forces(gears, 1.0, normal)
    return force


def rigid_bearing_forces(gears: gear_set.GearSet, share: float, normal: Array) -> Array:
    """Return along one axis the forces of bearings that do not give way, ``± share F`` of the meshes [N].

    What the mesh pushes the bearing holds at once, along the axis on the pins of planets, too, and all of
    them at the carrier's.

    Parameters
    ----------
    gears : the gear set
    share : of the force in the plane of action: along the axis the signed tan β_b of
        :class:`wearlab.gears.helix.Helix`, along a pair's line of action 1 [1]
    normal : (n_mesh, n_periods, n_phases) force in the plane of action [N]

    Returns
    -------
    (n_members, n_periods, n_phases), along the axis towards positive face positions [N]

    References
    ----------
    ISO 21771:2007, 4.3, for the angle; the balance of forces.
    """
    total = np.zeros((len(gears.members), *normal.shape[1:]))
    for mesh, kind in enumerate(gears.mesh_kinds):
        for sign, gear in zip((1.0, -1.0), gears.kinds[kind].pair.gears, strict=True):
            columns = gears.columns_of(gear.name)
            total[columns[mesh % len(columns)]] += sign * share * normal[mesh]
    for carrier in gears.columns_of("carrier"):
        total[carrier] = total[gears.columns_of("planet")].sum(axis=0)
    return total


def phase_forces(parts: build.Parts, state: coupled.WearState, response: Response) -> Array:
    """Return the elastic force of every mesh at the stored phases, (n_periods, n_mesh, n_phases) [N]."""
    motions = parts.moving.motions(response, parts.moving.look(parts.phase))
    places = [parts.look(mesh, parts.phase) for mesh in range(len(parts.meshes))]
    forces = [parts.forces(state.flanks, mesh, where, motions) for mesh, where in enumerate(places)]
    return np.stack([own.elastic for own in forces], axis=1)


def _mesh_response(
    parts: build.Parts, kinds: list[excitation.MeshFlanks], mesh: int, motions: force.Deflections
) -> dict[str, Array]:
    """Return what one mesh does at the stored phases, the mesh periods first (the pairs before them)."""
    own_mesh, where = parts.meshes[mesh], parts.look(mesh, parts.phase)
    mine = kinds[own_mesh.kind]
    forces = parts.forces(kinds, mesh, where, motions)
    deflection, rate = (each[:, mesh] for each in motions)
    values = {
        "dynamic_mesh_force": forces.elastic,
        "normal_mesh_force": forces.normal,
        "mesh_damping_force": forces.normal - forces.elastic,
        "mesh_deflection": deflection,
        "mesh_deflection_rate": rate,
        "poincare_deflection": deflection[:, 0],
        "poincare_rate": rate[:, 0],
    }
    if parts.face is None:
        for name, each in (("pair_force", forces.pair), ("pair_normal_force", forces.pair_normal)):
            values[name] = np.stack([mine.analysis.grid.into_slots(row.T, 0.0) for row in each], axis=1)
    if parts.friction is not None:
        values["friction_force"] = mesh_forces.friction_force(forces, mine, where, parts.friction)
    if mine.series is not None:
        own = where.phase
        values["excitation_stiffness"] = mine.series.stiffness.value(own)
        values["excitation_error"] = mine.series.error.value(own) + own_mesh.error.value(own)
    return values


def mean_moments(parts: build.Parts, flanks: list[excitation.MeshFlanks], kind: int, of: Response) -> Array:
    """Return the mean moments of each mesh of a kind over base radius, (n_mesh, (driving, driven)) [N]."""
    mine, moves, means = flanks[kind], parts.moving, []
    for mesh in map(int, clock.of_kind(parts.meshes, kind)):

        def moments(steps: stages.StageGrid, mesh: int = mesh) -> Array:
            phase, segment, _ = mesh_forces.within_steps(steps)
            middle, lag = steps.start + 0.5 * steps.width, parts.meshes[mesh].lag
            where = clock.look_within(mine.analysis.grid, [lag], phase.reshape(len(middle), -1), middle)
            forces = parts.forces(flanks, mesh, where, moves.motions(of, clock.Instants(phase, segment)))
            return mesh_forces.moments(forces, mine, parts.kinds[kind].pair, where, parts.friction)

        means.append(mesh_forces.mean_over_period(moves.sampling.grid, moments).mean(axis=1))
    return np.array(means)


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


def has_bearings(parts: build.Parts) -> bool:
    """Whether a member moves on its support."""
    return parts.vibration is not None and parts.vibration.system.on_bearings


def mode_values(parts: build.Parts) -> Values:
    """Return natural frequencies and the speeds at which the mesh frequency meets them."""
    modes = build.build_modes(parts)
    values = {
        "natural_frequency": modes.modes.frequency,
        "critical_speed": modes.critical_speed[0],
        "mode_participation": modes.modes.participation.T,
    }
    return values if modes.kinds is None else values | {"mode_kind": list(modes.kinds)}


def attractor(lived: history.History) -> Array:
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


def modes_table(scene: Scene) -> list[dict[str, Any]]:
    """Return one row a mode: frequency, what moves, whether the mesh excites it, and its critical speeds.

    A critical speed is that of the input member, as ``operation.speed`` is.

    Parameters
    ----------
    scene : a scene with dynamics

    Raises
    ------
    Refused
        When the scene has no dynamics, or no such gears can exist.
    """
    if scene.dynamics is None:
        raise label.Refused("the scene has no [dynamics]: nothing vibrates")
    try:
        table = build.build_modes(build.build(scene))
    except GearError as error:
        raise label.Refused(str(error)) from error
    modes, size = table.modes, np.abs(table.modes.shape)
    moves = [np.asarray(table.coordinates)[own > 0.3 * own.max()] for own in size]
    columns: dict[str, Any] = {
        "mode": range(1, len(size) + 1),
        "natural_frequency [Hz]": modes.frequency.tolist(),
    }
    if table.kinds is not None:
        columns["kind"] = table.kinds
    columns |= {"moves": map(", ".join, moves), "excited by the mesh": map(bool, modes.excited())}
    columns["participation"] = modes.participation.max(axis=-1).tolist()
    for order, speeds in enumerate(table.critical_speed, 1):
        columns[f"critical speed, order {order} [rpm]"] = (speeds * 30.0 / np.pi).tolist()
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

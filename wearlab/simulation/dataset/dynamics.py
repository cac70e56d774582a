"""The steady responses of a gear set: motions, forces, harmonics, energy.

What a vibration monitor reads off the meshes is in `monitoring`.
"""

from functools import partial
from itertools import pairwise

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces import energy, mesh_forces
from wearlab.dynamics.steady.response import Response
from wearlab.life import coupled, history
from wearlab.life.loads.equivalent import equivalent_force
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, excitation, force, harmonics, stages
from wearlab.simulation import label
from wearlab.simulation.dataset import bearings, monitoring
from wearlab.simulation.dataset.coordinates import States
from wearlab.simulation.label import Values


def dynamic_values(model: assembly.GearModel, states: States) -> Values:
    """Return the steady responses at the stored phases, and what is read off them.

    Averaged slow errors that the set answers to make one response an angle, along
    ``error_angle``.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states that are stored
    """
    lines = monitoring.spectrum_lines(model.moving, states)
    of_states = [
        [_values_of(model, state, response, lines) for response in state.responses]
        for state in states
    ]
    values: Values = {
        name: label.of_states(
            [[of_response[name] for of_response in state] for state in of_states]
        )
        for name in of_states[0][0]
    }
    if "mesh_load_factor" in values and len(states[0].responses) > 1:
        values |= _load_factors_over_turn(model, values["mesh_load_factor"])
    if any(name.endswith("_orders") for name in model.scene.store.requested):
        values["order"] = lines
    return values


def _load_factors_over_turn(model: assembly.GearModel, factors: Array) -> Values:
    """Return extremes of load factors (n_updates, n_angles, n_mesh) over a turn."""
    teeth = [gear.teeth for gear in model.gears.gears.values()]
    extremes = [harmonics.extremes_over_turn(of_state, teeth) for of_state in factors]
    least, largest = np.stack(extremes, axis=1)
    return {"mesh_load_factor_min": least, "mesh_load_factor_max": largest}


def _values_of(
    model: assembly.GearModel,
    state: coupled.WearState,
    response: Response,
    lines: Array,
) -> Values:
    """Return the variables of one response."""
    vibration = model.moving
    instants = vibration.look(model.phase)
    position, velocity = vibration.coordinates(response, instants)

    values = _at_phases(model, state, response, instants)
    values |= _transmission(model, position)
    values |= _forces(model, state, response)
    values |= _energy(model, response)
    values |= _equivalent_loads(model, state)
    if bearings.has_bearings(model):
        values["bearing_force"] = bearings.bearing_values(
            model, position, velocity, values["normal_mesh_force"]
        )
    return values | monitoring.requested_values(model, response, lines)


def _at_phases(
    model: assembly.GearModel,
    state: coupled.WearState,
    response: Response,
    instants: clock.Instants,
) -> Values:
    """Return forces and motions of all meshes at the stored phases."""
    motions = model.moving.motions(response, instants)
    meshes = [
        _mesh_response(model, state.flanks, mesh, motions)
        for mesh in range(len(model.meshes))
    ]
    return {
        name: label.padded([mesh[name] for mesh in meshes], fill=0.0)
        for name in meshes[0]
    }


def _transmission(model: assembly.GearModel, position: Array) -> Values:
    """Return the dynamic transmission error of every mesh, its harmonics and RMS."""
    error = transmission_error(model.moving, position) + model.constant_error[:, None]
    of_meshes = np.moveaxis(error, 1, 0)

    phase = (np.arange(len(position))[:, None] + model.phase).ravel()
    weight = np.full(len(phase), 1.0 / len(phase))
    series = [
        harmonics.harmonics(phase, weight, of_mesh.ravel(), model.harmonics)
        for of_mesh in of_meshes
    ]
    return {
        "dynamic_transmission_error": of_meshes,
        "dte_harmonics": np.stack([mesh.amplitude for mesh in series]),
        "dte_rms": [mesh.rms for mesh in series],
    }


def _forces(
    model: assembly.GearModel, state: coupled.WearState, response: Response
) -> Values:
    """Return extremes of the mesh forces, factors of the static ones, and residuals."""
    vibration = model.moving
    flanks = state.flanks
    values = Values()
    means = _moments_of_sections(model, flanks, response)
    kinds_of_sections = [
        next(kind for kind in model.gears.kinds if kind.section == section)
        for section in means
    ]
    of_sections = list(means.values())
    if model.gears.shares:
        factors = list(map(mesh_forces.load_factors, kinds_of_sections, of_sections))
        values["mesh_load_factor"] = np.concatenate(factors)

    extremes = mesh_forces.extremes(response)
    load_of_kind = np.array([kind.analysis.load for kind in model.kinds])
    load = load_of_kind[[mesh.kind for mesh in model.meshes]]
    rubs = model.friction is not None
    values["mesh_force_min"] = extremes.least
    values["mesh_force_max"] = extremes.largest
    values["dynamic_factor"] = label.ratio(extremes.largest, load)
    values["normal_force_factor"] = label.ratio(extremes.largest_normal, load)
    values["separation_fraction"] = extremes.separated
    values["response_period"] = response.period * vibration.hunting
    values["floquet_multiplier"] = _multipliers(vibration, response)
    values["residual_mean_force"] = mesh_forces.mean_force_residual(
        kinds_of_sections,
        [load_of_kind[model.gears.kinds.index(kind)] for kind in kinds_of_sections],
        of_sections,
        rubs,
    )
    values["residual_orbit"] = response.residual
    return values


def _moments_of_sections(
    model: assembly.GearModel, flanks: list[excitation.MeshFlanks], response: Response
) -> dict[str, Array]:
    """Return mean moments (n_mesh, 2) of the meshes that are made alike, by section."""
    of_sections: dict[str, list[Array]] = {}
    for number, kind in enumerate(model.gears.kinds):
        if not model.gears.is_loaded(number):
            continue
        moments = mean_moments(model, flanks, number, response)
        of_sections.setdefault(kind.section, []).append(moments)
    return {section: np.concatenate(parts) for section, parts in of_sections.items()}


def _multipliers(vibration: Vibration, response: Response) -> Array:
    """Return real and imaginary parts of the Floquet multipliers, padded with NaN."""
    multipliers = np.full((2 * len(vibration.system.coordinates), 2), np.nan)
    complex_values = response.multipliers
    multipliers[: len(complex_values)] = np.stack(
        [np.real(complex_values), np.imag(complex_values)], axis=-1
    )
    return multipliers


def _energy(model: assembly.GearModel, response: Response) -> Values:
    """Return the energy balance of a period, nothing where flanks do not rub."""
    nominal = model.moving.nominal
    if nominal is None or model.friction is None:
        return {}
    balance = energy.energy_balance(response, nominal)
    values: Values = {
        f"energy_{name}": power for name, power in balance._asdict().items()
    }
    values["residual_energy"] = balance.residual
    values["efficiency"] = balance.efficiency
    return values


def _equivalent_loads(model: assembly.GearModel, state: coupled.WearState) -> Values:
    """Return the equivalent load of every mesh, nothing without a Wöhler slope."""
    slope = model.wohler_slope
    if slope is None:
        return {}
    forces = [
        equivalent_force(kind.flanks.analysis, kind.weight, kind.drive, slope)
        for kind in state.kind
    ]
    loads = [model.gears.lever(mesh.kind) * forces[mesh.kind] for mesh in model.meshes]
    return {"equivalent_load": loads}


def phase_forces(
    model: assembly.GearModel, state: coupled.WearState, response: Response
) -> Array:
    """Return the elastic force of every mesh at the stored phases.

    Parameters
    ----------
    model : the physics of the scene
    state : a wear state
    response : one of its responses

    Returns
    -------
    (n_periods, n_mesh, n_phases) [N]
    """
    motions = model.moving.motions(response, model.moving.look(model.phase))
    places = [model.locate(mesh, model.phase) for mesh in range(len(model.meshes))]
    forces = [
        model.forces(state.flanks, mesh, where, motions)
        for mesh, where in enumerate(places)
    ]
    return np.stack([of_mesh.elastic for of_mesh in forces], axis=1)


def _mesh_response(
    model: assembly.GearModel,
    kinds: list[excitation.MeshFlanks],
    mesh: int,
    motions: force.Deflections,
) -> dict[str, Array]:
    """Return what one mesh does at the stored phases.

    Mesh periods come first; of pairs they come after the pairs.
    """
    on_clock = model.meshes[mesh]
    flanks = kinds[on_clock.kind]
    where = model.locate(mesh, model.phase)
    forces = model.forces(kinds, mesh, where, motions)
    deflection = motions.deflection[:, mesh]
    rate = motions.rate[:, mesh]
    values = {
        "dynamic_mesh_force": forces.elastic,
        "normal_mesh_force": forces.normal,
        "mesh_damping_force": forces.normal - forces.elastic,
        "mesh_deflection": deflection,
        "mesh_deflection_rate": rate,
        "poincare_deflection": deflection[:, 0],
        "poincare_rate": rate[:, 0],
    }

    if model.face is None:
        grid = flanks.analysis.grid

        def into_slots(of_pairs: Array) -> Array:
            return np.stack(
                [grid.into_slots(period.T, 0.0) for period in of_pairs], axis=1
            )

        values["pair_force"] = into_slots(forces.pair)
        values["pair_normal_force"] = into_slots(forces.pair_normal)

    if model.friction is not None:
        values["friction_force"] = mesh_forces.friction_force(
            forces, flanks, where, model.friction
        )
    if flanks.series is not None:
        series_error = flanks.series.error.value(where.phase)
        values["excitation_stiffness"] = flanks.series.stiffness.value(where.phase)
        values["excitation_error"] = series_error + on_clock.error.value(where.phase)
    return values


def mean_moments(
    model: assembly.GearModel,
    flanks: list[excitation.MeshFlanks],
    kind: int,
    response: Response,
) -> Array:
    """Return the mean moments of each mesh of a kind over base radius.

    Parameters
    ----------
    model : the physics of the scene
    flanks : flanks of every kind of mesh in one wear state
    kind : number of the kind of mesh
    response : the response whose moments are averaged

    Returns
    -------
    (n_mesh, (driving, driven)) [N]
    """
    vibration = model.moving
    of_kind = flanks[kind]
    pair = model.kinds[kind].pair

    def moments(mesh: int, steps: stages.StageGrid) -> Array:
        phase, segment, _ = mesh_forces.within_steps(steps)
        middle = steps.start + 0.5 * steps.width
        lag = model.meshes[mesh].lag
        within = phase.reshape(len(middle), -1)
        where = clock.locate_within_steps(of_kind.analysis.grid, [lag], within, middle)
        motions = vibration.motions(response, clock.Instants(phase, segment))
        forces = model.forces(flanks, mesh, where, motions)
        return mesh_forces.moments(forces, of_kind, pair, where, model.friction)

    means = []
    for mesh in map(int, clock.of_kind(model.meshes, kind)):
        of_periods = mesh_forces.mean_over_period(
            vibration.sampling.grid, partial(moments, mesh)
        )
        means.append(of_periods.mean(axis=1))
    return np.array(means)


def transmission_error(vibration: Vibration, position: Array) -> Array:
    """Return r_b1 θ1 − r_b2 θ2 of every mesh, (n_periods, n_mesh, n_phases) [m].

    What the rotations alone do along each line of action; in a planetary set those
    beside the carrier's.

    Parameters
    ----------
    vibration : the dynamics
    position : (n_periods, n, n_phases) coordinates [m]
    """
    system = vibration.system
    turns = [name == "mesh.x" or name.endswith(".u") for name in system.coordinates]
    direction = np.where(turns, system.direction, 0.0)
    return np.asarray(np.einsum("pi...,mi->pm...", position, direction))


def attractor_numbers(life_history: history.History) -> Array:
    """Return which branch each kept response is on, counted from 1 along the life.

    The count rises where the wear rate jumped, and where the period of the response
    changes.

    Parameters
    ----------
    life_history : the wear states that are kept, and the jumps of the life

    Returns
    -------
    (n_updates,)
    """
    life = life_history.life
    jumps = [] if life is None else [jump.cycle for jump in life.jumps]
    periods = [
        tuple(response.period for response in state.responses)
        for state in life_history.state
    ]
    numbers = [1]
    for (period, next_period), (start, end) in zip(
        pairwise(periods), pairwise(life_history.cycle), strict=True
    ):
        passed = sum(start < jump <= end for jump in jumps)
        changes = int(period != next_period)
        numbers.append(numbers[-1] + max(passed, changes))
    return np.array(numbers, float)

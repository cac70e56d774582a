"""The arrays of a gear pair's life, named as the dataset names them."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response
from wearlab.life.history import History
from wearlab.life.state import Vibration, WearState
from wearlab.mesh.contact import Quasistatic
from wearlab.mesh.errors import MeshError
from wearlab.mesh.excitation import load_share, mesh_force
from wearlab.mesh.harmonics import Harmonics, harmonics
from wearlab.mesh.profile import Lookup
from wearlab.scene import Scene
from wearlab.scene.build import PairParts
from wearlab.scene.build.modes import SceneModes
from wearlab.simulate.label import padded
from wearlab.wear.archard import PEAK_PRESSURE, mean_pressure
from wearlab.wear.film import film_thickness
from wearlab.wear.law import effective_coefficient
from wearlab.wear.mass import worn_mass
from wearlab.wear.path import sliding_velocity, specific_sliding

Array = NDArray[np.float64]
Values = dict[str, Any]

POINT_TOLERANCE = 1e-12


def coordinates(parts: PairParts) -> Values:
    """Return the labels of the dimensions and the places of the nodes on each flank."""
    s = parts.analysis.grid.position
    pair, order = parts.pair, parts.order
    pitch = [gear.base_radius / np.cos(pair.working_pressure_angle) for gear in pair.gears]
    radius = np.stack([pair.radius(gear, s) for gear in order])
    return {
        "flank": list(parts.names),
        "member": list(parts.names),
        "mesh": ["-".join(parts.names)],
        "phase": parts.phase,
        "pair": np.arange(1, parts.analysis.grid.n_pairs + 2),
        "harmonic": np.arange(1, parts.harmonics + 1),
        "path_position": np.stack([s, s]),
        "diameter": 2.0 * radius,
        "roll_angle": np.stack([pair.roll_angle(gear, s) for gear in order]),
        "distance_to_pitch_circle": radius - np.array([pitch[gear] for gear in order])[:, None],
        "characteristic_point": characteristic_points(parts),
        "flank_side": [parts.drive_flank] * 2,
    }


def characteristic_points(parts: PairParts) -> list[str]:
    """Return the letter of each node that is one of the points A–E, else an empty string, (n,)."""
    letters = [""] * len(parts.analysis.grid.position)
    for letter, where in parts.pair.path._asdict().items():
        for node in np.flatnonzero(np.abs(parts.analysis.grid.position - where) < POINT_TOLERANCE):
            letters[node] = letter
    return letters


def mesh_values(parts: PairParts, states: tuple[WearState, ...]) -> Values:
    """Return what the quasi-static contact analysis says at the stored phases."""
    where, error = parts.output, parts.error
    solved = [parts.analysis.quasistatic(state.nodes, where) for state in states]
    prescribed = error.value(where.phase) + parts.constant_error
    ste = np.stack([one.deflection for one in solved]) + prescribed
    unloaded = np.stack([one.unloaded for one in solved]) + prescribed
    values: Values = {
        "mesh_stiffness": np.stack([one.tangent for one in solved])[:, None],
        "secant_stiffness": np.stack([_secant(parts.analysis.load, one) for one in solved])[:, None],
        "static_transmission_error": ste[:, None],
        "unloaded_transmission_error": unloaded[:, None],
        "pair_stiffness": np.stack([_slots(one.stiffness) for one in solved])[:, None],
        "load_share": np.stack([_slots(load_share(one)) for one in solved])[:, None],
        "mesh_frequency": [parts.mesh_frequency],
        "contact_ratio": [parts.pair.contact_ratio],
        "mesh_phase_offset": [0.0],
        "static_mesh_force": [parts.analysis.load],
        "residual_load_share": [_share_residual(parts.analysis.load, one) for one in solved],
    }
    return values | _static_harmonics(parts, states) | _slow_error(error)


def _secant(load: float, state: Quasistatic) -> Array:
    """Return F/(δ − e), (n_phases,); without load its limit, the tangent [N/m]."""
    if load == 0.0:
        return state.tangent
    return np.asarray(load / (state.deflection - state.unloaded))


def _share_residual(load: float, state: Quasistatic) -> float:
    """Return the largest |Σ load shares − 1|; without load there is nothing to share."""
    return float(np.max(np.abs(load_share(state).sum(axis=1) - 1.0))) if load > 0.0 else 0.0


def _slots(values: Array) -> Array:
    """Return (n_pairs + 1, n_phases): the last slot is the pair that approaches A, here never in contact."""
    return np.vstack([values.T, np.zeros(len(values))])


def _static_harmonics(parts: PairParts, states: tuple[WearState, ...]) -> Values:
    phase, weight = parts.analysis.grid.phase_nodes
    prescribed = parts.error.value(phase) + parts.constant_error
    values = _harmonic_values(
        "stiffness", [harmonics(phase, weight, s.static.tangent, parts.harmonics) for s in states]
    )
    return values | _harmonic_values(
        "ste", [harmonics(phase, weight, s.static.deflection + prescribed, parts.harmonics) for s in states]
    )


def _harmonic_values(name: str, found: list[Harmonics]) -> Values:
    return {
        f"{name}_mean": np.array([[one.mean] for one in found]),
        f"{name}_rms": np.array([[one.rms] for one in found]),
        f"{name}_harmonics": np.stack([one.amplitude[None] for one in found]),
        f"{name}_harmonics_phase": np.stack([one.phase[None] for one in found]),
    }


def _slow_error(error: MeshError) -> Values:
    """Return the once-per-revolution error over equally weighted member angles, when there is one."""
    if not len(error.slow_amplitude):
        return {}
    points = 8
    members = np.unique(error.member_teeth)
    angles = np.stack(np.meshgrid(*[np.arange(points) / points] * len(members), indexing="ij"))
    turned = angles.reshape(len(members), -1)
    index = np.searchsorted(members, error.member_teeth)
    angle = 2 * np.pi * turned[index] + error.slow_phase[:, None]
    slow = error.slow_amplitude @ np.sin(angle)
    return {"slow_error": slow[None], "error_weight": np.full(len(slow), 1.0 / len(slow))}


def path_values(parts: PairParts, states: tuple[WearState, ...]) -> Values:
    """Return forces, pressures, sliding and film where the flanks touch."""
    path, order = parts.wear_path, parts.order
    forces = [state.tooth_force.mean(axis=0) for state in states]
    factor = PEAK_PRESSURE if parts.peak_pressure else 1.0
    both = len(order)
    steady = np.ones((len(states), 1, 1))
    values: Values = {
        "tooth_force": np.stack([np.stack([force] * both) for force in forces]),
        "contact_pressure": np.stack([np.stack([factor * mean_pressure(f, path)] * both) for f in forces]),
        "sliding_velocity": steady * sliding_velocity(path)[order],
        "specific_sliding": steady * specific_sliding(path)[order],
    }
    if parts.film is not None:
        thickness = np.stack([np.stack([film_thickness(parts.film, path, f)] * both) for f in forces])
        values["film_thickness"] = thickness
        values["lambda_ratio"] = thickness / parts.film.roughness
    if parts.law is not None:
        values["effective_wear_coefficient"] = np.stack(
            [effective_coefficient(parts.law, force)[order] for force in forces]
        )
    return values


def wear_values(parts: PairParts, cycle: Array, states: tuple[WearState, ...]) -> Values:
    """Return depths, rates, worn mass and the counts of cycles."""
    order, gears = parts.order, [parts.pair.gears[i] for i in parts.order]
    depth = np.stack([state.wear[order] for state in states])
    values: Values = {
        "wear_depth": depth,
        "flank_deviation": -(depth + parts.modification[order]),
        "max_wear_depth": depth.max(axis=2),
        "worn_mass": worn_mass(
            np.stack([state.wear for state in states]),
            parts.wear_path,
            density=[gear.material.density for gear in parts.pair.gears],
            teeth=[gear.teeth for gear in parts.pair.gears],
        )[:, order],
        "mesh_cycles": cycle * gears[0].teeth,
        "load_cycles": cycle[:, None] * parts.wear_path.passes[order],
    }
    if parts.speed > 0.0:
        values["operating_hours"] = cycle * 2 * np.pi / parts.speed
    if all(state.rate is not None for state in states):
        values["wear_rate"] = np.stack([state.rate[order] for state in states if state.rate is not None])
    return values


def dynamic_values(parts: PairParts, states: tuple[WearState, ...]) -> Values:
    """Return the steady responses at the stored phases, and what is read off them."""
    vibration = parts.vibration
    assert vibration is not None
    each = [_response_values(parts, vibration, state) for state in states]
    along_periods = {"bearing_force": 2, "pair_force": 2}
    values: Values = {}
    for name in each[0]:
        arrays = [np.asarray(one[name]) for one in each]
        ragged = arrays[0].ndim > 0 and len({array.shape for array in arrays}) > 1
        values[name] = padded(arrays, along_periods.get(name, 1)) if ragged else np.stack(arrays)
    return values


def _response_values(parts: PairParts, vibration: Vibration, state: WearState) -> Values:
    response, where = state.response, parts.output
    assert response is not None
    deflection, rate = vibration.deflection(response, where)
    position, velocity = vibration.coordinates(response, where)
    forces = [
        mesh_force(parts.analysis, state.nodes, state.fitted, where, one, vibration.backlash)
        for one in deflection
    ]
    elastic = np.stack([force.elastic for force in forces])
    transmission = transmission_error(vibration, position) + parts.constant_error
    found = _over_periods(transmission, where, parts.harmonics)
    static = parts.analysis.load
    values: Values = {
        "dynamic_mesh_force": elastic[None],
        "mesh_damping_force": damping_force(parts, vibration, state, where, deflection, rate)[None],
        "mesh_deflection": deflection[None],
        "mesh_deflection_rate": rate[None],
        "dynamic_transmission_error": transmission[None],
        "pair_force": np.stack([_slots(force.pair) for force in forces], axis=1)[None],
        "dte_harmonics": found.amplitude[None],
        "dte_rms": [found.rms],
        "poincare_deflection": deflection[:, :1].T,
        "poincare_rate": rate[:, :1].T,
        "dynamic_factor": [elastic.max() / static if static > 0.0 else np.nan],
        "separation_fraction": [separated(parts, vibration, state)],
        "response_period": response.period * vibration.hunting,
        "floquet_multiplier": _as_parts(response, 2 * len(vibration.system.coordinates)),
        "residual_mean_force": mean_force_residual(parts, vibration, state),
        "residual_orbit": response.residual,
    }
    if parts.wohler_slope is not None:
        force = parts.coupling.equivalent_force(state.elastic, parts.wohler_slope)
        values["equivalent_load"] = [force * parts.pair.gears[parts.order[0]].base_radius]
    if parts.has_bearings:
        values["bearing_force"] = _bearing_force(parts, vibration, position, velocity)
    if state.fitted is not None:
        values["excitation_stiffness"] = state.fitted.stiffness.value(where.phase)[None]
        values["excitation_error"] = (state.fitted.error.value(where.phase) + parts.error.value(where.phase))[
            None
        ]
    return values


def damping_force(
    parts: PairParts, vibration: Vibration, state: WearState, where: Lookup, deflection: Array, rate: Array
) -> Array:
    """Return c δ̇, 0 in separation unless the damping acts always, (n_periods, n_phases) [N]."""
    force = vibration.system.mesh_damping[0] * rate
    if vibration.system.damping_always:
        return force
    return np.where(touching(parts, vibration, state, where, deflection), force, 0.0)


def touching(
    parts: PairParts, vibration: Vibration, state: WearState, where: Lookup, deflection: Array
) -> NDArray[np.bool_]:
    """Return whether any flank, drive or back, is in contact, (n_periods, n_phases)."""
    if state.fitted is None:
        _, gap, _ = parts.analysis.at(state.nodes, where)
        contact = deflection > gap.min(axis=1)
    else:
        contact = deflection > 0.0
    return contact if vibration.backlash is None else contact | (deflection < -vibration.backlash)


def separated(parts: PairParts, vibration: Vibration, state: WearState) -> float:
    """Return the fraction of time in which no drive flank touches [1]."""
    assert state.response is not None
    phases = (np.arange(2048) + 0.5) / 2048
    where = parts.look(phases)
    deflection, _ = vibration.deflection(state.response, where)
    if state.fitted is None:
        _, gap, _ = parts.analysis.at(state.nodes, where)
        return float(np.mean(deflection <= gap.min(axis=1)))
    return float(np.mean(deflection <= 0.0))


def mean_force_residual(parts: PairParts, vibration: Vibration, state: WearState) -> float:
    """Return mean(elastic + damping) over the static force, minus one."""
    assert state.response is not None
    where = parts.analysis.at_nodes
    _, weight = parts.analysis.grid.phase_nodes
    deflection, rate = vibration.deflection(state.response, where)
    damping = damping_force(parts, vibration, state, where, deflection, rate)
    mean = float(((state.elastic + damping) @ weight).mean())
    return mean / parts.analysis.load - 1.0 if parts.analysis.load > 0.0 else mean


def transmission_error(vibration: Vibration, position: Array) -> Array:
    """Return r_b1 θ1 − r_b2 θ2 from the coordinates, (n_periods, n_phases) [m]."""
    names = vibration.system.coordinates
    if "mesh.x" in names:
        return position[:, names.index("mesh.x")]
    driving, driven = (i for i, name in enumerate(names) if name.endswith(".u"))
    return position[:, driving] - position[:, driven]


def _over_periods(values: Array, where: Lookup, count: int) -> Harmonics:
    periods = len(values)
    turned = (np.arange(periods)[:, None] + where.phase).ravel()
    return harmonics(turned, np.full(values.size, 1.0 / values.size), values.ravel(), count)


def _bearing_force(parts: PairParts, vibration: Vibration, position: Array, velocity: Array) -> Array:
    """Return −(k y + c ẏ) of each member, (member, axis, n_periods, n_phases) [N]; nothing along x."""
    system, names = vibration.system, vibration.system.coordinates
    force = np.zeros((2, 2, *position[:, 0].shape))
    for row, member in enumerate(parts.names):
        i = names.index(f"{member}.y")
        force[row, 1] = -(system.stiffness[i, i] * position[:, i] + system.damping[i, i] * velocity[:, i])
    return force


def _as_parts(response: Response, count: int) -> Array:
    """Return the multipliers by descending modulus, (count, 2) real and imaginary, NaN when aperiodic."""
    values = np.full((count, 2), np.nan)
    found = response.multipliers[np.argsort(-np.abs(response.multipliers), kind="stable")]
    values[: len(found)] = np.stack([found.real, found.imag], axis=1)
    return values


def mode_values(found: SceneModes) -> Values:
    """Return natural frequencies and the speeds at which the mesh frequency meets them."""
    return {
        "natural_frequency": found.modes.frequency,
        "critical_speed": found.critical_speed[0],
        "mode_participation": found.modes.participation.T,
    }


def attractor(lived: History) -> NDArray[np.float64]:
    """Return which branch each kept response is on, counted from 1 along the life, (n_updates,).

    The count rises where the wear rate jumped, and where the period of the response changes.
    """
    jumps = [] if lived.life is None else [jump.cycle for jump in lived.life.jumps]
    periods = [state.response.period for state in lived.state if state.response is not None]
    branch = [1]
    for (before, after), (start, end) in zip(pairwise(periods), pairwise(lived.cycle), strict=True):
        passed = sum(start < jump <= end for jump in jumps)
        branch.append(branch[-1] + max(passed, int(before != after)))
    return np.array(branch, float)


def life_values(scene: Scene, parts: PairParts, lived: History) -> Values:
    """Return the life to a depth limit and what is left of it at every kept state."""
    if lived.life is None or scene.wear is None or scene.wear.until is None:
        return {}
    values: Values = {"end_reason": lived.life.end_reason}
    if scene.wear.until.depth is None:
        return values
    life = float(lived.life.cycle[-1]) if lived.life.end_reason == "depth" else np.nan
    values |= {"life": life, "remaining_useful_life": life - lived.cycle}
    if parts.speed > 0.0:
        values["service_life"] = life * 2 * np.pi / parts.speed
    return values

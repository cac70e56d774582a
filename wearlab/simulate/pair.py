"""The arrays of a gear pair's life, named as the dataset names them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.life.history import History
from wearlab.life.state import WearState
from wearlab.mesh.contact import Quasistatic
from wearlab.mesh.errors import MeshError
from wearlab.mesh.excitation import load_share
from wearlab.mesh.harmonics import Harmonics, harmonics
from wearlab.scene import Scene
from wearlab.scene.build import PairParts
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
        "pair_stiffness": np.stack([pair_slots(one.stiffness) for one in solved])[:, None],
        "load_share": np.stack([pair_slots(load_share(one)) for one in solved])[:, None],
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


def pair_slots(values: Array) -> Array:
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

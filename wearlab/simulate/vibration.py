"""The arrays of a gear pair's steady responses, named as the dataset names them."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response
from wearlab.life.history import History
from wearlab.life.state import Vibration, WearState
from wearlab.mesh.excitation import mesh_force
from wearlab.mesh.harmonics import Harmonics, harmonics
from wearlab.mesh.profile import Lookup
from wearlab.scene.build import PairParts
from wearlab.scene.build.modes import SceneModes
from wearlab.simulate.label import padded
from wearlab.simulate.pair import pair_slots

Array = NDArray[np.float64]
Values = dict[str, Any]


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
        "pair_force": np.stack([pair_slots(force.pair) for force in forces], axis=1)[None],
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

"""The arrays of flanks with a width, named as the dataset names them."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.helix import overlap_ratio
from wearlab.life.face import FaceKind, FaceState
from wearlab.life.history import History
from wearlab.life.state import WearState
from wearlab.mesh.face.grid import FaceGrid
from wearlab.mesh.harmonics import harmonics
from wearlab.scene.build import Parts
from wearlab.simulation.static import by_flank, counts, harmonic_values
from wearlab.wear.path import mean_pressure, sliding_velocity, worn_area

Values = dict[str, Any]


def coordinates(parts: Parts) -> Values:
    """Return where the slices lie, nothing where flanks have no width."""
    return {} if parts.face is None else {"face_position": _of(parts).contact.grid.position}


def _of(parts: Parts) -> FaceKind:
    """Return the one kind of mesh of a pair."""
    assert parts.face is not None
    return parts.face.kinds[0]


def states_of(states: Sequence[WearState]) -> list[FaceState]:
    """Return the states of the one mesh."""
    return [cast("FaceState", state.kind[0]) for state in states]


def mesh_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return what the contact over the face says of the mesh, at the stored phases and over the face."""
    contact, own = _of(parts).contact, states_of(states)
    grid, gears = contact.grid, parts.gears
    clock = grid.phase + float(gears.mesh_lags[0])
    load = contact.analysis.load
    stored = parts.phase - float(gears.mesh_lags[0])

    def at_stored(each: list[Array]) -> Array:
        return np.stack([grid.at_phases(values, stored % 1.0) for values in each])[:, None]

    deflection, tangent = [one.loads.deflection for one in own], [one.loads.tangent for one in own]
    of_stiffness = [harmonics(clock, grid.weight, values, parts.harmonics) for values in tangent]
    of_error = [harmonics(clock, grid.weight, values, parts.harmonics) for values in deflection]
    means = [mean_line_load(grid, one.loads.load) for one in own]
    normal_module = gears.kinds[0].pair.driving.module * np.cos(contact.helix.angle)
    found = harmonic_values("stiffness", of_stiffness) | harmonic_values("ste", of_error)
    values: Values = {name: value[:, None] for name, value in found.items()}
    values |= {
        "mesh_stiffness": at_stored(tangent),
        "static_transmission_error": at_stored(deflection),
        "unloaded_transmission_error": at_stored([one.loads.unloaded for one in own]),
        "ste_peak_to_peak": np.array([[np.ptp(values)] for values in deflection]),
        "ste_max": np.array([[values.max()] for values in deflection]),
        "mesh_frequency": [gears.mesh_frequency],
        "contact_ratio": [gears.kinds[0].pair.contact_ratio],
        "mesh_phase_offset": gears.mesh_lags,
        "static_mesh_force": [load],
        "base_helix_angle": [contact.helix.sense * contact.helix.base_angle],
        "overlap_ratio": [overlap_ratio(grid.face_width, contact.helix.angle, normal_module)],
        "line_load": np.stack([one.line_load for one in own])[:, None],
        "mean_line_load": np.stack(means)[:, None],
    }
    if load > 0.0:
        values |= {
            "face_load_factor": [[face_load_factor(grid, mean, normal_module)] for mean in means],
            "peak_line_load_factor": [[one.loads.load.max() * grid.face_width / load] for one in own],
            "residual_line_load": [np.abs(contact.residuals(one.loads, load)).max() for one in own],
        }
    return values


def mean_line_load(grid: FaceGrid, load: Array) -> Array:
    """Return the load of all lines per face width, mean over the mesh period, (n_face,) [N/m].

    Parameters
    ----------
    grid : slices and phases
    load : (n_phases, n_lines, n_face) line loads [N/m]
    """
    part = np.where(grid.node >= 0, grid.filled[grid.node], 0.0)
    return np.asarray(grid.weight @ (load * part).sum(axis=1))


def face_load_factor(grid: FaceGrid, mean: Array, window: float) -> float:
    """Return K_Hβ: the largest over the mean of a load over the face, averaged over a window [1].

    Parameters
    ----------
    grid : slices
    mean : (n_face,) load per width [N/m]
    window : width over which it is averaged, which stays within the face [m]

    References
    ----------
    ISO 6336-1:2019, 7, for the ratio; the window is wearlab's.
    """
    edges = np.concatenate([[0.0], np.cumsum(grid.width)])
    carried = np.concatenate([[0.0], np.cumsum(mean * grid.width)])
    total = float(edges[-1])
    window = min(window, total)
    begin = np.clip(np.concatenate([edges, edges - window]), 0.0, total - window)
    within = np.interp(begin + window, edges, carried) - np.interp(begin, edges, carried)
    return float(within.max() / window / (carried[-1] / total))


def path_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return pressures and sliding where the flanks touch."""
    kind, section = _of(parts), parts.kinds[0]
    width = section.path.face_width
    wide = np.stack(
        [
            parts.pressure_factor * mean_pressure(one.line_load * width, section.path)
            for one in states_of(states)
        ]
    )
    steady = np.ones((len(states), 1, 1))
    both = np.stack([wide] * len(parts.gears.flanks), axis=1)
    assert both.shape[2:] == kind.shape
    return {
        "contact_pressure": both,
        "sliding_velocity": steady * by_flank(parts, [sliding_velocity(section.path)]),
        "specific_sliding": steady * by_flank(parts, [section.path.specific_sliding]),
    }


def over_flanks(parts: Parts, values: Array) -> Array:
    """Return values of the mesh (…, 2, n_face, n) in the order of the flanks of datasets."""
    order = [gear for _, gear in parts.gears.flank_places]
    return np.take(values, order, axis=-3)


def wear_values(parts: Parts, lived: History) -> Values:
    """Return depths, rates, worn mass and the counts of cycles and operating time, (n_updates, …)."""
    own, contact = states_of(lived.state), _of(parts).contact
    depth = np.stack([one.wear for one in own])
    on_purpose = parts.kinds[0].modification * contact.helix.cosine
    removed = depth + contact.lead + on_purpose[:, None, :]
    values: Values = {
        "wear_depth": over_flanks(parts, depth),
        "flank_deviation": -over_flanks(parts, removed),
        "worn_mass": worn_masses(parts, depth),
        **counts(parts, lived),
    }
    if all(one.rate is not None for one in own):
        values["wear_rate"] = over_flanks(parts, np.stack([np.asarray(one.rate) for one in own]))
    return values


def worn_volume(parts: Parts, depth: Array) -> Array:
    """Return the volume worn off one tooth of each gear, ``Σ h dL_p dy/cos β_b``, (n_updates, 2) [m³].

    Parameters
    ----------
    parts : the physics
    depth : (n_updates, 2, n_face, n) along the normal [m]
    """
    contact = _of(parts).contact
    area = worn_area(np.moveaxis(depth, 2, 1), parts.kinds[0].path)
    return np.asarray(np.tensordot(area, contact.grid.width, (1, 0)) / contact.helix.cosine)


def worn_masses(parts: Parts, depth: Array) -> Array:
    """Return the mass worn off every member, every tooth alike, (n_updates, n_members) [kg]."""
    volume, total = worn_volume(parts, depth), np.zeros((len(depth), len(parts.gears.members)))
    for number, gear in enumerate(parts.kinds[0].pair.gears):
        for column in parts.gears.columns_of(gear.name):
            total[:, column] += volume[:, number] * gear.teeth * gear.material.density
    return total

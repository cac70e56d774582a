"""The arrays of flanks with a width, named as the dataset names them.

Estimates of the numerical error of a life over the face: of its steps, and of nodes and slices.

The first and the last state are evaluated once more with half the nodes and half the slices; what the wear
rate changes by there, relative to the fastest, counts for all that was worn.
"""

import math
import time
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from scipy.interpolate import interp1d

from wearlab.arrays import Array
from wearlab.dynamics.forces.extremes import extremes
from wearlab.gears.helix import overlap_ratio
from wearlab.life.coupled import Wear, WearState
from wearlab.life.face import FaceKind, FaceState
from wearlab.life.history import History
from wearlab.mesh.face.grid import FaceGrid
from wearlab.mesh.harmonics import harmonics
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.face import slices_of
from wearlab.scene.build.mesh import profile_points
from wearlab.simulation.estimates import Estimates, ForcesOfStates
from wearlab.simulation.label import padded
from wearlab.simulation.operating import Stage, coupled
from wearlab.simulation.static import by_flank, by_member, counts, harmonic_values, of_set, thickness
from wearlab.wear.path import mean_pressure, sliding_velocity, worn_area

Values = dict[str, Any]


def coordinates(parts: Parts) -> Values:
    """Return where the slices lie, nothing where flanks have no width; they are those of every mesh."""
    return {} if parts.face is None else {"face_position": _kinds(parts)[0].contact.grid.position}


def _kinds(parts: Parts) -> tuple[FaceKind, ...]:
    """Return the kinds of mesh of a set whose flanks have a width."""
    assert parts.face is not None
    return parts.face.kinds


def states_of(states: Sequence[WearState], kind: int) -> list[FaceState]:
    """Return the states of one kind of mesh."""
    return [cast("FaceState", state.kind[kind]) for state in states]


def mesh_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return what the contact over the face says of the meshes, at the stored phases and over the face."""
    gears = parts.gears
    each = [_of_mesh(parts, mesh, states_of(states, own.kind)) for mesh, own in enumerate(parts.meshes)]
    values: Values = {name: padded([own[name] for own in each], 1) for name in each[0]}
    values |= of_set(parts)
    contacts = [_kinds(parts)[mesh.kind].contact for mesh in parts.meshes]
    values["base_helix_angle"] = [contact.helix.sense * contact.helix.base_angle for contact in contacts]
    values["overlap_ratio"] = [
        overlap_ratio(contact.grid.face_width, contact.helix.angle, normal_module(parts))
        for contact in contacts
    ]
    if all(kind.load > 0.0 for kind in gears.kinds):
        values["residual_line_load"] = [
            max(
                np.abs(kind.contact.residuals(cast("FaceState", own).loads, kind.contact.analysis.load)).max()
                for kind, own in zip(_kinds(parts), state.kind, strict=True)
            )
            for state in states
        ]
    return values


def normal_module(parts: Parts) -> float:
    """Return the module of the normal section [m]."""
    return parts.kinds[0].pair.driving.module * math.cos(_kinds(parts)[0].contact.helix.angle)


def _of_mesh(parts: Parts, mesh: int, own: list[FaceState]) -> dict[str, Array]:
    """Return the contact of one mesh, every array with the updates first."""
    contact, lag = _kinds(parts)[parts.meshes[mesh].kind].contact, parts.meshes[mesh].lag
    grid, load = contact.grid, contact.analysis.load
    clock, stored = grid.phase + lag, (parts.phase - lag) % 1.0

    def at_stored(each: list[Array]) -> Array:
        return np.stack([grid.at_phases(values, stored) for values in each])

    deflection, tangent = [one.loads.deflection for one in own], [one.loads.tangent for one in own]
    of_stiffness = [harmonics(clock, grid.weight, values, parts.harmonics) for values in tangent]
    of_error = [harmonics(clock, grid.weight, values, parts.harmonics) for values in deflection]
    means = [mean_line_load(grid, one.loads.load) for one in own]
    values = {
        **harmonic_values("stiffness", of_stiffness),
        **harmonic_values("ste", of_error),
        "mesh_stiffness": at_stored(tangent),
        "static_transmission_error": at_stored(deflection),
        "unloaded_transmission_error": at_stored([one.loads.unloaded for one in own]),
        "ste_peak_to_peak": np.array([np.ptp(values) for values in deflection]),
        "ste_max": np.array([values.max() for values in deflection]),
        "line_load": np.stack([one.line_load for one in own]),
        "mean_line_load": np.stack(means),
    }
    if load > 0.0:
        values |= {
            "face_load_factor": np.array(
                [face_load_factor(grid, mean, normal_module(parts)) for mean in means]
            ),
            "peak_line_load_factor": np.array([one.loads.load.max() * grid.face_width / load for one in own]),
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
    steady = np.ones((len(states), 1, 1))
    forces = [
        np.stack([one.line_load for one in states_of(states, kind)]) * section.path.face_width
        for kind, section in enumerate(parts.kinds)
    ]

    def on_both(each: Sequence[Array]) -> Array:
        return by_flank(parts, [np.stack([wide, wide], axis=1) for wide in each], 2)

    pressure = [mean_pressure(force, own.path) for force, own in zip(forces, parts.kinds, strict=True)]
    filmed: Values = {}
    if all(kind.film is not None for kind in parts.kinds):
        film = [
            np.stack([[thickness(own, along) for along in wide] for wide in force])
            for force, own in zip(forces, parts.kinds, strict=True)
        ]
        filmed = {
            "film_thickness": on_both([each[:, :, 0] for each in film]),
            "lambda_ratio": on_both([each[:, :, 1] for each in film]),
        }
    return {
        "contact_pressure": on_both([parts.pressure_factor * each for each in pressure]),
        **filmed,
        "sliding_velocity": steady * by_flank(parts, [sliding_velocity(kind.path) for kind in parts.kinds]),
        "specific_sliding": steady * by_flank(parts, [kind.path.specific_sliding for kind in parts.kinds]),
    }


def wear_values(parts: Parts, lived: History) -> Values:
    """Return depths, rates, worn mass and the counts of cycles and operating time, (n_updates, …)."""
    depths, deviations, rates, masses = [], [], [], []
    for number, kind in enumerate(_kinds(parts)):
        own, contact = states_of(lived.state, number), kind.contact
        depths.append(np.stack([one.wear for one in own]))
        on_purpose = parts.kinds[number].modification * contact.helix.cosine
        deviations.append(-(depths[-1] + contact.lead + on_purpose[:, None, :]))
        rates.append([one.rate for one in own if one.rate is not None])
        gears = parts.kinds[number].pair.gears
        of_all_teeth = worn_volume(parts, number, depths[-1]) * [gear.teeth for gear in gears]
        masses.append(of_all_teeth * [gear.material.density for gear in gears])
    values: Values = {
        "wear_depth": by_flank(parts, depths, 2),
        "flank_deviation": by_flank(parts, deviations, 2),
        "worn_mass": by_member(parts, masses),
        **counts(parts, lived),
    }
    if all(state.wears for state in lived.state):
        values["wear_rate"] = by_flank(parts, [np.stack(each) for each in rates], 2)
    return values


def worn_volume(parts: Parts, kind: int, depth: Array) -> Array:
    """Return the volume worn off one tooth of each gear, ``Σ h dL_p dy/cos β_b``, (n_updates, 2) [m³].

    Parameters
    ----------
    parts : the physics
    kind : of mesh
    depth : (n_updates, 2, n_face, n) along the normal [m]
    """
    contact = _kinds(parts)[kind].contact
    area = worn_area(np.moveaxis(depth, 2, 1), parts.kinds[kind].path)
    return np.asarray(np.tensordot(area, contact.grid.width, (1, 0)) / contact.helix.cosine)


WEIGHT, OF_ENDS = 0.5, 1.5
"""Of the rougher twin's change of rate: a third is what halving a grid of second order leaves. At the ends of
the face of spur gears, and of slices apart, an outermost slice has the gap of its middle: that is of first
order at most, and leaves all of it or more (tests/validation/face_life_estimates.py)."""


BUSY = 0.5
"""Share of the fastest rate from which a node counts: where wear is deepest."""


def rougher(scene: Scene, parts: Parts) -> Parts:
    """Return the physics of a scene on half the nodes and half the slices."""
    mesh = scene.mesh
    for kind in parts.gears.kinds:
        fewer = {"face_points": max(3, slices_of(scene, kind) // 2)}
        own = scene.mesh.of(kind.section).model_copy(update=fewer)
        mesh = mesh.model_copy(update={kind.section: own} if kind.section else fewer)
    numerics = scene.numerics.model_copy(update={"profile_points": profile_points(scene) // 2})
    return build(scene.model_copy(update={"mesh": mesh, "numerics": numerics}))


def estimated_over_face(stage: Stage, lived: History, inherited: float = 0.0) -> Estimates:
    """Estimate the errors of a life at its kept states.

    Parameters
    ----------
    stage : what runs, in all its conditions
    lived : its history
    inherited : error of the wear that the run starts from [m]
    """
    if lived.life is None:
        return Estimates(None, None, None)
    clock = time.perf_counter()
    twins = tuple(rougher(parts.scene, parts) for parts in stage.parts)
    together = coupled(twins, stage.shares)
    ends = [lived.state[0], lived.state[-1]]
    rough = [together.evaluate(_moved(stage.first, twins[0], state.wear)) for state in ends]
    share = max(_apart(stage.first, twins[0], fine, twin) for fine, twin in zip(ends, rough, strict=True))
    share *= _weight(stage.first)
    force = _forces(lived, rough)
    stage.first.coupling.account.seconds["estimates"] += time.perf_counter() - clock
    steps = np.interp(lived.cycle, lived.life.cycle, lived.life.accumulated_error)
    start = lived.state[0].wear
    worn = np.array(
        [
            max(float((own - before).max()) for own, before in zip(state.wear, start, strict=True))
            for state in lived.state
        ]
    )
    life = None
    if lived.life.worn_out:
        life = lived.life.error_estimate_life + share * float(lived.life.cycle[-1])
    return Estimates(inherited + steps + share * worn, force, life)


def _weight(parts: Parts) -> float:
    """Return what of the change of a rougher twin's rate is an error [1]."""
    assert parts.face is not None
    contacts = [kind.contact for kind in parts.face.kinds]
    apart = any(contact.solid is None and contact.shear_length == 0.0 for contact in contacts)
    return OF_ENDS if apart or not contacts[0].helix.angle else WEIGHT


def _moved(parts: Parts, twin: Parts, wear: Wear) -> Wear:
    """Return the wear of a state at the slices and nodes of the rougher twin, each (2, n_face, n) [m]."""
    return tuple(
        moved(own, fine, rough) for own, fine, rough in zip(wear, _grids(parts), _grids(twin), strict=True)
    )


def _grids(parts: Parts) -> list[FaceGrid]:
    assert parts.face is not None
    return [kind.contact.grid for kind in parts.face.kinds]


def _apart(parts: Parts, twin: Parts, fine: WearState, rough: WearState) -> float:
    """Return by how much the rate of the rougher twin differs where wear is fastest, over the fastest [1]."""
    fastest = max(float(rate.max()) for rate in fine.rate)
    if fastest == 0.0:
        return 0.0
    off = [0.0]
    for own, other, grid, its in zip(fine.rate, rough.rate, _grids(parts), _grids(twin), strict=True):
        off += np.abs(moved(other, its, grid) - own)[own >= BUSY * fastest].tolist()
    return max(off) / fastest


def _forces(lived: History, rough: list[WearState]) -> tuple[ForcesOfStates, ...] | None:
    """Return by how much the largest mesh forces of the rougher twin differ, the larger of both states [N].

    The same for the mesh force at any phase and for bearings, which do not carry more. None without dynamics.
    """
    if not lived.state[0].responses:
        return None
    ends = zip((lived.state[0], lived.state[-1]), rough, strict=True)
    off = max(
        float(np.abs(extremes(fine.responses[0]).largest - extremes(twin.responses[0]).largest).max())
        for fine, twin in ends
    )
    each = np.full(len(lived.state), off)
    return (ForcesOfStates(each, each, each),)


def moved(values: Array, own: FaceGrid, wanted: FaceGrid) -> Array:
    """Return values at slices and nodes of another grid, linear between them, (2, n_face, n).

    Parameters
    ----------
    values : (2, n_face, n) on the grid ``own``
    own, wanted : grids of one pair
    """
    along = interp1d(
        _apart_at_steps(own), values, axis=2, bounds_error=False, fill_value=(values[..., 0], values[..., -1])
    )(_apart_at_steps(wanted))
    ends = (along[:, 0], along[:, -1])
    across = interp1d(own.position, along, axis=1, bounds_error=False, fill_value=ends)
    return np.asarray(across(wanted.position))


def _apart_at_steps(grid: FaceGrid) -> Array:
    """Return path positions in which the node before a step lies before the one after it, (n,) [m]."""
    position = grid.profile.position
    return position + 1e-9 * (position[-1] - position[0]) * np.arange(len(position))

"""The arrays of a gear set's life, named as the dataset names them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.life.coupled import WearState
from wearlab.life.history import History
from wearlab.mesh import contact, force, harmonics, profile
from wearlab.mesh.exact.flank import wear_slope
from wearlab.scene import Scene
from wearlab.scene.build import KindParts, Parts
from wearlab.scene.build.wear import build_limits, build_snapshots
from wearlab.simulation.label import padded
from wearlab.wear.films import film_thickness
from wearlab.wear.law import effective_coefficient, lambda_ratio
from wearlab.wear.path import mean_pressure, sliding_velocity, worn_mass

LANDED = 1e-6
"""How near, relatively, a state is to the depth at which it was asked for."""
Values = dict[str, Any]

POINT_TOLERANCE = 1e-12


def coordinates(parts: Parts) -> Values:
    """Return the labels of the dimensions and the places of the nodes on each flank."""
    slots = max(mesh_kind.analysis.grid.slots for mesh_kind in parts.kinds)
    position, radius, roll, beyond = [], [], [], []
    for kind, gear in parts.gears.flank_places:
        mesh_kind = parts.kinds[kind]
        s, own = mesh_kind.analysis.grid.position, mesh_kind.pair.gears[gear]
        position.append(s)
        radius.append(mesh_kind.pair.radius(gear, s))
        roll.append(mesh_kind.pair.roll_angle(gear, s))
        beyond.append(radius[-1] - own.base_radius / np.cos(mesh_kind.pair.working_pressure_angle))
    return {
        "flank": list(parts.gears.flanks),
        "member": list(parts.gears.members),
        "mesh": list(parts.gears.mesh_names),
        "phase": parts.phase,
        "pair": np.arange(1, slots + 1),
        "harmonic": np.arange(1, parts.harmonics + 1),
        "path_position": padded(position, -2),
        "diameter": 2.0 * padded(radius, -2),
        "roll_angle": padded(roll, -2),
        "distance_to_pitch_circle": padded(beyond, -2),
        "characteristic_point": characteristic_points(parts),
        "flank_side": [parts.scene.operation.drive_flank] * len(parts.gears.flanks),
    }


def by_flank(parts: Parts, of_kind: Sequence[Array], along: int = 1) -> Array:
    """Return values of every kind of mesh, each (…, 2, n), flank after flank, (…, n_flanks, n).

    With ``along`` = 2 they are (…, 2, n_face, n), and (…, n_flanks, n_face, n) then.
    """
    axis = -1 - along
    return padded([np.take(of_kind[kind], gear, axis) for kind, gear in parts.gears.flank_places], axis)


def characteristic_points(parts: Parts) -> list[Any]:
    """Return the letter of each node that is one of the points A–E, else an empty string.

    One list (n,) for the two flanks of a pair; a list for each flank where meshes of several kinds differ.
    """
    longest = max(len(mesh_kind.analysis.grid.position) for mesh_kind in parts.kinds)
    points = []
    for mesh_kind in parts.kinds:
        letters = [""] * longest
        for letter, where in mesh_kind.pair.path._asdict().items():
            for node in np.flatnonzero(np.abs(mesh_kind.analysis.grid.position - where) < POINT_TOLERANCE):
                letters[node] = letter
        points.append(letters)
    return points[0] if len(points) == 1 else [points[kind] for kind, _ in parts.gears.flank_places]


def mesh_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return what the quasi-static contact analysis says at the stored phases."""
    each = [_of_mesh(parts, mesh, states) for mesh in range(len(parts.meshes))]
    values: Values = {name: padded([own[name] for own in each], 1, 0.0) for name in each[0]}
    gears = parts.gears
    values |= {
        **of_set(parts),
        "residual_load_share": [
            max(
                _share_residual(gears.kinds[k].load, kind_state.static)
                for k, kind_state in enumerate(state.kind)
            )
            for state in states
        ],
    }
    return values | _slow_error(parts)


def of_set(parts: Parts) -> Values:
    """Return what the gear set alone says of its meshes, (n_mesh,) each."""
    kinds = [parts.gears.kinds[mesh.kind] for mesh in parts.meshes]
    return {
        "mesh_frequency": [parts.gears.mesh_frequency] * len(kinds),
        "contact_ratio": [kind.pair.contact_ratio for kind in kinds],
        "mesh_phase_offset": parts.gears.mesh_lags,
        "static_mesh_force": [kind.load for kind in kinds],
    }


def _of_mesh(parts: Parts, mesh: int, states: tuple[WearState, ...]) -> dict[str, Array]:
    """Return the contact analysis of one mesh, every array with the updates first."""
    own = parts.meshes[mesh]
    kind, where = parts.kinds[own.kind], parts.look(mesh, parts.phase)
    solved = [kind.analysis.quasistatic(state.kind[own.kind].nodes, where) for state in states]
    prescribed = own.error.value(where.phase) + parts.constant_error[mesh]
    values = {
        "mesh_stiffness": np.stack([shared.tangent for shared in solved]),
        "secant_stiffness": np.stack([_secant(kind.analysis.load, shared) for shared in solved]),
        "static_transmission_error": np.stack([shared.deflection for shared in solved]) + prescribed,
        "unloaded_transmission_error": np.stack([shared.unloaded for shared in solved]) + prescribed,
        "pair_stiffness": np.stack([pair_slots(shared.stiffness, kind.analysis.grid) for shared in solved]),
        "load_share": np.stack(
            [pair_slots(force.load_share(shared), kind.analysis.grid) for shared in solved]
        ),
    }
    return values | _static_harmonics(parts, mesh, [state.kind[own.kind].static for state in states])


def _secant(load: float, state: contact.Quasistatic) -> Array:
    """Return F/(δ − e), (n_phases,); without load its limit, the tangent [N/m]."""
    if load == 0.0:
        return state.tangent
    return np.asarray(load / (state.deflection - state.unloaded))


def _share_residual(load: float, state: contact.Quasistatic) -> float:
    """Return the largest |Σ load shares − 1|; without load there is nothing to share."""
    return float(np.max(np.abs(force.load_share(state).sum(axis=1) - 1.0))) if load > 0.0 else 0.0


def pair_slots(values: Array, grid: profile.ProfileGrid) -> Array:
    """Return values (n_phases, n_pairs), 0 where absent, as (slots, n_phases)."""
    return grid.into_slots(values.T, 0.0)


def _static_harmonics(parts: Parts, mesh: int, states: Sequence[contact.Quasistatic]) -> dict[str, Array]:
    own = parts.meshes[mesh]
    phase, weight = parts.kinds[own.kind].analysis.grid.phase_nodes
    prescribed = own.error.value(phase) + parts.constant_error[mesh]
    clock = phase + own.lag
    stiffness = [harmonics.harmonics(clock, weight, state.tangent, parts.harmonics) for state in states]
    ste = [
        harmonics.harmonics(clock, weight, state.deflection + prescribed, parts.harmonics) for state in states
    ]
    values = harmonic_values("stiffness", stiffness) | harmonic_values("ste", ste)
    errors = [state.deflection + prescribed for state in states]
    return values | {"ste_peak_to_peak": np.ptp(errors, axis=1), "ste_max": np.max(errors, axis=1)}


def harmonic_values(name: str, amplitude: list[harmonics.Harmonics]) -> dict[str, Array]:
    """Return mean, RMS, amplitudes and phases of the harmonics of every state, (n_updates, …)."""
    return {
        f"{name}_mean": np.array([state.mean for state in amplitude]),
        f"{name}_rms": np.array([state.rms for state in amplitude]),
        f"{name}_harmonics": np.stack([state.amplitude for state in amplitude]),
        f"{name}_harmonics_phase": np.stack([state.phase for state in amplitude]),
    }


def _slow_error(parts: Parts) -> Values:
    """Return the once-per-revolution errors over equally weighted member angles, when there are any."""
    rows = parts.gears.slow_errors(parts.meshes)
    return {} if rows is None else {"slow_error": rows.T, "error_weight": np.full(len(rows), 1.0 / len(rows))}


def path_values(parts: Parts, states: tuple[WearState, ...]) -> Values:
    """Return forces, pressures, sliding and film where the flanks touch."""
    factor = parts.pressure_factor
    forces = [[state.kind[k].mean_tooth_force for state in states] for k in range(len(parts.kinds))]

    def on_both(of_force: Callable[[KindParts, Array], Array]) -> Array:
        """Return what both flanks of a mesh have in common, (n_updates, n_flanks, n)."""
        each = [
            np.stack([of_force(kind, force) for force in path])
            for kind, path in zip(parts.kinds, forces, strict=True)
        ]
        return by_flank(parts, [np.stack([values_of, values_of], axis=1) for values_of in each])

    steady = np.ones((len(states), 1, 1))
    values: Values = {
        "tooth_force": on_both(lambda of_kind, force: force),
        "contact_pressure": on_both(lambda of_kind, force: factor * mean_pressure(force, of_kind.path)),
        "sliding_velocity": steady * by_flank(parts, [sliding_velocity(kind.path) for kind in parts.kinds]),
        "specific_sliding": steady * by_flank(parts, [kind.path.specific_sliding for kind in parts.kinds]),
    }
    if all(kind.film is not None for kind in parts.kinds):
        values["film_thickness"] = on_both(lambda of_kind, force: thickness(of_kind, force)[0])
        values["lambda_ratio"] = on_both(lambda of_kind, force: thickness(of_kind, force)[1])
    laws = [kind.law for kind in parts.kinds]
    if all(law is not None for law in laws):
        values["effective_wear_coefficient"] = by_flank(
            parts,
            [
                np.stack(
                    [
                        effective_coefficient(law, force, state.kind[k].wear)
                        for force, state in zip(path, states, strict=True)
                    ]
                )
                for k, (law, path) in enumerate(zip(laws, forces, strict=True))
                if law is not None
            ],
        )
    return values


def thickness(kind: KindParts, force: Array) -> tuple[Array, Array]:
    """Return film thickness [m] and λ [1] along the path, both (n,)."""
    assert kind.film is not None
    ratio = None if kind.law is None else lambda_ratio(kind.law, force)
    if ratio is not None:
        return ratio * kind.film.roughness, ratio
    least = film_thickness(kind.film, kind.path, force)
    return least, least / kind.film.roughness


def wear_values(parts: Parts, lived: History) -> Values:
    """Return depths, rates, worn mass and the counts of cycles and operating time (n_updates,) [s]."""
    states = lived.state
    kinds = range(len(parts.kinds))
    depths = [np.stack([state.kind[k].wear for state in states]) for k in kinds]
    masses = [
        worn_mass(
            depth, own.path,
            density=[gear.material.density for gear in own.pair.gears],
            teeth=[gear.teeth for gear in own.pair.gears],
        )
        for depth, own in zip(depths, parts.kinds, strict=True)
    ]  # fmt: skip
    depth = by_flank(parts, depths)
    modification = by_flank(parts, [mesh_kind.modification for mesh_kind in parts.kinds])
    values: Values = {
        "wear_depth": depth,
        "wear_slope": by_flank(parts, list(map(_slopes, parts.kinds, depths))),
        "flank_deviation": -(depth + modification),
        "worn_mass": by_member(parts, masses),
        **counts(parts, lived),
    }
    if all(state.wears for state in states):
        values["wear_rate"] = by_flank(parts, [np.stack([state.rate[k] for state in states]) for k in kinds])
    return values


def counts(parts: Parts, lived: History) -> Values:
    """Return the cycles of meshes and flanks and the operating time of the states, (n_updates, …)."""
    gears = parts.gears
    passes = np.array([gears.kinds[kind].passes[gear] for kind, gear in gears.flank_places])
    values: Values = {
        "mesh_cycles": lived.cycle * gears.reference_teeth,
        "load_cycles": lived.cycle[:, None] * passes,
    }
    if lived.seconds is not None and np.isfinite(lived.seconds).all():
        values["operating_hours"] = lived.seconds
    return values


def _slopes(kind: KindParts, depth: Array) -> Array:
    """Return dh/ds of the worn flanks of one kind of mesh, (n_updates, 2, n) [1]."""
    both = [wear_slope(kind.pair, gear, kind.analysis.grid, depth[:, gear]) for gear in (0, 1)]
    return np.stack(both, axis=1)


def preset_depth(scene: Scene, parts: Parts, states: tuple[WearState, ...]) -> Array | None:
    """Return the depths by which states were asked for, on their flank, (n_updates, n_flank) [m].

    NaN where none was; None where nobody asked by depth.
    """
    coupling, gears = parts.coupling, parts.gears
    snapshots, limit = build_snapshots(scene, gears, coupling), build_limits(scene, gears, coupling)
    if not snapshots.depths:
        return None
    asked = [(depth, snapshots.flank) for depth in snapshots.depths]
    asked += [] if limit.depth is None else [(limit.depth, limit.flank)]
    depths = np.full((len(states), len(gears.flank_places)), np.nan)
    entries = [coupling.entries(*place) for place in gears.flank_places]
    for row, state in zip(depths, states, strict=True):
        wear = coupling.flat(state.wear)
        for depth, flank in asked:
            if abs(float(wear[flank].max()) - depth) <= LANDED * depth:
                row[np.argmax([_deepest(wear, own, flank) for own in entries])] = depth
    return depths


def _deepest(wear: Array, own: slice, among: slice | Index) -> float:
    """Return the largest wear on one flank, of those entries that count [m]."""
    counts = np.zeros(len(wear), bool)
    counts[among] = True
    return float(wear[own][counts[own]].max(initial=-1.0))


def by_member(parts: Parts, of_kinds: Sequence[Array]) -> Array:
    """Return masses of the gears of every kind of mesh (n_updates, 2) member by member, flanks together."""
    total = np.zeros((len(of_kinds[0]), len(parts.gears.members)))
    for own, mass in zip(parts.kinds, of_kinds, strict=True):
        for number, gear in enumerate(own.pair.gears):
            for column in parts.gears.columns_of(gear.name):
                total[:, column] += mass[:, number]
    return total


def life_values(scene: Scene, lived: History) -> Values:
    """Return the life to a depth limit and what is left of it at every kept state."""
    if lived.life is None or scene.wear is None:
        return {}
    values: Values = {"end_reason": lived.life.end_reason}
    if scene.wear.until is None or scene.wear.until.depth is None:
        return values
    reached = lived.life.worn_out
    life = float(lived.life.cycle[-1]) if reached else np.nan
    values |= {"life": life, "remaining_useful_life": life - lived.cycle}
    if lived.seconds is not None and np.isfinite(lived.seconds).all():
        values["service_life"] = float(lived.seconds[-1]) if reached else np.nan
    return values

"""The arrays of a gear set's life, named as the dataset names them: contact, what is worn, how long it lasts.

Those of flanks with a width lie along the face before they do along the profile.

The exact mesh relationship: where pairs touch, which are engaged, how gears lag.
"""

import math
from collections.abc import Callable, Sequence
from typing import cast

import numpy as np

from wearlab import assembly, schema
from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.gears.helix import overlap_ratio
from wearlab.life import coupled, coupling, history
from wearlab.mesh import contact, force, harmonics
from wearlab.mesh.exact import gaps, relation
from wearlab.mesh.exact.flank import wear_slope
from wearlab.mesh.face.contact import FaceContact
from wearlab.scene import Scene
from wearlab.simulation import label
from wearlab.wear import films, law, path

States = tuple[coupled.WearState, ...]
LANDED = 1e-6
"""How near, relatively, a state is to the depth at which it was asked for."""
POINT_TOLERANCE = 1e-12


def coordinates(parts: assembly.GearModel) -> label.Values:
    """Return the labels of the dimensions, and where nodes and slices lie.

    Slices are those of every mesh.
    """
    slots = max(mesh_kind.analysis.grid.slots for mesh_kind in parts.kinds)
    slices = (
        ()
        if parts.face is None
        else (("face_position", parts.face.kinds[0].contact.grid.position),)
    )
    return dict(slices) | {
        "flank": list(parts.gears.flanks),
        "member": list(parts.gears.members),
        "mesh": list(parts.gears.mesh_names),
        "phase": parts.phase,
        "pair": np.arange(1, slots + 1),
        "harmonic": np.arange(1, parts.harmonics + 1),
        "path_position": nodal(parts, lambda pair, gear, s: s),
        "diameter": 2.0 * nodal(parts, GearPair.radius),
        "roll_angle": nodal(parts, GearPair.roll_angle),
        "distance_to_pitch_circle": nodal(parts, _beyond_pitch),
        "characteristic_point": characteristic_points(parts),
        "flank_side": [parts.scene.operation.drive_flank] * len(parts.gears.flanks),
    }


def nodal(
    parts: assembly.GearModel, of: Callable[[GearPair, int, Array], Array]
) -> Array:
    """Return what a pair, one of its gears and path positions tell, flank after flank, (n_flanks, n)."""
    each = [(parts.kinds[kind], gear) for kind, gear in parts.gears.flank_places]
    return label.padded(
        [of(own.pair, gear, own.analysis.grid.position) for own, gear in each]
    )


def _beyond_pitch(pair: GearPair, gear: int, position: Array) -> Array:
    return pair.radius(gear, position) - pair.gears[gear].base_radius / np.cos(
        pair.working_pressure_angle
    )


def by_flank(
    parts: assembly.GearModel, of_kind: Sequence[Array], along: int = 1
) -> Array:
    """Return values of every kind of mesh, each (…, 2, n), flank after flank, (…, n_flanks, n).

    With ``along`` = 2 they are (…, 2, n_face, n), and (…, n_flanks, n_face, n) then.
    """
    axis = -1 - along
    return label.padded(
        [np.take(of_kind[kind], gear, axis) for kind, gear in parts.gears.flank_places],
        axis,
    )


def characteristic_points(parts: assembly.GearModel) -> np.ndarray:
    """Return the letter of each node that is one of the points A–E, else an empty string.

    One row (n,) for the two flanks of a pair; one for each flank where meshes of
    several kinds differ.
    """
    longest = max(len(kind.analysis.grid.position) for kind in parts.kinds)
    points = np.full((len(parts.kinds), longest), "", "U1")
    for letters, own in zip(points, parts.kinds, strict=True):
        for letter, where in own.pair.path._asdict().items():
            letters[
                np.flatnonzero(
                    np.abs(own.analysis.grid.position - where) < POINT_TOLERANCE
                )
            ] = letter
    return (
        points[0]
        if len(points) == 1
        else points[[kind for kind, _ in parts.gears.flank_places]]
    )


def mesh_values(parts: assembly.GearModel, states: States) -> label.Values:
    """Return what the quasi-static contact says at the stored phases, over the face where flanks have one."""
    of_mesh, fill = (_of_pairs, 0.0) if parts.face is None else (_of_lines, np.nan)
    each = [of_mesh(parts, mesh, states) for mesh in range(len(parts.meshes))]
    values: label.Values = {
        name: label.padded([own[name] for own in each], 1, fill) for name in each[0]
    }
    kinds = [parts.gears.kinds[mesh.kind] for mesh in parts.meshes]
    values["mesh_frequency"] = [parts.gears.mesh_frequency] * len(kinds)
    values["contact_ratio"] = [kind.pair.contact_ratio for kind in kinds]
    values["mesh_phase_offset"] = parts.gears.mesh_lags
    values["static_mesh_force"] = [kind.load for kind in kinds]
    return values | (
        _of_shares(parts, states)
        if parts.face is None
        else _of_face(parts, parts.face, states)
    )


def _of_shares(parts: assembly.GearModel, states: States) -> label.Values:
    """Return how well shares add up, and once-per-revolution errors over equally weighted member angles."""
    off = np.zeros((len(states), len(parts.kinds)))
    rows = parts.gears.slow_errors(parts.meshes)
    for number, state in enumerate(states):
        for k, kind in enumerate(state.kind):
            if (
                parts.gears.kinds[k].load > 0.0
            ):  # without load there is nothing to share
                off[number, k] = np.abs(
                    force.load_share(kind.static).sum(axis=1) - 1.0
                ).max()
    values: label.Values = {"residual_load_share": off.max(axis=1)}
    if rows is not None:
        values |= {
            "slow_error": rows.T,
            "error_weight": np.full(len(rows), 1.0 / len(rows)),
        }
    return values


def _of_pairs(parts: assembly.GearModel, mesh: int, states: States) -> dict[str, Array]:
    """Return the contact analysis of one mesh, every array with the updates first."""
    own = parts.meshes[mesh]
    kind = parts.kinds[own.kind]
    where = parts.locate(mesh, parts.phase)
    grid = kind.analysis.grid
    load = kind.analysis.load
    solved = [
        kind.analysis.quasistatic(state.kind[own.kind].flanks.nodes, where)
        for state in states
    ]
    error = own.error.value(where.phase) + parts.constant_error[mesh]
    values = {
        "mesh_stiffness": [one.tangent for one in solved],
        "secant_stiffness": [
            load / (s.deflection - s.unloaded) if load else s.tangent for s in solved
        ],
        "static_transmission_error": [one.deflection + error for one in solved],
        "unloaded_transmission_error": [one.unloaded + error for one in solved],
        "pair_stiffness": [grid.into_slots(one.stiffness.T, 0.0) for one in solved],
        "load_share": [grid.into_slots(force.load_share(one).T, 0.0) for one in solved],
    }
    phase, weight = grid.phase_nodes
    nodal = [state.kind[own.kind].static for state in states]
    error = own.error.value(phase) + parts.constant_error[mesh]
    stiffness = [one.tangent for one in nodal]
    deflection = [one.deflection + error for one in nodal]
    series = _over_period(
        stiffness, deflection, phase + own.lag, weight, parts.harmonics
    )
    return {name: np.stack(each) for name, each in values.items()} | series


def _over_period(
    stiffness: Sequence[Array],
    error: Sequence[Array],
    clock: Array,
    weight: Array,
    count: int,
) -> dict[str, Array]:
    """Return mean, RMS, harmonics and extremes of stiffness and transmission error, (n_updates, …).

    Parameters
    ----------
    stiffness, error : of every state, (n,) at the phases of the clock
    clock, weight : (n,) these phases, and weights of a mean over them
    count : of harmonics
    """
    values = {
        "ste_peak_to_peak": np.ptp(error, axis=1),
        "ste_max": np.max(error, axis=1),
    }
    for name, each in (("stiffness", stiffness), ("ste", error)):
        found = [harmonics.harmonics(clock, weight, own, count) for own in each]
        told = {
            "mean": "mean",
            "rms": "rms",
            "amplitude": "harmonics",
            "phase": "harmonics_phase",
        }
        values |= {
            f"{name}_{told[of]}": np.array([getattr(own, of) for own in found])
            for of in told
        }
    return values


OVER_PHASES = (
    "mesh_stiffness",
    "static_transmission_error",
    "unloaded_transmission_error",
)


def states_of(
    states: Sequence[coupled.WearState], kind: int
) -> list[coupling.FaceState]:
    """Return the states of one kind of mesh whose flanks have a width."""
    return [cast("coupling.FaceState", state.kind[kind]) for state in states]


def _of_face(
    parts: assembly.GearModel, face: coupling.FaceCoupling, states: States
) -> label.Values:
    """Return how the lines of contact lie, and how well their loads add up."""
    contacts = [face.kinds[mesh.kind].contact for mesh in parts.meshes]
    values: label.Values = {
        "base_helix_angle": [one.helix.sense * one.helix.base_angle for one in contacts]
    }
    of_each = [
        (one.grid.face_width, one.helix.angle, normal_module(parts, one))
        for one in contacts
    ]
    values["overlap_ratio"] = [overlap_ratio(*own) for own in of_each]
    if not all(kind.load > 0.0 for kind in parts.gears.kinds):
        return values
    off = np.zeros((len(face.kinds), len(states)))
    for number, kind in enumerate(face.kinds):
        for at, own in enumerate(states_of(states, number)):
            off[number, at] = np.abs(
                kind.contact.residuals(own.loads, kind.contact.analysis.load)
            ).max()
    return values | {"residual_line_load": off.max(axis=0)}


def normal_module(parts: assembly.GearModel, over_face: FaceContact) -> float:
    """Return the module of the normal section [m]."""
    return parts.kinds[0].pair.driving.module * math.cos(over_face.helix.angle)


def _of_lines(parts: assembly.GearModel, mesh: int, states: States) -> dict[str, Array]:
    """Return the contact of one mesh whose flanks have a width, every array with the updates first."""
    assert parts.face is not None
    number = parts.meshes[mesh].kind
    lag = parts.meshes[mesh].lag
    kind = parts.face.kinds[number]
    own = states_of(states, number)
    grid = kind.contact.grid
    load = kind.contact.analysis.load
    stored = (parts.phase - lag) % 1.0
    deflection = [one.loads.deflection for one in own]
    tangent = [one.loads.tangent for one in own]
    values = _over_period(
        tangent, deflection, grid.phase + lag, grid.weight, parts.harmonics
    )
    unloaded = [one.loads.unloaded for one in own]
    for name, each in zip(OVER_PHASES, (tangent, deflection, unloaded), strict=True):
        values[name] = np.stack([grid.at_phases(one, stored) for one in each])
    part = np.where(
        grid.node >= 0, grid.filled[grid.node], 0.0
    )  # of the width of a slice
    means = [
        grid.weight @ (one.loads.load * part).sum(axis=1) for one in own
    ]  # over the mesh period
    values |= {
        "line_load": np.stack([one.line_load for one in own]),
        "mean_line_load": np.stack(means),
    }
    if load > 0.0:
        window = normal_module(parts, kind.contact)
        values["face_load_factor"] = np.array(
            [face_load_factor(grid.width, mean, window) for mean in means]
        )
        peak = [one.loads.load.max() * grid.face_width / load for one in own]
        values["peak_line_load_factor"] = np.array(peak)
    return values


def face_load_factor(width: Array, mean: Array, window: float) -> float:
    """Return K_Hβ: the largest over the mean of a load over the face, averaged over a window [1].

    Parameters
    ----------
    width : (n_face,) of the slices [m]
    mean : (n_face,) load per width [N/m]
    window : width over which it is averaged, which stays within the face [m]

    References
    ----------
    ISO 6336-1:2019, 7, for the ratio; the window is wearlab's.
    """
    edges = np.concatenate([[0.0], np.cumsum(width)])
    carried = np.concatenate([[0.0], np.cumsum(mean * width)])
    total = float(edges[-1])
    window = min(window, total)
    begin = np.clip(np.concatenate([edges, edges - window]), 0.0, total - window)
    within = np.interp(begin + window, edges, carried) - np.interp(
        begin, edges, carried
    )
    return float(within.max() / window / (carried[-1] / total))


def exact_values(
    parts: assembly.GearModel, states: States, failures: list[str]
) -> label.Values:
    """Return the mesh relationship at the stored phases, nothing where no mesh has exact contact.

    All variables of its group in the table of variables; NaN for members not in a mesh,
    and for what fails.
    """
    if all(_meeting(kind.analysis) is None for kind in parts.kinds):
        return {}
    sizes = {
        "update": len(states),
        "member": len(parts.gears.members),
        "mesh": len(parts.meshes),
    }
    sizes["pair"] = max(kind.analysis.grid.slots for kind in parts.kinds)
    sizes |= {"phase": len(parts.phase), "end": 2}
    (own,) = (
        group.variables for group in schema.GROUPS if "engaged" in group.variables
    )
    values: label.Values = {
        name: np.full([sizes[dim] for dim in own[name].dims], np.nan) for name in own
    }
    values |= {
        "engaged": np.zeros(values["engaged"].shape, np.int8),
        "end": ["engages", "leaves"],
    }
    for index, mesh in enumerate(parts.meshes):
        if _meeting(parts.kinds[mesh.kind].analysis) is None:
            continue
        for update, state in enumerate(states):
            told = f"exact mesh relationship of {parts.gears.mesh_names[index]}"
            given = parts, values, (update, index), state.kind[mesh.kind]
            label.diagnosed(told, failures, None, _fill, *given)
    return values


def _meeting(analysis: contact.ContactAnalysis) -> gaps.MeetingGaps | None:
    """Return the gaps of an analysis that know which points meet, None without."""
    return analysis.gaps if isinstance(analysis.gaps, gaps.MeetingGaps) else None


def _fill(
    parts: assembly.GearModel,
    values: label.Values,
    place: tuple[int, int],
    state: coupled.KindState,
) -> None:
    """Fill in what one mesh does in one state: ``place`` is (update, mesh)."""
    update, mesh = place
    kind = parts.meshes[mesh].kind
    pair = parts.kinds[kind].pair
    analysis = parts.kinds[kind].analysis
    grid = analysis.grid
    where = parts.locate(mesh, parts.phase)
    meeting = _meeting(analysis)
    assert meeting is not None
    found = relation.mesh_relation(meeting, state.wear, where.phase, grid.pair_numbers)
    contact = parts.scene.mesh.of(parts.gears.kinds[kind].section).contact
    if contact.by_threshold:
        engaged = found.engaged_by_threshold(pair, contact.threshold)
        single = relation.single_share(meeting.flanks, state.wear, contact.threshold)
    else:
        engaged = np.asarray(
            analysis.quasistatic(state.flanks.nodes, where).force.T > 0.0
        )
        single = float(np.mean(engaged.sum(axis=0) == 1))
    lag = (found.gap - found.unloaded_error) / pair.driven.base_radius
    of_mesh: label.Values = {"engaged": grid.into_slots(engaged.astype(float), 0.0)}
    of_mesh["single_contact_share"] = single
    of_mesh["rotation_lag"] = grid.into_slots(
        np.where(np.isfinite(lag), lag, np.nan), np.nan
    )
    of_mesh["unloaded_transmission_angle"] = (
        found.unloaded_error / pair.driven.base_radius
    )
    if (
        (deepest := float(state.wear.max())) > 0.0
    ):  # how far the first-order form is off, and the depth beyond which it is by 5 %
        depth = relation.depth_of_disagreement(meeting.flanks, state.wear / deepest)
        of_mesh["first_order_excess"] = relation.first_order_excess(
            meeting.flanks, state.wear
        )
        of_mesh["first_order_depth"] = depth if np.isfinite(depth) else np.nan
    for name, value in of_mesh.items():
        values[name][(update, mesh, *map(slice, np.shape(value)))] = value
    touched_alone, turned_alone = relation.lone_ranges(meeting.flanks, state.wear)
    turned = np.where(np.isnan(found.contact_angle), np.nan, found.rotation_angle)
    of_gears: label.Values = {
        "contact_angle": [
            grid.into_slots(angles, np.nan) for angles in found.contact_angle
        ],
        "rotation_angle": [grid.into_slots(angles, np.nan) for angles in turned],
        "meshing_range": relation.meshing_range(found.rotation_angle, engaged),
        "contact_range": relation.meshing_range(found.contact_angle, engaged),
        "lone_meshing_range": turned_alone,
        "lone_contact_range": touched_alone,
        "contact_loss": relation.contact_loss(pair, found.contact_angle, engaged),
    }
    for gear, body in enumerate(pair.gears):
        member = parts.gears.members.index(body.name)
        for name, each in of_gears.items():
            values[name][(update, member, mesh, *map(slice, np.shape(each[gear])))] = (
                each[gear]
            )


def path_values(parts: assembly.GearModel, states: States) -> label.Values:
    """Return forces, pressures, sliding and film where the flanks touch."""
    kinds = parts.kinds
    along = 1 if parts.face is None else 2
    factor = parts.pressure_factor
    forces = [
        np.stack([state.kind[kind].mean_tooth_force for state in states])
        if parts.face is None  # over the face as if all of it carried as much
        else np.stack([one.line_load for one in states_of(states, kind)])
        * own.path.face_width
        for kind, own in enumerate(kinds)
    ]

    def on_both(of_force: Callable[[assembly.MeshKindModel, Array], Array]) -> Array:
        """Return what both flanks of a mesh have in common, (n_updates, n_flanks, …, n)."""
        each = [of_force(*own) for own in zip(kinds, forces, strict=True)]
        return by_flank(parts, [np.stack([own, own], axis=1) for own in each], along)

    steady = np.ones((len(states), 1, 1))
    values: label.Values = (
        {}
        if parts.face is not None
        else {"tooth_force": on_both(lambda kind, load: load)}
    )
    values["contact_pressure"] = on_both(
        lambda kind, load: factor * path.mean_pressure(load, kind.path)
    )
    sliding = [path.sliding_velocity(kind.path) for kind in kinds]
    values["sliding_velocity"] = steady * by_flank(parts, sliding)
    values["specific_sliding"] = steady * by_flank(
        parts, [kind.path.specific_sliding for kind in kinds]
    )
    if all(kind.film is not None for kind in kinds):
        values["film_thickness"] = on_both(lambda kind, load: thickness(kind, load)[0])
        values["lambda_ratio"] = on_both(lambda kind, load: thickness(kind, load)[1])
    laws = [kind.law for kind in kinds if kind.law is not None]
    if len(laws) == len(kinds) and parts.face is None:
        each = list[Array]()
        for kind, (own, load) in enumerate(zip(laws, forces, strict=True)):
            worn = zip(load, _depths(kind, states), strict=True)
            each.append(np.stack([law.effective_coefficient(own, *of) for of in worn]))
        values["effective_wear_coefficient"] = by_flank(parts, each)
    return values


def thickness(kind: assembly.MeshKindModel, load: Array) -> tuple[Array, Array]:
    """Return film thickness [m] and λ [1] along the path, both (…, n), of forces on a pair (…, n) [N]."""
    assert kind.film is not None
    ratio = None if kind.law is None else law.lambda_ratio(kind.law, load)
    if ratio is not None:
        return ratio * kind.film.roughness, ratio
    least = films.film_thickness(kind.film, kind.path, load)
    return least, least / kind.film.roughness


def _depths(kind: int, states: States) -> Array:
    """Return the depths of one kind of mesh, (n_updates, 2, …, n) [m]."""
    return np.stack([state.kind[kind].wear for state in states])


def wear_values(parts: assembly.GearModel, lived: history.History) -> label.Values:
    """Return depths, rates, worn mass and the counts of cycles and operating time (n_updates,) [s]."""
    states = lived.state
    kinds = range(len(parts.kinds))
    along = 1 if parts.face is None else 2
    gears = parts.gears
    depths = [_depths(kind, states) for kind in kinds]
    deviation = [-(depths[kind] + on_purpose(parts, kind)) for kind in kinds]
    values: label.Values = {"wear_depth": by_flank(parts, depths, along)}
    values["flank_deviation"] = by_flank(parts, deviation, along)
    values["worn_mass"] = by_member(
        parts, [worn_mass(parts, kind, depths[kind]) for kind in kinds]
    )
    values["mesh_cycles"] = lived.cycle * gears.reference_teeth
    passes = [gears.kinds[kind].passes[gear] for kind, gear in gears.flank_places]
    values["load_cycles"] = lived.cycle[:, None] * passes
    if lived.seconds is not None and np.isfinite(lived.seconds).all():
        values["operating_hours"] = lived.seconds
    if parts.face is None:
        each = [
            (parts.kinds[k], gear, depths[k][:, gear]) for k, gear in gears.flank_places
        ]
        slopes = [
            wear_slope(own.pair, gear, own.analysis.grid, depth)
            for own, gear, depth in each
        ]
        values["wear_slope"] = label.padded(slopes, -2)
    if all(state.wears for state in states):
        rates = [np.stack([state.rate[kind] for state in states]) for kind in kinds]
        values["wear_rate"] = by_flank(parts, rates, along)
    return values


def on_purpose(parts: assembly.GearModel, kind: int) -> Array:
    """Return what is removed on purpose from the flanks of a kind of mesh, (2, …, n) [m]."""
    modification = parts.kinds[kind].modification
    if parts.face is None:
        return modification
    over_face = parts.face.kinds[kind].contact
    return over_face.lead + (modification * over_face.helix.cosine)[:, None, :]


def worn_mass(parts: assembly.GearModel, kind: int, depth: Array) -> Array:
    """Return the mass worn off each gear of a kind of mesh, (n_updates, 2) [kg].

    Parameters
    ----------
    parts, kind : the physics, and which kind of mesh
    depth : (n_updates, 2, …, n) along the normal [m]
    """
    own = parts.kinds[kind]
    density, teeth = zip(
        *((gear.material.density, gear.teeth) for gear in own.pair.gears), strict=True
    )
    if parts.face is None:
        return path.worn_mass(depth, own.path, density=density, teeth=teeth)
    over_face = parts.face.kinds[kind].contact
    slices = np.moveaxis(depth, 2, 1)
    width = over_face.grid.width[:, None] / over_face.helix.cosine
    return path.worn_mass(
        slices, own.path, density=density, teeth=teeth, face_width=width
    ).sum(axis=1)


def preset_depth(
    scene: Scene, parts: assembly.GearModel, states: States
) -> label.Values:
    """Return the depths by which states were asked for, on their flank, (n_updates, n_flank) [m].

    NaN where none was; nothing where nobody asked by depth.
    """
    coupling = parts.coupling
    gears = parts.gears
    snapshots = assembly.wear.build_snapshots(scene, gears, coupling)
    limit = assembly.wear.build_limits(scene, gears, coupling)
    if not snapshots.depths:
        return {}
    asked = [(depth, snapshots.flank) for depth in snapshots.depths]
    asked += [] if limit.depth is None else [(limit.depth, limit.flank)]
    depths = np.full((len(states), len(gears.flank_places)), np.nan)
    for row, state in zip(depths, states, strict=True):
        wear = coupling.flat(state.wear)
        for depth, flank in asked:
            if abs(float(wear[flank].max()) - depth) <= LANDED * depth:
                counting = np.full(len(wear), -1.0)
                counting[flank] = wear[flank]
                row[
                    np.argmax(
                        [
                            counting[coupling.entries(*own)].max()
                            for own in gears.flank_places
                        ]
                    )
                ] = depth
    return {"preset_depth": depths}


def by_member(parts: assembly.GearModel, of_kinds: Sequence[Array]) -> Array:
    """Return masses of the gears of every kind of mesh (n_updates, 2) member by member, flanks together."""
    total = np.zeros((len(of_kinds[0]), len(parts.gears.members)))
    for own, mass in zip(parts.kinds, of_kinds, strict=True):
        for number, gear in enumerate(own.pair.gears):
            total[:, parts.gears.columns_of(gear.name)] += mass[:, [number]]
    return total


def life_values(scene: Scene, lived: history.History) -> label.Values:
    """Return the life to a depth limit and what is left of it at every kept state."""
    if lived.life is None or scene.wear is None:
        return {}
    values: label.Values = {"end_reason": lived.life.end_reason}
    if scene.wear.until is None or scene.wear.until.depth is None:
        return values
    reached = lived.life.worn_out
    life = float(lived.life.cycle[-1]) if reached else np.nan
    values |= {"life": life, "remaining_useful_life": life - lived.cycle}
    if lived.seconds is not None and np.isfinite(lived.seconds).all():
        values["service_life"] = float(lived.seconds[-1]) if reached else np.nan
    return values

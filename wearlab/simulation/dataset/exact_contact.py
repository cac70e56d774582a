"""The exact mesh relationship: where pairs touch, which are engaged, how gears lag."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from wearlab import assembly, schema
from wearlab.arrays import Array, Flags
from wearlab.life import coupled
from wearlab.mesh import contact, profile
from wearlab.mesh.exact import gaps, relation
from wearlab.simulation import label
from wearlab.simulation.dataset.coordinates import States


def exact_values(
    model: assembly.GearModel, states: States, failures: list[str]
) -> label.Values:
    """Return the mesh relationship at the stored phases.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states that are stored
    failures : gets a line for each mesh and state that fails

    Returns
    -------
    All variables of the group in the table of variables; NaN for members not in a mesh,
    and for what fails. Nothing where no mesh has exact contact.
    """
    if all(_meeting_gaps(kind.analysis) is None for kind in model.kinds):
        return {}
    values = _empty_values(model, len(states))
    for mesh, on_clock in enumerate(model.meshes):
        if _meeting_gaps(model.kinds[on_clock.kind].analysis) is None:
            continue
        name = f"exact mesh relationship of {model.gears.mesh_names[mesh]}"
        for update, state in enumerate(states):
            place = _PlaceOfMesh(update, mesh)
            kind_state = state.kind[on_clock.kind]
            label.diagnosed(
                name, failures, None, _fill_mesh, model, values, place, kind_state
            )
    return values


class _PlaceOfMesh(NamedTuple):
    """Place of the values of one mesh in one state: numbers of the update and mesh."""

    update: int
    mesh: int


class _MeshState(NamedTuple):
    """One mesh in one wear state.

    Parameters
    ----------
    kind : the physics of its kind
    flanks : the exact gaps of its flanks
    wear : (2, n) depths of its flanks [m]
    meeting : where its pairs meet at the stored phases
    engaged : (n_pairs, n_phases) which pairs are engaged
    single : share of the period in which a single pair is [1]
    """

    kind: assembly.MeshKindModel
    flanks: gaps.MeetingGaps
    wear: Array
    meeting: relation.MeshRelation
    engaged: Flags
    single: float


def _empty_values(model: assembly.GearModel, updates: int) -> label.Values:
    """Return all variables of the group, NaN; nothing engaged."""
    sizes = {
        "update": updates,
        "member": len(model.gears.members),
        "mesh": len(model.meshes),
        "pair": max(kind.analysis.grid.slots for kind in model.kinds),
        "phase": len(model.phase),
        "end": 2,
    }
    (variables,) = (
        group.variables for group in schema.GROUPS if "engaged" in group.variables
    )
    values: label.Values = {}
    for name, variable in variables.items():
        values[name] = np.full([sizes[dim] for dim in variable.dims], np.nan)
    values["engaged"] = np.zeros(values["engaged"].shape, np.int8)
    values["end"] = ["engages", "leaves"]
    return values


def _meeting_gaps(analysis: contact.ContactAnalysis) -> gaps.MeetingGaps | None:
    """Return the gaps of an analysis that know which points meet, None without."""
    return analysis.gaps if isinstance(analysis.gaps, gaps.MeetingGaps) else None


def _fill_mesh(
    model: assembly.GearModel,
    values: label.Values,
    place: _PlaceOfMesh,
    state: coupled.KindState,
) -> None:
    """Fill in what one mesh does in one state: for the mesh, then for its two gears."""
    mesh_state = _mesh_state(model, place.mesh, state)
    for name, value in _of_mesh(mesh_state).items():
        _fill(values[name], tuple(place), value)

    of_gears = _of_gears(mesh_state)
    for gear, body in enumerate(mesh_state.kind.pair.gears):
        member = model.gears.members.index(body.name)
        for name, of_gear in of_gears.items():
            _fill(values[name], (place.update, member, place.mesh), of_gear[gear])


def _fill(target: np.ndarray, place: tuple[Any, ...], value: Any) -> None:
    """Write a value into an array that may be larger along its last axes."""
    filled = tuple(slice(size) for size in np.shape(value))
    target[place + filled] = value


def _mesh_state(
    model: assembly.GearModel, mesh: int, state: coupled.KindState
) -> _MeshState:
    """Find where the pairs of a mesh meet in a wear state, and which are engaged."""
    number = model.meshes[mesh].kind
    kind = model.kinds[number]
    flanks = _meeting_gaps(kind.analysis)
    assert flanks is not None
    where = model.locate(mesh, model.phase)
    pair_numbers = kind.analysis.grid.pair_numbers
    meeting = relation.mesh_relation(flanks, state.wear, where.phase, pair_numbers)

    section = model.gears.kinds[number].section
    options = model.scene.mesh.of(section).contact
    if options.by_threshold:
        engaged = meeting.engaged_by_threshold(kind.pair, options.threshold)
        single = relation.single_share(flanks.flanks, state.wear, options.threshold)
    else:
        engaged = _carrying_pairs(kind.analysis, state, where)
        single = float(np.mean(engaged.sum(axis=0) == 1))
    return _MeshState(kind, flanks, state.wear, meeting, engaged, single)


def _carrying_pairs(
    analysis: contact.ContactAnalysis, state: coupled.KindState, where: profile.Lookup
) -> Flags:
    """Return which pairs carry a force, (n_pairs, n_phases)."""
    contact_at = analysis.quasistatic(state.flanks.nodes, where)
    return np.asarray(contact_at.force.T > 0.0)


def _of_mesh(state: _MeshState) -> label.Values:
    """Return what the mesh does as a whole.

    The first-order form of the gap is off by an excess, and by 5 % from a depth on.
    """
    grid = state.kind.analysis.grid
    flanks = state.flanks.flanks
    base_radius = state.kind.pair.driven.base_radius
    meeting = state.meeting

    lag = (meeting.gap - meeting.unloaded_error) / base_radius
    values: label.Values = {
        "engaged": grid.into_slots(state.engaged.astype(float), 0.0),
        "single_contact_share": state.single,
        "rotation_lag": grid.into_slots(
            np.where(np.isfinite(lag), lag, np.nan), np.nan
        ),
        "unloaded_transmission_angle": meeting.unloaded_error / base_radius,
    }
    deepest = float(state.wear.max())
    if deepest > 0.0:
        depth = relation.depth_of_disagreement(flanks, state.wear / deepest)
        excess = relation.first_order_excess(flanks, state.wear)
        values["first_order_excess"] = excess
        values["first_order_depth"] = depth if np.isfinite(depth) else np.nan
    return values


def _of_gears(state: _MeshState) -> Mapping[str, Any]:
    """Return where on each of the two gears pairs touch, and over which range."""
    grid = state.kind.analysis.grid
    contact_angle = state.meeting.contact_angle
    rotation_angle = state.meeting.rotation_angle
    engaged = state.engaged

    touched_range, turned_range = relation.lone_ranges(state.flanks.flanks, state.wear)
    turned = np.where(np.isnan(contact_angle), np.nan, rotation_angle)
    return {
        "contact_angle": [grid.into_slots(angles, np.nan) for angles in contact_angle],
        "rotation_angle": [grid.into_slots(angles, np.nan) for angles in turned],
        "meshing_range": relation.meshing_range(rotation_angle, engaged),
        "contact_range": relation.meshing_range(contact_angle, engaged),
        "lone_meshing_range": turned_range,
        "lone_contact_range": touched_range,
        "contact_loss": relation.contact_loss(state.kind.pair, contact_angle, engaged),
    }

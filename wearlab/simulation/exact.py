"""The exact mesh relationship of a run's states: where pairs touch, which are engaged, how gears lag."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.life.coupled import KindState, WearState
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.exact.gaps import MeetingGaps, WornFlanks
from wearlab.mesh.exact.relation import (
    MeshRelation,
    contact_loss,
    depth_of_disagreement,
    errors_in_both_forms,
    lone_ranges,
    mesh_relation,
    meshing_range,
    single_share,
)
from wearlab.mesh.profile import Lookup
from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.simulation.label import diagnosed

Values = dict[str, Any]


def exact_values(scene: Scene, parts: Parts, states: Sequence[WearState], failures: list[str]) -> Values:
    """Return the mesh relationship at the stored phases, nothing where no mesh has exact contact.

    ``contact_angle``, ``rotation_angle`` (update, member, mesh, pair, phase), ``engaged`` and
    ``rotation_lag`` (update, mesh, pair, phase), ``meshing_range``, ``contact_range`` and those of a lone
    pair (update, member, mesh, end), ``contact_loss`` (update, member, mesh), how far the first-order form is
    off (update, mesh) and ``unloaded_transmission_angle`` (update, mesh, phase); NaN for members not in a
    mesh, and for what fails.
    """
    if all(_meeting(kind.analysis) is None for kind in parts.kinds):
        return {}
    slots, phases = max(kind.analysis.grid.slots for kind in parts.kinds), len(parts.phase)
    meshes = len(states), len(parts.meshes)
    members = len(states), len(parts.gears.members), len(parts.meshes)
    shapes = {
        **dict.fromkeys(("contact_angle", "rotation_angle"), (*members, slots, phases)),
        **dict.fromkeys(("rotation_lag", "engaged"), (*meshes, slots, phases)),
        **dict.fromkeys(("meshing_range", "contact_range"), (*members, 2)),
        **dict.fromkeys(("lone_meshing_range", "lone_contact_range"), (*members, 2)),
        "contact_loss": members,
        **dict.fromkeys(("single_contact_share", "first_order_excess", "first_order_depth"), meshes),
        "unloaded_transmission_angle": (*meshes, phases),
    }
    values: Values = {name: np.full(shape, np.nan) for name, shape in shapes.items()}
    values |= {"engaged": np.zeros(shapes["engaged"], np.int8), "end": ["engages", "leaves"]}
    for index, mesh in enumerate(parts.meshes):
        if _meeting(parts.kinds[mesh.kind].analysis) is None:
            continue
        where = parts.look(index, parts.phase)
        for update, state in enumerate(states):
            fill = partial(_one_state, scene, parts, values, (update, index), state.kind[mesh.kind], where)
            diagnosed(f"exact mesh relationship of {parts.gears.mesh_names[index]}", fill, None, failures)
    return values


def _meeting(analysis: ContactAnalysis) -> MeetingGaps | None:
    """Return the gaps of an analysis that know which points meet, None without."""
    return None if analysis.gaps is None else analysis.gaps.meeting


def _one_state(
    scene: Scene, parts: Parts, values: Values, place: tuple[int, int], state: KindState, where: Lookup
) -> None:
    """Fill in what one mesh does in one state: ``place`` is (update, mesh)."""
    update, mesh = place
    kind = parts.meshes[mesh].kind
    kind_of_set, analysis = parts.gears.kinds[kind], parts.kinds[kind].analysis
    gaps = _meeting(analysis)
    assert gaps is not None
    relation = mesh_relation(gaps, state.wear, where.phase, analysis.grid.pair_numbers)
    engaged = _engaged(scene, parts, kind, relation, state, where)
    grid = analysis.grid
    values["engaged"][update, mesh, : grid.slots] = grid.into_slots(engaged.astype(float), 0.0)
    contact = scene.mesh.of(kind_of_set.section).contact
    values["single_contact_share"][update, mesh] = (
        single_share(gaps.flanks, state.wear, contact.threshold)
        if contact.by_threshold
        else np.mean(engaged.sum(axis=0) == 1)
    )
    lag = (relation.gap - relation.unloaded_error) / kind_of_set.pair.driven.base_radius
    lag = np.where(np.isfinite(lag), lag, np.nan)
    values["rotation_lag"][update, mesh, : grid.slots] = grid.into_slots(lag, np.nan)
    values["unloaded_transmission_angle"][update, mesh] = (
        relation.unloaded_error / kind_of_set.pair.driven.base_radius
    )
    for name, value in _first_order(gaps.flanks, state.wear).items():
        values[name][update, mesh] = value
    loss = contact_loss(kind_of_set.pair, relation.contact_angle, engaged)
    turned, touched = (
        meshing_range(angles, engaged) for angles in (relation.rotation_angle, relation.contact_angle)
    )
    touched_alone, turned_alone = lone_ranges(gaps.flanks, state.wear)
    for gear, body in enumerate(kind_of_set.pair.gears):
        member = parts.gears.members.index(body.name)
        for name, angles in (
            ("contact_angle", relation.contact_angle),
            ("rotation_angle", np.where(np.isnan(relation.contact_angle), np.nan, relation.rotation_angle)),
        ):
            slots = grid.into_slots(angles[gear], np.nan)
            values[name][update, member, mesh, : grid.slots] = slots
        values["meshing_range"][update, member, mesh] = turned[gear]
        values["contact_range"][update, member, mesh] = touched[gear]
        values["lone_meshing_range"][update, member, mesh] = turned_alone[gear]
        values["lone_contact_range"][update, member, mesh] = touched_alone[gear]
        values["contact_loss"][update, member, mesh] = loss[gear]


def _first_order(flanks: WornFlanks, wear: Array) -> dict[str, float]:
    """Return how far the first-order form is off, and the depth beyond which it is by 5 %; NaN unworn."""
    deepest = float(wear.max())
    if deepest == 0.0:
        return {}
    depth = depth_of_disagreement(flanks, wear / deepest)
    return {
        "first_order_excess": errors_in_both_forms(flanks, wear).excess,
        "first_order_depth": depth if np.isfinite(depth) else np.nan,
    }


def _engaged(
    scene: Scene, parts: Parts, kind: int, relation: MeshRelation, state: KindState, where: Lookup
) -> Flags:
    """Return which pairs are engaged, (n_pairs, n_phases): by load, or by the threshold of the scene."""
    mesh_kind = parts.gears.kinds[kind]
    contact = scene.mesh.of(mesh_kind.section).contact
    if contact.by_threshold:
        return relation.engaged_by_threshold(mesh_kind.pair, contact.threshold)
    analysis: ContactAnalysis = parts.kinds[kind].analysis
    return np.asarray(analysis.quasistatic(state.nodes, where).force.T > 0.0)

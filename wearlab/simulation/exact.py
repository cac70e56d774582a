"""The exact mesh relationship of a run's states: where pairs touch, which are engaged, how gears lag."""

import numpy as np

from wearlab import schema
from wearlab.life import coupled
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.exact import gaps, relation
from wearlab.scene import build
from wearlab.simulation import label, static


def exact_values(parts: build.Parts, states: static.States, failures: list[str]) -> label.Values:
    """Return the mesh relationship at the stored phases, nothing where no mesh has exact contact.

    All variables of its group in the table of variables; NaN for members not in a mesh, and for what fails.
    """
    if all(_meeting(kind.analysis) is None for kind in parts.kinds):
        return {}
    sizes = {"update": len(states), "member": len(parts.gears.members), "mesh": len(parts.meshes)}
    sizes["pair"] = max(kind.analysis.grid.slots for kind in parts.kinds)
    sizes |= {"phase": len(parts.phase), "end": 2}
    (own,) = (group.variables for group in schema.GROUPS if "engaged" in group.variables)
    values: label.Values = {
        name: np.full([sizes[dim] for dim in variable.dims], np.nan) for name, variable in own.items()
    }
    values |= {"engaged": np.zeros(values["engaged"].shape, np.int8), "end": ["engages", "leaves"]}
    for index, mesh in enumerate(parts.meshes):
        if _meeting(parts.kinds[mesh.kind].analysis) is None:
            continue
        for update, state in enumerate(states):
            told = f"exact mesh relationship of {parts.gears.mesh_names[index]}"
            given = parts, values, (update, index), state.kind[mesh.kind]
            label.diagnosed(told, failures, None, _fill, *given)
    return values


def _meeting(analysis: ContactAnalysis) -> gaps.MeetingGaps | None:
    """Return the gaps of an analysis that know which points meet, None without."""
    return analysis.gaps if isinstance(analysis.gaps, gaps.MeetingGaps) else None


def _fill(parts: build.Parts, values: label.Values, place: tuple[int, int], state: coupled.KindState) -> None:
    """Fill in what one mesh does in one state: ``place`` is (update, mesh)."""
    update, mesh = place
    kind = parts.meshes[mesh].kind
    pair, analysis = parts.kinds[kind].pair, parts.kinds[kind].analysis
    grid, where, meeting = analysis.grid, parts.look(mesh, parts.phase), _meeting(analysis)
    assert meeting is not None
    found = relation.mesh_relation(meeting, state.wear, where.phase, grid.pair_numbers)
    contact = parts.scene.mesh.of(parts.gears.kinds[kind].section).contact
    if contact.by_threshold:
        engaged = found.engaged_by_threshold(pair, contact.threshold)
        single = relation.single_share(meeting.flanks, state.wear, contact.threshold)
    else:
        engaged = np.asarray(analysis.quasistatic(state.flanks.nodes, where).force.T > 0.0)
        single = float(np.mean(engaged.sum(axis=0) == 1))
    lag = (found.gap - found.unloaded_error) / pair.driven.base_radius
    of_mesh: label.Values = {
        "engaged": grid.into_slots(engaged.astype(float), 0.0),
        "single_contact_share": single,
        "rotation_lag": grid.into_slots(np.where(np.isfinite(lag), lag, np.nan), np.nan),
        "unloaded_transmission_angle": found.unloaded_error / pair.driven.base_radius,
    }
    deepest = float(state.wear.max())
    if deepest > 0.0:  # how far the first-order form is off, and the depth beyond which it is by 5 %
        depth = relation.depth_of_disagreement(meeting.flanks, state.wear / deepest)
        of_mesh["first_order_excess"] = relation.first_order_excess(meeting.flanks, state.wear)
        of_mesh["first_order_depth"] = depth if np.isfinite(depth) else np.nan
    for name, value in of_mesh.items():
        values[name][(update, mesh, *map(slice, np.shape(value)))] = value
    touched_alone, turned_alone = relation.lone_ranges(meeting.flanks, state.wear)
    turned = np.where(np.isnan(found.contact_angle), np.nan, found.rotation_angle)
    of_gears: label.Values = {
        "contact_angle": [grid.into_slots(angles, np.nan) for angles in found.contact_angle],
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
            values[name][(update, member, mesh, *map(slice, np.shape(each[gear])))] = each[gear]

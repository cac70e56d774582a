"""Quasi-static contact of the meshes: stiffness, transmission error, load shares."""

from typing import Any

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.mesh import force
from wearlab.mesh.contact import Quasistatic
from wearlab.simulation import label
from wearlab.simulation.dataset import face
from wearlab.simulation.dataset.coordinates import States
from wearlab.simulation.dataset.mesh_period import contact_over_period, over_period


def mesh_values(model: assembly.GearModel, states: States) -> label.Values:
    """Return the quasi-static contact at the stored phases.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states that are stored

    Returns
    -------
    Variable → values, with the updates first; over the face where flanks have one.
    """
    if model.face is None:
        contact_of_mesh = _contact_of_pairs
        fill = 0.0
    else:
        contact_of_mesh = face.contact_of_lines
        fill = np.nan

    meshes = range(len(model.meshes))
    by_mesh = [contact_of_mesh(model, mesh, states) for mesh in meshes]
    values: label.Values = {
        name: label.padded([contact[name] for contact in by_mesh], 1, fill)
        for name in by_mesh[0]
    }

    kinds = [model.gears.kinds[mesh.kind] for mesh in model.meshes]
    values["mesh_frequency"] = [model.gears.mesh_frequency] * len(kinds)
    values["contact_ratio"] = [kind.pair.contact_ratio for kind in kinds]
    values["mesh_phase_offset"] = model.gears.mesh_lags
    values["static_mesh_force"] = [kind.load for kind in kinds]

    if model.face is None:
        return values | _load_sharing(model, states)
    return values | face.line_values(model, model.face, states)


def _load_sharing(model: assembly.GearModel, states: States) -> label.Values:
    """Return by how much load shares do not add up to 1, and slow errors.

    The once-per-revolution errors are those of member angles of equal weight.
    """
    residual = np.zeros((len(states), len(model.kinds)))
    for row, state in zip(residual, states, strict=True):
        for number, kind in enumerate(state.kind):
            # else there is nothing to share
            if model.gears.is_loaded(number) and model.gears.kinds[number].load > 0.0:
                total = force.load_share(kind.static).sum(axis=1)
                row[number] = np.abs(total - 1.0).max()
    values: label.Values = {"residual_load_share": residual.max(axis=1)}

    if model.scene.prescribed.measured_pitches:
        return values | _hunting(model, states)
    slow_errors = model.gears.slow_errors(model.meshes)
    if slow_errors is not None:
        count = len(slow_errors)
        values["slow_error"] = slow_errors.T
        values["error_weight"] = np.full(count, 1.0 / count)
    return values


def _hunting(model: assembly.GearModel, states: States) -> label.Values:
    """Return the static transmission error until the same teeth meet again.

    (n_states, n_mesh, hunting_period, phase): that of a mesh period, and the slow
    errors of all teeth.
    """
    teeth = [gear.teeth for gear in model.gears.gears.values()]
    errors: Any = model.scene.errors
    periods = errors.slow.periods(teeth)
    phase = np.arange(periods)[:, None] + model.phase
    slow = np.stack(  # period by period: waves times phases of all would fill memory
        [
            np.stack([mesh.error.slow.value(within) for within in phase])
            for mesh in model.meshes
        ]
    )

    name = "static_transmission_error"
    meshes = range(len(model.meshes))
    within = [
        np.asarray(_contact_of_pairs(model, mesh, states)[name]) for mesh in meshes
    ]
    each_period = np.stack(within, axis=1)[:, :, None, :]
    return {
        "hunting_transmission_error": each_period + slow,
        "shaft_order": [_shaft_order(model, name) for name in model.gears.members],
    }


def _shaft_order(model: assembly.GearModel, member: str) -> float:
    """Return the turns of a member in a mesh period, 0 of a carrier [1]."""
    for name, gear in model.gears.gears.items():
        if member == name or member.startswith(f"{name}-"):
            return 1.0 / gear.teeth
    return 0.0


def _contact_of_pairs(
    model: assembly.GearModel, mesh: int, states: States
) -> dict[str, Array]:
    """Return the contact of the tooth pairs of one mesh, the updates first."""
    on_clock = model.meshes[mesh]
    analysis = model.kinds[on_clock.kind].analysis
    grid = analysis.grid
    load = analysis.load

    where = model.locate(mesh, model.phase)
    flanks_of_states = [state.kind[on_clock.kind].flanks for state in states]
    contacts = [
        flanks.analysis.quasistatic(flanks.nodes, where) for flanks in flanks_of_states
    ]
    error = on_clock.error.value(where.phase) + model.constant_error[mesh]
    stored = {
        "mesh_stiffness": [contact.tangent for contact in contacts],
        "secant_stiffness": [_secant_stiffness(contact, load) for contact in contacts],
        "static_transmission_error": [
            contact.deflection + error for contact in contacts
        ],
        "unloaded_transmission_error": [
            contact.unloaded + error for contact in contacts
        ],
        "pair_stiffness": [
            grid.into_slots(contact.stiffness.T, 0.0) for contact in contacts
        ],
        "load_share": [
            grid.into_slots(force.load_share(contact).T, 0.0) for contact in contacts
        ],
    }
    values = {name: np.stack(rows) for name, rows in stored.items()}

    def error_at(phase: Array) -> Array:
        return on_clock.error.value(phase) + model.constant_error[mesh]

    of_states = [
        contact_over_period(flanks.analysis, flanks.nodes, on_clock.lag, error_at)
        for flanks in flanks_of_states
    ]
    return values | over_period(of_states, model.harmonics)


def _secant_stiffness(contact: Quasistatic, load: float) -> Array:
    """Return load over deflection, the tangent stiffness without load [N/m]."""
    if not load:
        return contact.tangent
    return load / (contact.deflection - contact.unloaded)

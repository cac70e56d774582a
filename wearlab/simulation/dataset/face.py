"""Contact of flanks with a width: lines of contact, line loads, how even these are."""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.gears.helix import overlap_ratio
from wearlab.life import coupled, face_coupling
from wearlab.mesh.face.contact import FaceContact, LineLoads
from wearlab.simulation import label
from wearlab.simulation.dataset.coordinates import States
from wearlab.simulation.dataset.mesh_period import (
    PeriodContact,
    PeriodSamples,
    over_period,
)


def face_states(
    states: Sequence[coupled.WearState], kind: int
) -> list[face_coupling.FaceState]:
    """Return the states of one kind of mesh whose flanks have a width.

    Parameters
    ----------
    states : the wear states
    kind : number of the kind of mesh
    """
    return [cast("face_coupling.FaceState", state.kind[kind]) for state in states]


def line_values(
    model: assembly.GearModel, face: face_coupling.FaceCoupling, states: States
) -> label.Values:
    """Return how the lines of contact lie, and how well their loads add up.

    Parameters
    ----------
    model : the physics of the scene
    face : its contact over the face
    states : the wear states that are stored
    """
    contacts = [face.kinds[mesh.kind].contact for mesh in model.meshes]
    helices = [contact.helix for contact in contacts]
    values: label.Values = {
        "base_helix_angle": [helix.sense * helix.base_angle for helix in helices],
        "overlap_ratio": [
            overlap_ratio(
                contact.grid.face_width,
                contact.helix.angle,
                normal_module(model, contact),
            )
            for contact in contacts
        ],
        "total_contact_ratio": [
            model.gears.kinds[mesh.kind].pair.total_contact_ratio(helix.base_angle)
            for mesh, helix in zip(model.meshes, helices, strict=True)
        ],
    }
    if not all(kind.load > 0.0 for kind in model.gears.kinds):
        return values

    residual = np.zeros((len(face.kinds), len(states)))
    for number, kind in enumerate(face.kinds):
        if not kind.is_loaded:
            continue
        load = kind.contact.analysis.load
        for update, state in enumerate(face_states(states, number)):
            off = kind.contact.residuals(state.loads, load)
            residual[number, update] = np.abs(off).max()
    values["residual_line_load"] = residual.max(axis=0)
    return values


def normal_module(model: assembly.GearModel, contact: FaceContact) -> float:
    """Return the module of the normal section [m].

    Parameters
    ----------
    model : the physics of the scene
    contact : contact over the face of one of its kinds of mesh
    """
    return model.kinds[0].pair.driving.module * math.cos(contact.helix.angle)


def contact_of_lines(
    model: assembly.GearModel, mesh: int, states: States
) -> dict[str, Array]:
    """Return the contact of one mesh whose flanks have a width, the updates first.

    Parameters
    ----------
    model : the physics of the scene
    mesh : number of the mesh
    states : the wear states that are stored
    """
    assert model.face is not None
    on_clock = model.meshes[mesh]
    contact = model.face.kinds[on_clock.kind].contact
    grid = contact.grid
    stored_phase = (model.phase - on_clock.lag) % 1.0

    of_mesh = face_states(states, on_clock.kind)
    loads = [state.loads for state in of_mesh]
    tangent = [lines.tangent for lines in loads]
    deflection = [lines.deflection for lines in loads]
    unloaded = [lines.unloaded for lines in loads]
    of_states = [contact_over_period(contact, lines, on_clock.lag) for lines in loads]
    values = over_period(of_states, model.harmonics)

    def at_stored_phases(of_states: list[Array]) -> Array:
        return np.stack(
            [grid.at_phases(samples, stored_phase) for samples in of_states]
        )

    values["mesh_stiffness"] = at_stored_phases(tangent)
    values["static_transmission_error"] = at_stored_phases(deflection)
    values["unloaded_transmission_error"] = at_stored_phases(unloaded)

    mean_line_loads = [_mean_line_load(contact, lines) for lines in loads]
    values["line_load"] = np.stack([state.line_load for state in of_mesh])
    values["mean_line_load"] = np.stack(mean_line_loads)

    load = contact.analysis.load
    if load > 0.0:
        window = normal_module(model, contact)
        factors = [load_factor(contact, lines, window) for lines in loads]
        peaks = [lines.load.max() * grid.face_width / load for lines in loads]
        values["face_load_factor"] = np.array(factors)
        values["peak_line_load_factor"] = np.array(peaks)
    return values


def contact_over_period(
    contact: FaceContact, lines: LineLoads, lag: float = 0.0
) -> PeriodContact:
    """Return the contact of a face over a mesh period, at its own phases.

    Parameters
    ----------
    contact : over the face
    lines : the line loads
    lag : phase of the clock at which a pair enters at A [1]
    """
    phase = contact.grid.phase + lag
    weight = contact.grid.weight
    return PeriodContact(
        stiffness=PeriodSamples(phase, weight, lines.tangent),
        error=PeriodSamples(phase, weight, lines.deflection),
        further_error=lines.deflection,
    )


def load_factor(contact: FaceContact, lines: LineLoads, window: float) -> float:
    """Return K_Hβ of line loads, see `face_load_factor` [1].

    Parameters
    ----------
    contact : over the face
    lines : the line loads
    window : width over which loads are averaged [m]
    """
    mean = _mean_line_load(contact, lines)
    return face_load_factor(contact.grid.width, mean, window)


def _mean_line_load(contact: FaceContact, lines: LineLoads) -> Array:
    """Return the load per width over a mesh period, (n_face,) [N/m]."""
    grid = contact.grid
    return np.asarray(grid.weight @ (lines.load * grid.filled).sum(axis=1))


def face_load_factor(width: Array, mean: Array, window: float) -> float:
    """Return K_Hβ: the largest over the mean load over the face, within a window [1].

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

    starts = np.concatenate([edges, edges - window])
    begin = np.clip(starts, 0.0, total - window)
    carried_to_end = np.interp(begin + window, edges, carried)
    within = carried_to_end - np.interp(begin, edges, carried)
    return float(within.max() / window / (carried[-1] / total))

"""What is worn: depths, deviations, rates, mass, and the counts of cycles."""

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.assembly.life import build_limits, build_snapshots, flank_entries
from wearlab.life import history
from wearlab.mesh.exact.flank import wear_slope
from wearlab.scene import Scene
from wearlab.simulation import label
from wearlab.simulation.dataset.coordinates import (
    States,
    by_flank,
    by_member,
    of_flank,
)
from wearlab.simulation.dataset.path import depths
from wearlab.wear import path

DEPTH_TOLERANCE = 1e-6
"""How near, relatively, a state is to the depth at which it was asked for."""


def wear_values(
    model: assembly.GearModel, life_history: history.History
) -> label.Values:
    """Return depths, rates, worn mass and the counts of cycles and operating time.

    Parameters
    ----------
    model : the physics of the scene
    life_history : the wear states that are stored, and the cycles of each
    """
    states = life_history.state
    gears = model.gears
    kinds = range(len(model.kinds))
    axes = 1 if model.face is None else 2

    depth = [depths(kind, states) for kind in kinds]
    deviation = [-(depth[kind] + modification(model, kind)) for kind in kinds]
    masses = [worn_mass(model, kind, depth[kind]) for kind in kinds]
    values: label.Values = {
        "wear_depth": by_flank(model, depth, axes),
        "flank_deviation": by_flank(model, deviation, axes),
        "worn_mass": by_member(model, masses),
        "mesh_cycles": life_history.cycle * gears.reference_teeth,
    }

    passes = [gears.kinds[kind].passes[gear] for kind, gear in gears.flank_places]
    values["load_cycles"] = life_history.cycle[:, None] * passes
    seconds = life_history.seconds
    if seconds is not None and np.isfinite(seconds).all():
        values["operating_hours"] = seconds

    if model.face is None:
        values["wear_slope"] = _slopes(model, depth)
    if all(state.wears for state in states):
        rates = [np.stack([state.rate[kind] for state in states]) for kind in kinds]
        values["wear_rate"] = by_flank(model, rates, axes)
    beyond = [state.wear_beyond for state in states if state.wear_beyond is not None]
    if len(beyond) == len(states):
        of_kinds = [np.stack(of_kind) for of_kind in zip(*beyond, strict=True)]
        values["wear_depth_beyond"] = by_flank(model, of_kinds, axes)
    return values


def _slopes(model: assembly.GearModel, depth: list[Array]) -> Array:
    """Return the slopes of the worn flanks along the profile, flank after flank [1]."""
    slopes = []
    for name in model.gears.flanks:
        number, gear = model.gears.flank(name)
        kind = model.kinds[number]
        flank_depth = of_flank(model, name, depth)
        slopes.append(wear_slope(kind.pair, gear, kind.analysis.grid, flank_depth))
    return label.padded(slopes, -2)


def modification(model: assembly.GearModel, kind: int) -> Array:
    """Return what is removed on purpose from flanks of a kind, (2, …, n) [m].

    Parameters
    ----------
    model : the physics of the scene
    kind : number of the kind of mesh
    """
    along_profile = model.kinds[kind].modification
    if model.face is None:
        return along_profile
    contact = model.face.kinds[kind].contact
    return contact.lead + (along_profile * contact.helix.cosine)[:, None, :]


def worn_mass(model: assembly.GearModel, kind: int, depth: Array) -> Array:
    """Return the mass worn off each gear of a kind of mesh, (n_updates, 2) [kg].

    Parameters
    ----------
    model : the physics of the scene
    kind : number of the kind of mesh
    depth : (n_updates, 2, …, n) along the normal [m]
    """
    mesh_kind = model.kinds[kind]
    gears = mesh_kind.pair.gears
    density = tuple(gear.material.density for gear in gears)
    teeth = tuple(gear.teeth for gear in gears)
    if model.face is None:
        return path.worn_mass(depth, mesh_kind.path, density=density, teeth=teeth)

    contact = model.face.kinds[kind].contact
    width_along_tooth = contact.grid.width[:, None] / contact.helix.cosine
    of_slices = path.worn_mass(
        np.moveaxis(depth, 2, 1),
        mesh_kind.path,
        density=density,
        teeth=teeth,
        face_width=width_along_tooth,
    )
    return of_slices.sum(axis=1)


def preset_depth(
    scene: Scene, model: assembly.GearModel, states: States
) -> label.Values:
    """Return the depths by which states were asked for, on their flank.

    Parameters
    ----------
    scene : the scene
    model : its physics
    states : the wear states that are stored

    Returns
    -------
    (n_updates, n_flank) [m], NaN where no depth was asked for; no variable where none
    was in the whole scene.
    """
    coupling = model.coupling
    snapshots = build_snapshots(scene, model.gears, coupling)
    limit = build_limits(scene, model.gears, coupling)
    if not snapshots.depths:
        return {}

    requested = [(depth, snapshots.flank) for depth in snapshots.depths]
    if limit.depth is not None:
        requested.append((limit.depth, limit.flank))

    depths_of_states = np.full((len(states), len(model.gears.flanks)), np.nan)
    for row, state in zip(depths_of_states, states, strict=True):
        wear = coupling.flat(state.wear)
        for depth, entries in requested:
            if abs(float(wear[entries].max()) - depth) <= DEPTH_TOLERANCE * depth:
                counted = np.full(len(wear), -1.0)
                counted[entries] = wear[entries]
                deepest = [
                    counted[flank_entries(name, model.gears, coupling)].max()
                    for name in model.gears.flanks
                ]
                row[np.argmax(deepest)] = depth
    return {"preset_depth": depths_of_states}

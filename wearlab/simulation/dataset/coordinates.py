"""Labels of the dimensions of a dataset, and values laid out flank by flank."""

from collections.abc import Callable, Sequence

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.life import coupled
from wearlab.simulation import label

States = tuple[coupled.WearState, ...]

POINT_TOLERANCE = 1e-12
"""Distance within which a node is one of the points A to E [m]."""


def coordinates(model: assembly.GearModel) -> label.Values:
    """Return the labels of the dimensions, and where nodes and slices lie.

    Parameters
    ----------
    model : the physics of the scene
    """
    values = label.Values()
    if model.face is not None:
        values["face_position"] = model.face.kinds[0].contact.grid.position

    slots = max(kind.analysis.grid.slots for kind in model.kinds)
    values["flank"] = list(model.gears.flanks)
    values["member"] = list(model.gears.members)
    values["mesh"] = list(model.gears.mesh_names)
    values["phase"] = model.phase
    values["pair"] = np.arange(1, slots + 1)
    values["harmonic"] = np.arange(1, model.harmonics + 1)
    values["path_position"] = nodal(model, lambda pair, gear, position: position)
    values["diameter"] = 2.0 * nodal(model, GearPair.radius)
    values["roll_angle"] = nodal(model, GearPair.roll_angle)
    values["distance_to_pitch_circle"] = nodal(model, _distance_to_pitch_circle)
    values["characteristic_point"] = characteristic_points(model)
    side_of = model.scene.operation.side_of
    values["flank_side"] = [side_of(name) for name in model.gears.flanks]
    return values


def nodal(
    model: assembly.GearModel, function: Callable[[GearPair, int, Array], Array]
) -> Array:
    """Return a function of the nodes of every flank, (n_flanks, n).

    Parameters
    ----------
    model : the physics of the scene
    function : of a pair, the number of one of its gears, and path positions (n,) [m]

    Returns
    -------
    One row a flank, NaN beyond its nodes.
    """
    rows = []
    for kind_number, gear in model.gears.flank_places:
        kind = model.kinds[kind_number]
        rows.append(function(kind.pair, gear, kind.analysis.grid.position))
    return label.padded(rows)


def _distance_to_pitch_circle(pair: GearPair, gear: int, position: Array) -> Array:
    """Return by how much nodes lie outside the pitch circle of their gear, (n,) [m]."""
    pitch_radius = pair.gears[gear].base_radius / np.cos(pair.working_pressure_angle)
    return pair.radius(gear, position) - pitch_radius


def by_flank(
    model: assembly.GearModel, of_kind: Sequence[Array], along: int = 1
) -> Array:
    """Return values of every kind of mesh, flank after flank, (…, n_flanks, n).

    Parameters
    ----------
    model : the physics of the scene
    of_kind : values of each kind of mesh, (…, 2, n)
    along : number of axes after that of the two gears: 1 along the profile; 2 along
        face and profile, (…, n_flanks, n_face, n)
    """
    rows = [of_flank(model, name, of_kind, along) for name in model.gears.flanks]
    return label.padded(rows, -1 - along)


def of_flank(
    model: assembly.GearModel, name: str, of_kind: Sequence[Array], along: int = 1
) -> Array:
    """Return values of one flank, the mean of those of planets that are apart, (…, n).

    Parameters
    ----------
    model : the physics of the scene
    name : of the flank
    of_kind, along : as in `by_flank`
    """
    axis = -1 - along
    places = model.gears.places_of(name)
    rows = [np.take(of_kind[kind], gear, axis) for kind, gear in places]
    return rows[0] if len(rows) == 1 else np.mean(rows, axis=0)


def by_member(model: assembly.GearModel, of_kind: Sequence[Array]) -> Array:
    """Return values of gears summed over each member, (n_updates, n_members).

    Parameters
    ----------
    model : the physics of the scene
    of_kind : values of the two gears of each kind of mesh, (n_updates, 2)
    """
    total = np.zeros((len(of_kind[0]), len(model.gears.members)))
    for kind, values in enumerate(of_kind):
        for number, gear in enumerate(model.kinds[kind].pair.gears):
            columns = model.gears.columns_at(kind, gear.name)
            total[:, columns] += values[:, [number]]
    return total


def characteristic_points(model: assembly.GearModel) -> np.ndarray:
    """Return the letter of each node that is one of the points A–E, else "".

    Parameters
    ----------
    model : the physics of the scene

    Returns
    -------
    One row (n,) for the two flanks of a pair; one for each flank where meshes of
    several kinds differ.
    """
    longest = max(len(kind.analysis.grid.position) for kind in model.kinds)
    points = np.full((len(model.kinds), longest), "", "U1")
    for row, kind in zip(points, model.kinds, strict=True):
        for letter, position in kind.pair.path._asdict().items():
            distance = np.abs(kind.analysis.grid.position - position)
            row[np.flatnonzero(distance < POINT_TOLERANCE)] = letter
    if len(points) == 1:
        return points[0]
    return points[[kind for kind, _ in model.gears.flank_places]]

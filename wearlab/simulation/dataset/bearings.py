"""Forces of the bearings on the members of a gear set."""

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.supports import bearing_forces
from wearlab.mesh import gear_set


def has_bearings(model: assembly.GearModel) -> bool:
    """Return whether a member moves on its support.

    Parameters
    ----------
    model : the physics of the scene
    """
    return model.vibration is not None and model.vibration.system.on_bearings


def bearing_values(
    model: assembly.GearModel, position: Array, velocity: Array, normal: Array
) -> Array:
    """Return the forces of the bearings on the members.

    Along x, y and, of helical gears, z. A bearing that does not give way holds what the
    meshes push at once.

    Parameters
    ----------
    model : the physics of the scene
    position, velocity : (n_periods, n, n_instants) coordinates q [m] and q̇ [m/s]
    normal : (n_mesh, n_periods, n_instants) forces of the meshes in the plane of action
        [N]

    Returns
    -------
    (n_members, 2 or 3, n_periods, n_instants) [N]
    """
    gears = model.gears
    supports = model.moving.system.supports
    force = bearing_forces(supports, gears.members, position, velocity)
    force[:, 1] *= gears.sense  # y of a mirrored set points back

    slope = 0.0 if model.face is None else model.face.slope
    if not slope:
        return force[:, :2]

    moving = {(support.member, support.axis) for support in supports}
    rigid = [(member, "z") not in moving for member in gears.members]
    force[rigid, 2] = rigid_bearing_forces(gears, slope, normal)[rigid]

    # a pair that only turns and moves along its axes
    if all(axis != "y" for _, axis in moving):
        force[:, 1] = rigid_bearing_forces(gears, 1.0, normal)
    return force


def rigid_bearing_forces(gears: gear_set.GearSet, share: float, normal: Array) -> Array:
    """Return the forces along one axis of bearings that do not give way, ``± share F``.

    What the mesh pushes the bearing holds at once, along the axis on the pins of
    planets, too, and all of them at the carrier's.

    Parameters
    ----------
    gears : the gear set
    share : of the force in the plane of action: along the axis the signed tan β_b of
        :class:`wearlab.gears.helix.Helix`, along a pair's line of action 1 [1]
    normal : (n_mesh, n_periods, n_phases) force in the plane of action [N]

    Returns
    -------
    (n_members, n_periods, n_phases), along the axis towards positive face positions [N]

    References
    ----------
    ISO 21771:2007, 4.3, for the angle; the balance of forces.
    """
    total = np.zeros((len(gears.members), *normal.shape[1:]))
    for mesh, kind in enumerate(gears.mesh_kinds):
        for sign, gear in zip((1.0, -1.0), gears.kinds[kind].pair.gears, strict=True):
            columns = gears.columns_of(gear.name)
            total[columns[mesh % len(columns)]] += sign * share * normal[mesh]
    for carrier in gears.columns_of("carrier"):
        total[carrier] = total[gears.columns_of("planet")].sum(axis=0)
    return total

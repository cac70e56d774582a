"""``[dynamics]`` → the system in its one form, by the model chosen."""

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene

ANY = 1e8
"""A mesh stiffness, where its size is of no account [N/m]."""


def build_system(scene: Scene, gears: GearSet, stiffness: Array) -> System:
    """Return the system of ``dynamics.model``; damping ratios refer to mean stiffnesses (n_mesh,) [N/m]."""
    assert scene.dynamics is not None
    meshes = tuple(scene.mesh.of(kind.section) for kind in gears.kinds)
    return scene.dynamics.build(InMotion(gears, meshes, scene.operation, stiffness))


def check_held(scene: Scene, gears: GearSet) -> None:
    """Refuse a set of which anything floats: its meshes need no more than to be there.

    Raises
    ------
    GearError
        Naming what floats, or what the rotation of the carrier tears away.
    """
    if scene.dynamics is not None:
        build_system(scene, gears, np.full(len(gears.mesh_names), ANY))

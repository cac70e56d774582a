"""Natural modes of a scene, and the speeds at which its meshes excite them."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly.construction import unworn_stiffness
from wearlab.assembly.gear_model import GearModel
from wearlab.dynamics.modes import Modes, critical_speeds, mode_kinds, modes


class SceneModes(NamedTuple):
    """The modes of a scene.

    Parameters
    ----------
    modes : natural frequencies, shapes and participations
    critical_speed : (orders, n_modes) speeds of the input member at which harmonic 1, 2
        … of the mesh meets a mode [rad/s]
    coordinates : names of the coordinates
    kinds : what moves in each mode of a planetary set with translations, None for other
        models
    """

    modes: Modes
    critical_speed: Array
    coordinates: tuple[str, ...]
    kinds: tuple[str, ...] | None


def build_modes(parts: GearModel, orders: int = 3) -> SceneModes:
    """Return the modes of a scene with dynamics, at mean stiffness of unworn meshes.

    Parameters
    ----------
    parts : the physics of the scene
    orders : harmonics of the mesh whose critical speeds are told
    """
    system = parts.moving.system
    mean = [unworn_stiffness(kind)[0] for kind in parts.coupling.kinds]
    system_modes = modes(system, np.array([mean[mesh.kind] for mesh in parts.meshes]))
    return SceneModes(
        system_modes,
        critical_speeds(system_modes.frequency, parts.gears.input_teeth, orders),
        system.coordinates,
        mode_kinds(system, system_modes)
        if (~system.central & ~system.turns).any()
        else None,
    )

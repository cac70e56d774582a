"""Natural frequencies of a scene at its mean mesh stiffness."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.mode_kinds import mode_kinds
from wearlab.dynamics.modes import Modes, critical_speeds, modes
from wearlab.scene.build.parts import Parts
from wearlab.scene.build.vibration import mean_stiffness


class SceneModes(NamedTuple):
    """The modes of a scene.

    Parameters
    ----------
    modes : natural frequencies, shapes and participations
    critical_speed : (orders, n_modes) speeds of the input member at which harmonic 1, 2 … of the mesh
        meets a mode [rad/s]
    coordinates : names of the coordinates
    kinds : what moves in each mode of a planetary set with translations, None for other models
    """

    modes: Modes
    critical_speed: Array
    coordinates: tuple[str, ...]
    kinds: tuple[str, ...] | None


def build_modes(parts: Parts, orders: int = 3) -> SceneModes:
    """Return the modes of a scene with dynamics, with the mean stiffness of its unworn mesh."""
    assert parts.vibration is not None
    system = parts.vibration.system
    mean = [mean_stiffness(kind.analysis) for kind in parts.kinds]
    stiffness = np.array([mean[mesh.kind] for mesh in parts.meshes])
    system_modes = modes(system, stiffness)
    return SceneModes(
        system_modes,
        critical_speeds(system_modes.frequency, parts.gears.input_teeth, orders),
        system.coordinates,
        mode_kinds(system, system_modes) if (~system.central & ~system.turns).any() else None,
    )

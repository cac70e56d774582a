"""Natural frequencies of a scene at its mean mesh stiffness."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.mode_kinds import mode_kinds
from wearlab.dynamics.modes import Modes, critical_speeds, modes
from wearlab.dynamics.system import System
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
    mean = [mean_stiffness(kind.analysis) for kind in parts.kinds]
    stiffness = np.array([mean[mesh.kind] for mesh in parts.meshes])
    system_modes = modes(parts.vibration.system, stiffness)
    return SceneModes(
        system_modes,
        critical_speeds(system_modes.frequency, parts.gears.input_teeth, orders),
        parts.vibration.system.coordinates,
        mode_kinds(parts.vibration.system, system_modes) if _moves_in_plane(parts.vibration.system) else None,
    )


def _moves_in_plane(system: System) -> bool:
    """Whether the planets of a set have translations."""
    return "planet-1.x" in system.coordinates

"""Natural frequencies of a scene at its mean mesh stiffness."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.modes import Modes, critical_speeds, modes
from wearlab.scene.build.parts import PairParts
from wearlab.scene.build.vibration import mean_stiffness

Array = NDArray[np.float64]


class SceneModes(NamedTuple):
    """The modes of a scene.

    Parameters
    ----------
    modes : natural frequencies, shapes and participations
    critical_speed : (orders, n_modes) speeds of the reference gear at which harmonic 1, 2 … of the mesh
        meets a mode [rad/s]
    mean_stiffness : of the unworn mesh [N/m]
    coordinates : names of the coordinates
    """

    modes: Modes
    critical_speed: Array
    mean_stiffness: float
    coordinates: tuple[str, ...]


def build_modes(parts: PairParts, orders: int = 3) -> SceneModes:
    """Return the modes of a scene with dynamics, with the mean stiffness of its unworn mesh."""
    assert parts.vibration is not None
    nodes = parts.analysis.nodes(np.zeros((2, len(parts.analysis.grid.position))))
    state = parts.analysis.quasistatic(nodes, parts.analysis.at_nodes)
    stiffness = mean_stiffness(parts.analysis, state)
    found = modes(parts.vibration.system, stiffness)
    teeth = parts.pair.gears[parts.order[0]].teeth
    return SceneModes(
        found,
        critical_speeds(found.frequency, teeth, orders),
        stiffness,
        parts.vibration.system.coordinates,
    )

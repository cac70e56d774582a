"""Natural frequencies of a scene at its mean mesh stiffness."""

import numpy as np

from wearlab.dynamics.modes import Modes, natural_modes
from wearlab.scene import Scene
from wearlab.scene.build.parts import PairParts
from wearlab.scene.build.vibration import mean_stiffness


def build_modes(scene: Scene, parts: PairParts) -> Modes:
    """Return the modes of the scene's system with the mean stiffness of the unworn mesh."""
    assert parts.vibration is not None
    nodes = parts.analysis.nodes(np.zeros((2, len(parts.analysis.grid.position))))
    state = parts.analysis.quasistatic(nodes, parts.analysis.at_nodes)
    stiffness = mean_stiffness(parts.analysis, state)
    teeth = parts.pair.gears[parts.order[0]].teeth
    return natural_modes(parts.vibration.system, np.array([stiffness]), teeth)

"""``dynamics.response`` → its speeds, and the vibration of a wear state at each of them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.continuation import Continuation
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.steps import steps_per_period
from wearlab.dynamics.system import System
from wearlab.life.state import Vibration, WearState
from wearlab.mesh.excitation import stage_tables, stages
from wearlab.mesh.stages import StageTables, stage_grid
from wearlab.scene import Scene
from wearlab.scene.build.parts import PairParts
from wearlab.scene.build.vibration import fluctuation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SpeedResponse:
    """What a continuation over speed needs of one wear state.

    Parameters
    ----------
    scene, parts, state : the scene, its physics, and the wear state
    speeds : (n,) ascending speeds of the input member [rad/s]
    directions : names of the directions, in the order in which they are followed
    continuation : how
    """

    scene: Scene
    parts: PairParts
    state: WearState
    speeds: Array
    directions: tuple[str, ...]
    continuation: Continuation

    def vibration(self, speed: float) -> Vibration:
        """Return the dynamics at a speed [rad/s], with steps by the rule for that speed."""
        scene, parts, vibration = self.scene, self.parts, self.parts.vibration
        assert vibration is not None
        period = 2 * np.pi / (speed * parts.pair.driving.teeth)
        steps = scene.numerics.steps_per_period or steps_per_period(
            vibration.system,
            float(self.state.static.tangent.max()),
            period,
            scene.numerics.tolerance,
            len(parts.analysis.grid.intervals),
        )
        grid = stage_grid(parts.analysis.grid.breaks[:-1], steps)
        return replace(
            vibration,
            stages=stages(parts.analysis, grid, parts.error),
            period=period,
            fluctuation=fluctuation(scene, grid.phase),
        )

    def mesh_at(self, speed: float) -> tuple[System, StageTables, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        one = self.vibration(speed)
        state = self.state
        tables = stage_tables(self.parts.analysis, state.nodes, state.fitted, one.stages, one.fluctuation)
        return one.system, tables, one.period


def build_response(scene: Scene, parts: PairParts, state: WearState) -> SpeedResponse:
    """Return the continuation that ``dynamics.response`` asks for, at one wear state."""
    assert scene.dynamics is not None and scene.dynamics.response is not None
    assert parts.vibration is not None and isinstance(parts.vibration.method, Periodic)
    given: Any = scene.dynamics.response
    speeds = np.linspace(getattr(given.speed, "from"), given.speed.to, given.speed.points)
    directions = ("up", "down") if given.direction == "both" else (given.direction,)
    return SpeedResponse(
        scene, parts, state, speeds, directions,
        Continuation(given.transient, given.strobe, parts.vibration.method),
    )  # fmt: skip

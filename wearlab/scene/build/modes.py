"""Natural frequencies of a scene, and its response over speed."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.modes import Modes, critical_speeds, mode_kinds, modes
from wearlab.dynamics.orbits.continuation import Continuation
from wearlab.dynamics.orbits.periodic import Periodic
from wearlab.dynamics.system import System
from wearlab.life.coupled import WearState
from wearlab.life.vibration import Vibration
from wearlab.mesh import stages, tabulation
from wearlab.mesh.clock import sampling
from wearlab.scene import Scene
from wearlab.scene.build.parts import Parts
from wearlab.scene.build.vibration import OnClock, build_friction, fluctuation, mean_stiffness, steps_grid


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
    if parts.face is not None:
        mean = [kind.contact.mean_stiffness for kind in parts.face.kinds]
    stiffness = np.array([mean[mesh.kind] for mesh in parts.meshes])
    system_modes = modes(system, stiffness)
    return SceneModes(
        system_modes,
        critical_speeds(system_modes.frequency, parts.gears.input_teeth, orders),
        system.coordinates,
        mode_kinds(system, system_modes) if (~system.central & ~system.turns).any() else None,
    )


@dataclass(frozen=True)
class OverSpeed:
    """What a continuation over speed needs of one wear state.

    Parameters
    ----------
    scene, parts, state : the scene, its physics, and the wear state
    speeds : (n,) ascending speeds of the input member [rad/s]
    directions : names of the directions, in the order in which they are followed
    continuation : how
    """

    scene: Scene
    parts: Parts
    state: WearState
    speeds: Array
    directions: tuple[str, ...]
    continuation: Continuation

    def vibration(self, speed: float) -> Vibration:
        """Return the dynamics at a speed [rad/s], with steps by the rule for that speed."""
        scene, parts, vibration = self.scene, self.parts, self.parts.vibration
        assert vibration is not None
        assert scene.operation.speed is not None
        period = parts.gears.period * scene.operation.speed / speed
        analyses = [kind.analysis for kind in parts.kinds]
        stiffest = np.array([self.state.kind[mesh.kind].static.tangent.max() for mesh in parts.meshes])
        clock = OnClock(analyses, parts.meshes, parts.edges)
        grid = steps_grid(scene, clock, vibration.system, stiffest, period)
        return replace(
            vibration,
            sampling=sampling(
                [analysis.grid for analysis in analyses],
                parts.meshes,
                parts.edges,
                grid,
                build_friction(scene, parts.gears),
            ),
            period=period,
            fluctuation=fluctuation(scene, grid, 1, period),
        )

    def mesh_at(self, speed: float) -> tuple[System, stages.StageTables, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        moving = self.vibration(speed)
        tables = tabulation.stage_tables(
            self.parts.coupling.flanks_of(self.state), moving.sampling, moving.fluctuation
        )
        return moving.system, tables, moving.period


def build_over_speed(scene: Scene, parts: Parts, state: WearState) -> OverSpeed:
    """Return the continuation that ``dynamics.response`` asks for, at one wear state."""
    assert scene.dynamics is not None and scene.dynamics.response is not None
    assert parts.vibration is not None and isinstance(parts.vibration.method, Periodic)
    given: Any = scene.dynamics.response
    speeds = np.linspace(getattr(given.speed, "from"), given.speed.to, given.speed.points)
    return OverSpeed(
        scene, parts, state, speeds, given.directions,
        Continuation(given.transient, given.strobe, parts.vibration.method),
    )  # fmt: skip

"""The steady state of one scene as a problem: its mesh force at given settings, and how long that takes."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearlab.accuracy.cells import Motion, motion
from wearlab.arrays import Array
from wearlab.dynamics.collocation import SIZES
from wearlab.dynamics.mesh_forces import elastic_force
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.system import System
from wearlab.life.vibration import Vibration
from wearlab.mesh.clock import look, sampling
from wearlab.mesh.excitation import Touching
from wearlab.mesh.stages import stage_grid
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.vibration import MOST_STEPS, OnClock, build_friction, few_steps, fluctuation
from wearlab.simulation.run import initial_wear
from wearlab.wear.initials import quadratic

FEWEST = 32
TABLE_MISSED = 2e-6
"""What steps for touching flanks may miss of a stiffness from a table, however few are asked for [1]."""
NEIGHBOUR = 1e-7
"""How much deeper the flanks of the neighbouring wear state are worn [m]."""


@dataclass(frozen=True)
class Steady:
    """The first wear state of a scene, ready for any integrator.

    Parameters
    ----------
    scene, parts : the scene and its physics
    kinds : contact of every kind of mesh in the first wear state, and what the excitation was fitted to
    near : those of a neighbouring, slightly more worn state
    """

    scene: Scene
    parts: Parts
    kinds: tuple[Touching, ...]
    near: tuple[Touching, ...]

    @property
    def vibration(self) -> Vibration:
        """The dynamics of the scene."""
        assert self.parts.vibration is not None
        return self.parts.vibration

    @property
    def phase(self) -> Array:
        """Phases of the clock at which mesh forces are compared, (n_phases,) [1]."""
        return self.parts.phase

    def motion(self, system: System | None = None) -> Motion:
        """Return the equation of motion for foreign integrators, with the loads that ``system`` has."""
        friction = build_friction(self.scene, self.parts.gears)
        return motion(self.kinds, self.vibration, system or self.vibration.system, friction)

    def with_steps(self, steps: int, method: Any = None) -> Vibration:
        """Return the dynamics with about ``steps`` steps a mesh period, by ``method`` if one is given."""
        parts, chosen = self.parts, method or self.vibration.method
        exact = isinstance(chosen, Periodic) and not in_registers(self.vibration.system)
        grid = stage_grid(parts.edges[:-1], steps, SIZES[0] if exact else 2)
        grids, friction = [kind.analysis.grid for kind in self.kinds], build_friction(self.scene, parts.gears)
        return replace(
            self.vibration,
            method=chosen,
            sampling=sampling(grids, parts.meshes, parts.edges, grid, friction),
            fluctuation=fluctuation(self.scene, grid.phase),
            slow=None,
            touching=None,
        )

    def with_few_steps(self, steps: int) -> Vibration:
        """Return the dynamics with about ``steps`` steps a mesh period for flanks that touch throughout.

        Where flanks part a small system falls back to as many Runge–Kutta steps, for which `FEWEST` are too
        few; a large one has no other steps.
        """
        if self.vibration.touching is None:
            return self.with_steps(steps, Periodic())
        parts, marched = self.parts, self.with_steps(max(FEWEST, steps), Periodic())
        analyses = [kind.analysis for kind in self.kinds]
        grid = few_steps(OnClock(analyses, parts.meshes, parts.edges), steps, TABLE_MISSED, MOST_STEPS)
        assert grid is not None
        grids, friction = [analysis.grid for analysis in analyses], build_friction(self.scene, parts.gears)
        few = sampling(grids, parts.meshes, parts.edges, grid, friction)
        return replace(marched, touching=few)

    def solve(self, vibration: Vibration, start: Response | None = None) -> Response:
        """Return the response, tables included; slow errors are left out."""
        return turning_nowhere(vibration).solve(self.kinds, None if start is None else (start,))[0]

    def solve_near(self, vibration: Vibration, start: Response | None = None) -> Response:
        """Return the response of the neighbouring wear state."""
        return turning_nowhere(vibration).solve(self.near, None if start is None else (start,))[0]

    def force_of(self, vibration: Vibration, response: Response, phase: Array | None = None) -> Array:
        """Return the elastic forces of all meshes, (n_periods, n_mesh · n_phases) [N]."""
        phase = self.phase if phase is None else phase
        return self.force(vibration.deflection(response, vibration.look(phase))[0], phase)

    def force(self, deflection: Array, phase: Array) -> Array:
        """Return the elastic mesh forces for mesh deflections.

        Parameters
        ----------
        deflection : (n_periods, n_mesh, n_phases) [m]
        phase : (n_phases,) of the clock [1]

        Returns
        -------
        (n_periods, n_mesh · n_phases) [N]
        """
        forces = []
        for m, mesh in enumerate(self.parts.meshes):
            kind = self.kinds[mesh.kind]
            where = look(kind.analysis.grid, [mesh.lag], phase)
            forces.append(elastic_force(self.vibration.system, m, kind, where, deflection[:, m]))
        return np.concatenate(forces, axis=1)

    def force_of_states(self, states: Array) -> Array:
        """Return the elastic mesh forces for states (n_periods, n_phases, 2n), as `force` does [N]."""
        direction = self.vibration.system.direction
        position = states[..., : direction.shape[1]] @ direction.T
        meshes = self.parts.meshes
        error = np.stack([mesh.error.value(self.phase - mesh.lag) for mesh in meshes], axis=-1)
        return self.force(np.moveaxis(position - error, 2, 1), self.phase)


def turning_nowhere(vibration: Vibration) -> Vibration:
    """Return the dynamics without slow errors."""
    return vibration if vibration.slow is None else replace(vibration, slow=None)


def steady(scene: Scene) -> Steady:
    """Build the steady problem of a scene at its initial wear."""
    parts = build(scene)
    assert parts.vibration is not None
    coupling, wear = parts.coupling, initial_wear(scene, parts)
    near = [
        depth + quadratic(kind.analysis.grid.position, NEIGHBOUR)
        for kind, depth in zip(coupling.kinds, wear, strict=True)
    ]
    return Steady(scene, parts, tuple(coupling.flanks(wear)), tuple(coupling.flanks(tuple(near))))


def relative_error(force: Array, reference: Array) -> float:
    """Return the largest difference of two forces (n_periods, n_phases) over the largest force [1].

    Forces over more periods than one may begin in any of them; different periods compare as infinitely wrong.
    """
    if force.shape != reference.shape or not np.isfinite(force).all():
        return float("inf")
    turns = (np.roll(force, k, axis=0) for k in range(len(force)))
    return float(min(np.abs(turn - reference).max() for turn in turns) / np.abs(reference).max())

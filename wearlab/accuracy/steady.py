"""The steady state of one scene as a problem: its mesh force at given settings, and how long that takes."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.accuracy.cells import Motion, motion
from wearlab.dynamics.response import Response
from wearlab.life.vibration import Vibration
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.excitation import Touching, mesh_force, stages
from wearlab.mesh.profile import Lookup
from wearlab.mesh.stages import stage_grid
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.vibration import fluctuation
from wearlab.simulate.run import initial_wear
from wearlab.wear.initial import quadratic

Array = NDArray[np.float64]

NEIGHBOUR = 1e-7
"""How much deeper the flanks of the neighbouring wear state are worn [m]."""


@dataclass(frozen=True)
class Steady:
    """The first wear state of a scene, ready for any integrator.

    Parameters
    ----------
    scene, parts : the scene and its physics
    mesh : contact of the first wear state, and what the excitation was fitted to
    near : those of a neighbouring, slightly more worn state
    where : phases at which mesh forces are compared
    """

    scene: Scene
    parts: Parts
    mesh: Touching
    near: Touching
    where: Lookup

    @property
    def analysis(self) -> ContactAnalysis:
        """Contact of the mesh."""
        return self.mesh.analysis

    @property
    def vibration(self) -> Vibration:
        """The dynamics of the scene."""
        assert self.parts.vibration is not None
        return self.parts.vibration

    def motion(self) -> Motion:
        """Return the equation of motion for foreign integrators."""
        return motion(self.mesh, self.vibration)

    def with_steps(self, steps: int, method: Any = None) -> Vibration:
        """Return the dynamics with about ``steps`` steps a mesh period, by ``method`` if one is given."""
        parts = self.parts
        grid = stage_grid(parts.edges[:-1], steps)
        return replace(
            self.vibration,
            method=method or self.vibration.method,
            stages=stages([self.analysis.grid], parts.meshes, parts.edges, grid),
            fluctuation=fluctuation(self.scene, grid.phase),
        )

    def solve(self, vibration: Vibration, start: Response | None = None) -> Response:
        """Return the response, tables included."""
        return vibration.solve([self.mesh], None if start is None else (start,))[0]

    def solve_near(self, vibration: Vibration) -> Response:
        """Return the response of the neighbouring wear state."""
        return vibration.solve([self.near], None)[0]

    def force_of(self, vibration: Vibration, response: Response) -> Array:
        """Return the elastic mesh force, (n_periods, n_phases) [N]."""
        when = vibration.look(self.parts.phase)
        return self.force(vibration.deflection(response, when)[0][:, 0])

    def force(self, deflection: Array) -> Array:
        """Return the elastic mesh force for mesh deflections, both (n_periods, n_phases) [m], [N]."""
        backlash = self.vibration.backlash
        return np.stack([mesh_force(self.mesh, self.where, one, backlash).elastic for one in deflection])

    def force_of_states(self, states: Array) -> Array:
        """Return the elastic mesh force for states (n_periods, n_phases, 2n), (n_periods, n_phases) [N]."""
        direction = self.vibration.system.direction[0]
        error = self.parts.meshes[0].error.value(self.where.phase)
        return self.force(states[..., : len(direction)] @ direction - error)


def steady(scene: Scene) -> Steady:
    """Build the steady problem of a scene at its initial wear."""
    parts = build(scene)
    assert parts.vibration is not None
    wear = initial_wear(scene, parts)[0]
    analysis = parts.kinds[0].analysis
    more = quadratic(analysis.grid.position, NEIGHBOUR)
    mesh, near = (_touching(parts, depth) for depth in (wear[0], wear[0] + more))
    return Steady(scene, parts, mesh, near, parts.look(0, parts.phase))


def _touching(parts: Parts, wear: Array) -> Touching:
    assert parts.vibration is not None
    analysis = parts.kinds[0].analysis
    nodes = analysis.nodes(wear)
    return Touching(analysis, nodes, parts.vibration.excitation.prepare(analysis, nodes))


def relative_error(force: Array, reference: Array) -> float:
    """Return the largest difference of two forces (n_periods, n_phases) over the largest force [1].

    Forces over more periods than one may begin in any of them; different periods compare as infinitely wrong.
    """
    if force.shape != reference.shape or not np.isfinite(force).all():
        return float("inf")
    turns = (np.roll(force, k, axis=0) for k in range(len(force)))
    return float(min(np.abs(turn - reference).max() for turn in turns) / np.abs(reference).max())

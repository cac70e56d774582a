"""The steady state of a scene as a problem for any integrator."""

from typing import Any, NamedTuple

import numpy as np

from wearlab.accuracy.equation import Motion, motion
from wearlab.arrays import Array
from wearlab.assembly import GearModel, build
from wearlab.assembly.on_clock import build_friction
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.system import System
from wearlab.life.vibration import Vibration
from wearlab.mesh import excitation, stages
from wearlab.mesh.force import Deflections
from wearlab.scene import Scene
from wearlab.simulation.initial_wear import initial_wear
from wearlab.wear.initials.quadratic import quadratic

NEIGHBOUR = 1e-7
"""How much deeper the flanks of the neighbouring wear state are worn [m]."""


class Steady(NamedTuple):
    """The first wear state of a scene, ready for any integrator.

    Parameters
    ----------
    scene, parts : the scene and its physics
    kinds : contact of every kind of mesh in the first wear state, and what the
        excitation was fitted to
    near : those of a neighbouring, slightly more worn state
    """

    scene: Scene
    parts: GearModel
    kinds: tuple[excitation.MeshFlanks, ...]
    near: tuple[excitation.MeshFlanks, ...]

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
        """Return the equation of motion for foreign integrators.

        Parameters
        ----------
        system : whose loads count; None: that of the dynamics
        """
        friction = build_friction(self.scene, self.parts.gears)
        chosen = system or self.vibration.system
        return motion(self.kinds, self.vibration, chosen, friction)

    def with_steps(self, steps: int, method: Any = None) -> Vibration:
        """Return the dynamics with about so many steps, slow errors left out.

        Parameters
        ----------
        steps : of a mesh period
        method : of integration; None: that of the scene
        """
        parts = self.parts
        grid = stages.stage_grid(parts.edges[:-1], steps)
        stepped = parts.with_steps(grid, self.vibration.hunting, self.vibration.period)
        return stepped._replace(method=method or self.vibration.method, slow=None)

    def solve(
        self, vibration: Vibration, start: Response | None = None, kinds: Any = None
    ) -> Response:
        """Return the response, tables included, slow errors left out.

        Parameters
        ----------
        vibration : the dynamics
        start : response of a neighbouring wear state, None: a cold start
        kinds : contact of every kind of mesh; None: of the first wear state
        """
        without_slow = (
            vibration if vibration.slow is None else vibration._replace(slow=None)
        )
        starts = None if start is None else (start,)
        return without_slow.solve(kinds or self.kinds, starts)[0]

    def force_of(
        self, vibration: Vibration, response: Response, phase: Array | None = None
    ) -> Array:
        """Return the elastic forces of all meshes, (n_periods, n_mesh · n_phases) [N].

        Parameters
        ----------
        vibration, response : the dynamics, and their response
        phase : (n_phases,) of the clock; None: those at which forces are compared [1]
        """
        phase = self.phase if phase is None else phase
        motions = vibration.motions(response, vibration.look(phase))
        return self.force(motions, phase)

    def force(self, motions: Deflections, phase: Array) -> Array:
        """Return the elastic mesh forces for mesh deflections.

        Parameters
        ----------
        motions : (n_periods, n_mesh, n_phases) deflections and their rates
        phase : (n_phases,) of the clock [1]

        Returns
        -------
        (n_periods, n_mesh · n_phases) [N]
        """
        parts = self.parts
        forces = [
            parts.forces(self.kinds, mesh, parts.locate(mesh, phase), motions).elastic
            for mesh in range(len(parts.meshes))
        ]
        return np.concatenate(forces, axis=1)

    def force_of_states(self, states: Array) -> Array:
        """Return the elastic mesh forces for states, as `force` does [N].

        Parameters
        ----------
        states : (n_periods, n_phases, 2n) at the phases at which forces are compared
        """
        direction = self.vibration.system.direction
        n = direction.shape[1]
        errors = [mesh.error.value(self.phase - mesh.lag) for mesh in self.parts.meshes]
        deflection = states[..., :n] @ direction.T - np.stack(errors, axis=-1)
        rate = states[..., n:] @ direction.T
        motions = Deflections(np.moveaxis(deflection, 2, 1), np.moveaxis(rate, 2, 1))
        return self.force(motions, self.phase)


def steady(scene: Scene) -> Steady:
    """Build the steady problem of a scene at its initial wear.

    Parameters
    ----------
    scene : with dynamics
    """
    parts = build(scene)
    assert parts.vibration is not None
    coupling = parts.coupling
    wear = initial_wear(scene, parts)
    neighbour = tuple(
        depth + quadratic(kind.analysis.grid.position, NEIGHBOUR)
        for kind, depth in zip(coupling.kinds, wear, strict=True)
    )
    return Steady(
        scene,
        parts,
        kinds=tuple(coupling.flanks(wear)),
        near=tuple(coupling.flanks(neighbour)),
    )


def relative_error(force: Array, reference: Array) -> float:
    """Return the largest difference of two forces over the largest force [1].

    Forces over more periods than one may begin in any of them; different periods
    compare as infinitely wrong.

    Parameters
    ----------
    force, reference : (n_periods, n_phases) [N]
    """
    if force.shape != reference.shape or not np.isfinite(force).all():
        return float("inf")
    difference = min(
        np.abs(np.roll(force, shift, axis=0) - reference).max()
        for shift in range(len(force))
    )
    return float(difference / np.abs(reference).max())

"""The steady state of a scene as a problem, and a tight reference of it that a second method confirms."""

from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab.accuracy.equation import Motion, landing, motion, motion_within
from wearlab.arrays import Array
from wearlab.assembly import GearModel, build
from wearlab.assembly.vibration import build_friction
from wearlab.dynamics.integrators import count, kernel
from wearlab.dynamics.rigid import balance_of, true_derivative
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.system import System
from wearlab.life.coupled import Vibration
from wearlab.mesh import excitation, stages
from wearlab.mesh.force import Deflections
from wearlab.scene import Scene
from wearlab.simulation.life_run import initial_wear
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
        """Return the equation of motion for foreign integrators, with the loads that ``system`` has."""
        friction = build_friction(self.scene, self.parts.gears)
        return motion(
            self.kinds, self.vibration, system or self.vibration.system, friction
        )

    def with_steps(self, steps: int, method: Any = None) -> Vibration:
        """Return the dynamics with about ``steps`` steps a mesh period, by ``method`` if one is given."""
        parts = self.parts
        chosen = method or self.vibration.method
        grid = stages.stage_grid(parts.edges[:-1], steps)
        stepped = parts.with_steps(grid, self.vibration.hunting, self.vibration.period)
        return stepped._replace(method=chosen, slow=None)

    def solve(
        self, vibration: Vibration, start: Response | None = None, kinds: Any = None
    ) -> Response:
        """Return the response, tables included, slow errors left out.

        ``kinds`` [of the first state].
        """
        free = vibration if vibration.slow is None else vibration._replace(slow=None)
        return free.solve(kinds or self.kinds, None if start is None else (start,))[0]

    def force_of(
        self, vibration: Vibration, response: Response, phase: Array | None = None
    ) -> Array:
        """Return the elastic forces of all meshes, (n_periods, n_mesh · n_phases) [N]."""
        phase = self.phase if phase is None else phase
        return self.force(vibration.motions(response, vibration.look(phase)), phase)

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
        meshes = range(len(self.parts.meshes))
        each = [
            parts.forces(self.kinds, mesh, parts.locate(mesh, phase), motions).elastic
            for mesh in meshes
        ]
        return np.concatenate(each, axis=1)

    def force_of_states(self, states: Array) -> Array:
        """Return the elastic mesh forces for states (n_periods, n_phases, 2n), as `force` does [N]."""
        direction = self.vibration.system.direction
        n = direction.shape[1]
        meshes = self.parts.meshes
        error = np.stack(
            [mesh.error.value(self.phase - mesh.lag) for mesh in meshes], axis=-1
        )
        deflection = states[..., :n] @ direction.T - error
        rate = states[..., n:] @ direction.T
        return self.force(
            Deflections(np.moveaxis(deflection, 2, 1), np.moveaxis(rate, 2, 1)),
            self.phase,
        )


def steady(scene: Scene) -> Steady:
    """Build the steady problem of a scene at its initial wear."""
    parts = build(scene)
    assert parts.vibration is not None
    coupling = parts.coupling
    wear = initial_wear(scene, parts)
    nodes = [kind.analysis.grid.position for kind in coupling.kinds]
    near = [
        depth + quadratic(own, NEIGHBOUR)
        for own, depth in zip(nodes, wear, strict=True)
    ]
    return Steady(
        scene, parts, tuple(coupling.flanks(wear)), tuple(coupling.flanks(tuple(near)))
    )


def relative_error(force: Array, reference: Array) -> float:
    """Return the largest difference of two forces (n_periods, n_phases) over the largest force [1].

    Forces over more periods than one may begin in any of them; different periods
    compare as infinitely wrong.
    """
    if force.shape != reference.shape or not np.isfinite(force).all():
        return float("inf")
    turns = (np.roll(force, k, axis=0) for k in range(len(force)))
    return float(
        min(np.abs(turn - reference).max() for turn in turns) / np.abs(reference).max()
    )


TIGHT = 1e-10
LANDING_TOLERANCE = 3e-13
CLOSED = 3e-12
MOST_CLOSINGS = 8
STEPS = 200
"""Least steps of a mesh period by the second method: it is not told of changes of
contact."""


class Unsuited(ValueError):
    """A response that has no one reference: aperiodic, or its slow errors turn."""


class Reference(NamedTuple):
    """The answer.

    Parameters
    ----------
    force : (n_periods, n_mesh · n_phases) elastic mesh forces [N]
    start : (2n,) state at phase 0 of the first period
    response : the tight response it was read off
    disagreement : relative difference of the second method [1]
    multiplier : largest modulus of the Floquet multipliers [1]
    """

    force: Array
    start: Array
    response: Response
    disagreement: float
    multiplier: float


def reference(problem: Steady, *, checked: bool = True) -> Reference:
    """Return the steady mesh force to about 1e-10, and how well a second method agrees.

    Parameters
    ----------
    problem : the steady state of a scene
    checked : whether the second method is asked; without it the disagreement is
        unknown, NaN

    Raises
    ------
    Unsuited
        When the response is aperiodic or its slow errors turn.
    """
    if problem.vibration.hunting > 1:
        raise Unsuited("slow errors turn: no second method follows them")
    tight = problem.with_steps(tight_steps(problem), Periodic())
    response = problem.solve(tight)
    if response.period == 0:
        raise Unsuited("aperiodic response")
    force = problem.force_of(tight, response)
    start = response.state[0, 0]
    largest = float(np.abs(response.multipliers).max())
    if problem.vibration.fluctuation is not None or not checked:
        return Reference(force, start, response, float("nan"), largest)
    other = second_method(problem, problem.motion(response.system), response)
    return Reference(force, start, response, relative_error(other, force), largest)


def tight_steps(
    problem: Steady, tolerance: float = TIGHT, *, exact: bool | None = None
) -> int:
    """Return the steps a mesh period that make the error of the default method about ``tolerance``.

    Parameters
    ----------
    problem, tolerance : the steady state, relative error wanted [1]
    exact : whether steps are exact, None: as the default method's are; False: those of
        RK4
    """
    vibration = problem.vibration
    segments = len(problem.parts.edges) - 1
    exact = not kernel.is_small(vibration.system) if exact is None else exact
    rule = count.exact_steps_per_period if exact else count.steps_per_period
    return rule(
        vibration.system,
        stiffest_meshes(problem),
        vibration.period,
        tolerance,
        segments,
    )


def stiffest_meshes(problem: Steady) -> Array:
    """Return the largest stiffness of every mesh over a period, (n_mesh,) [N/m]."""
    kinds = [
        kind.analysis.quasistatic(kind.nodes, kind.analysis.at_nodes)
        for kind in problem.kinds
    ]
    return np.array([kinds[mesh.kind].tangent.max() for mesh in problem.parts.meshes])


def second_method(problem: Steady, given: Motion, response: Response) -> Array:
    """Return the mesh forces (n_periods, n_mesh · n_phases) [N] of the orbit that DOP853 closes nearby."""
    rows = 2 * len(given.push)
    periods = response.period
    derivative = response.derivative
    assert derivative is not None  # what shooting finds has one
    balance = balance_of(problem.vibration.system, response.mesh_period)
    if len(balance.held):
        derivative = true_derivative(problem.vibration.system, balance, derivative)
    scale = np.abs(response.state).max(axis=(0, 1))
    state = response.state[0, 0].copy()
    for _ in range(MOST_CLOSINGS):
        states, end = over_periods(given, state, periods, problem.phase, scale)
        missing = end - state
        if np.abs(missing / scale).max() <= CLOSED:
            break
        # A set free to turn has an orbit in every position: the nearest is taken.
        matrix = np.eye(rows) - derivative * scale / scale[:, None]
        state = state + scale * np.linalg.lstsq(matrix, missing / scale, rcond=1e-9)[0]
    return problem.force_of_states(states)


def over_periods(
    given: Motion, start: Array, periods: int, phases: Array, scale: Array
) -> tuple[Array, Array]:
    """Integrate mesh periods by DOP853, as `landing` does.

    ``scale`` (2n,) is the size of the states.
    """

    def solve(piece: int, begun: float, state: Array, times: Array) -> Array:
        cells = given.first_cell[piece : piece + 2]
        found: Array = solve_ivp(
            motion_within,
            (begun, times[-1]),
            state,
            "DOP853",
            times,
            args=(given, *cells),
            rtol=LANDING_TOLERANCE,
            atol=LANDING_TOLERANCE * scale,
            max_step=given.period / STEPS,
        ).y.T
        return found

    return landing(given, start, periods, phases, solve)

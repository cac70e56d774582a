"""A tight reference of a steady state, verified by a second method that shares no integrator with the first.

First: our own period map with many steps. Second: SciPy's DOP853 on the compiled equation of motion, landing
on every jump and on every change of contact, closed by a chord Newton iteration of its own.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab.accuracy.cells import Motion
from wearlab.accuracy.motion import approaches, motion_held
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.arrays import Array
from wearlab.dynamics.balance import balance_of, true_derivative
from wearlab.dynamics.multipliers import over_sections
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.shooting import Shooting
from wearlab.dynamics.steps import exact_steps_per_period, steps_per_period
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.system import System

TIGHT = 1e-10
LANDING_TOLERANCE = 3e-13
CLOSED = 3e-12
MOST_CLOSINGS = 8
MOST_EVENTS = 200


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
    checked : whether the second method is asked; without it the disagreement is unknown, NaN

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


def tight_steps(problem: Steady, tolerance: float = TIGHT) -> int:
    """Return the steps a mesh period that make the error of the default method about ``tolerance``."""
    if in_registers(problem.vibration.system):
        return marching_steps(problem, tolerance)
    return _steps(problem, exact_steps_per_period, tolerance)


def marching_steps(problem: Steady, tolerance: float) -> int:
    """Return the steps a mesh period that make the error of marching by RK4 about ``tolerance``."""
    return _steps(problem, steps_per_period, tolerance)


def _steps(problem: Steady, rule: Callable[..., int], tolerance: float) -> int:
    vibration, segments = problem.vibration, len(problem.parts.edges) - 1
    return rule(vibration.system, stiffest_meshes(problem), vibration.period, tolerance, segments)


def stiffest_meshes(problem: Steady) -> Array:
    """Return the largest stiffness of every mesh over a period, (n_mesh,) [N/m]."""
    stiffness = [
        kind.analysis.quasistatic(kind.nodes, kind.analysis.at_nodes).tangent.max() for kind in problem.kinds
    ]
    return np.array([stiffness[mesh.kind] for mesh in problem.parts.meshes])


def second_method(problem: Steady, given: Motion, response: Response) -> Array:
    """Return the mesh forces (n_periods, n_mesh · n_phases) [N] of the orbit that DOP853 closes nearby."""
    rows, periods = 2 * len(given.push), response.period
    derivative = period_derivative(problem.vibration.system, response)
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


def period_derivative(system: System, response: Response) -> Array:
    """Return the derivative of the map over all periods of a response, (2n, 2n)."""
    balance = balance_of(system, response.mesh_period)
    if response.map_derivative is not None:
        known = response.map_derivative
        known = known if balance is None else true_derivative(system, balance, known)
        return over_sections(system, known, response.sections)
    shooting = Shooting(system, response.tables, response.mesh_period)
    derivative = np.eye(shooting.rows)
    for period in range(response.period):
        derivative = shooting.path_of(response.state[period, 0].copy())[1] @ derivative
    return derivative


def over_periods(
    given: Motion, start: Array, periods: int, phases: Array, scale: Array
) -> tuple[Array, Array]:
    """Integrate mesh periods from jump to jump and from change of contact to change of contact.

    Parameters
    ----------
    given : the equation of motion
    start : (2n,) state at phase 0
    periods : how many
    phases : (n_phases,) where states are wanted, ascending in [0, 1) [1]
    scale : (2n,) size of the states, for the absolute tolerance

    Returns
    -------
    states (periods, n_phases, 2n), state at the end (2n,)
    """
    states = np.empty((periods, len(phases), len(start)))
    state = start
    for period in range(periods):
        for segment in range(len(given.first_cell) - 1):
            low, high = given.breaks[segment], given.breaks[segment + 1]
            inside = np.flatnonzero((phases >= low - 1e-12) & (phases < high - 1e-12))
            along, state = _over_segment(given, segment, state, phases[inside] * given.period, scale)
            states[period, inside] = along
    return states, state


def _over_segment(
    given: Motion, segment: int, state: Array, times: Array, scale: Array
) -> tuple[Array, Array]:
    cells = int(given.first_cell[segment]), int(given.first_cell[segment + 1])
    now, end = given.breaks[segment] * given.period, given.breaks[segment + 1] * given.period
    contact = approaches(now, state, given, *cells) > 0.0
    states = np.empty((len(times), len(state)))
    for _ in range(MOST_EVENTS):
        solution = solve_ivp(
            motion_held, (now, end), state, method="DOP853", args=(given, *cells, contact),
            rtol=LANDING_TOLERANCE, atol=LANDING_TOLERANCE * scale, max_step=given.period / 200,
            dense_output=True, events=_change(given, cells, contact),
        )  # fmt: skip
        reached = solution.t[-1]
        here = (times >= now - 1e-15) & (times <= reached)
        if here.any():
            states[here] = solution.sol(times[here]).T
        now, state = reached, solution.y[:, -1]
        if solution.status != 1:
            break
        left = _agreement(now, state, given, cells, contact)
        contact = contact ^ (left <= max(0.0, float(left.min())))
    return states, state


def _agreement(time: float, state: Array, given: Motion, cells: tuple[int, int], contact: Array) -> Array:
    """Return how far every flank is from losing or gaining contact, negative where it has [m]."""
    approach = approaches(time, state, given, *cells)
    return np.where(contact, approach, -approach)


def _change(given: Motion, cells: tuple[int, int], contact: Array) -> Callable[..., float]:
    """Return the event at which some pair or back flank gains or loses contact."""

    def event(time: float, state: Array, *unused: Any) -> float:
        return float(_agreement(time, state, given, cells, contact).min())

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event

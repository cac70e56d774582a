"""A tight reference of a steady state, verified by a second method that shares no integrator with the first.

First: our RK4 period map with many steps. Second: SciPy's DOP853 on the compiled equation of motion, landing
on every jump and on every change of contact, closed by a chord Newton iteration of its own.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wearlab.accuracy.cells import Motion
from wearlab.accuracy.motion import approaches, motion_held
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.shooting import Shooting
from wearlab.dynamics.steps import steps_per_period

Array = NDArray[np.float64]

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
    force : (n_periods, n_phases) elastic mesh force [N]
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


def reference(problem: Steady) -> Reference:
    """Return the steady mesh force to about 1e-10, and how well a second method agrees.

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
    if problem.vibration.fluctuation is not None:
        return Reference(force, start, response, float("nan"), largest)
    other = second_method(problem, problem.motion(), response)
    return Reference(force, start, response, relative_error(other, force), largest)


def tight_steps(problem: Steady) -> int:
    """Return the steps a mesh period that make RK4's error about ``TIGHT``."""
    analysis, vibration = problem.analysis, problem.vibration
    grid = analysis.grid
    stiffest = float(analysis.quasistatic(problem.mesh.nodes, analysis.at_nodes).tangent.max())
    return steps_per_period(vibration.system, stiffest, vibration.period, TIGHT, len(grid.intervals))


def second_method(problem: Steady, given: Motion, response: Response) -> Array:
    """Return the mesh force (n_periods, n_phases) [N] of the orbit that DOP853 closes near ``response``."""
    rows, periods = 2 * given.n, response.period
    shooting = Shooting(problem.vibration.system, response.tables, response.mesh_period)
    derivative = np.eye(rows)
    for period in range(periods):
        derivative = shooting.path_of(response.state[period, 0].copy())[1] @ derivative
    scale = np.abs(response.state).max(axis=(0, 1))
    state = response.state[0, 0].copy()
    for _ in range(MOST_CLOSINGS):
        states, end = over_periods(given, state, periods, problem.where.phase, scale)
        missing = end - state
        if np.abs(missing / scale).max() <= CLOSED:
            break
        state = state + np.linalg.solve(np.eye(rows) - derivative, missing)
    return problem.force_of_states(states)


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
            found, state = _over_segment(given, segment, state, phases[inside] * given.period, scale)
            states[period, inside] = found
    return states, state


def _over_segment(
    given: Motion, segment: int, state: Array, times: Array, scale: Array
) -> tuple[Array, Array]:
    cells = int(given.first_cell[segment]), int(given.first_cell[segment + 1])
    now, end = given.breaks[segment] * given.period, given.breaks[segment + 1] * given.period
    contact = approaches(now, state, given.flat, *cells) > 0.0
    found = np.empty((len(times), len(state)))
    for _ in range(MOST_EVENTS):
        solution = solve_ivp(
            motion_held, (now, end), state, method="DOP853", args=(given.flat, *cells, contact),
            rtol=LANDING_TOLERANCE, atol=LANDING_TOLERANCE * scale, max_step=given.period / 200,
            dense_output=True, events=_changes(given, cells, contact),
        )  # fmt: skip
        reached = solution.t[-1]
        here = (times >= now - 1e-15) & (times <= reached)
        if here.any():
            found[here] = solution.sol(times[here]).T
        now, state = reached, solution.y[:, -1]
        if solution.status != 1:
            break
        changed = [p for p, when in enumerate(solution.t_events) if len(when)]
        contact = contact.copy()
        contact[changed] = ~contact[changed]
    return found, state


def _changes(given: Motion, cells: tuple[int, int], contact: Array) -> list[Callable[..., float]]:
    """Return the events at which each pair, and the back flank, gains or loses contact."""
    events: list[Callable[..., float]] = []
    for p in range(given.pairs + 1):

        def event(time: float, state: Array, *unused: Any, p: int = p) -> float:
            return float(approaches(time, state, given.flat, *cells)[p])

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0 if contact[p] else 1.0  # type: ignore[attr-defined]
        events.append(event)
    return events

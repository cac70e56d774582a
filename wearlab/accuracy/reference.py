"""A tight reference of a steady state that a second method confirms."""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab.accuracy.equation import Motion, landing, motion_within
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.arrays import Array
from wearlab.dynamics.integrators import count, kernel
from wearlab.dynamics.rigid import balance_of, true_derivative
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response

TIGHT = 1e-10
"""Relative error of the reference."""
SECOND_TOLERANCE = 3e-13
"""Relative tolerance of the second method."""
CLOSED = 3e-12
"""Distance between both ends of an orbit over its size, below which it is closed."""
MAX_CORRECTIONS = 8
"""Newton corrections of an orbit of the second method."""
MIN_STEPS = 200
"""Steps of a mesh period by the second method, at least: it does not know of changes of
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
    multiplier = float(np.abs(response.multipliers).max())
    disagreement = float("nan")
    if problem.vibration.fluctuation is None and checked:
        second = second_method(problem, problem.motion(response.system), response)
        disagreement = relative_error(second, force)
    return Reference(force, start, response, disagreement, multiplier)


def tight_steps(
    problem: Steady, tolerance: float = TIGHT, *, exact: bool | None = None
) -> int:
    """Return the steps a mesh period at which the default method errs by a tolerance.

    Parameters
    ----------
    problem, tolerance : the steady state, relative error wanted [1]
    exact : whether steps are exact, None: as the default method's are; False: those of
        RK4
    """
    vibration = problem.vibration
    if exact is None:
        exact = not kernel.is_small(vibration.system)
    rule = count.exact_steps_per_period if exact else count.steps_per_period
    return rule(
        vibration.system,
        stiffest_meshes(problem),
        vibration.period,
        tolerance,
        segments=len(problem.parts.edges) - 1,
    )


def stiffest_meshes(problem: Steady) -> Array:
    """Return the largest stiffness of every mesh over a period, (n_mesh,) [N/m].

    Parameters
    ----------
    problem : steady state in its first wear state
    """
    of_kinds = [
        kind.analysis.quasistatic(kind.nodes, kind.analysis.at_nodes).tangent.max()
        for kind in problem.kinds
    ]
    return np.array([of_kinds[mesh.kind] for mesh in problem.parts.meshes])


def second_method(problem: Steady, equation: Motion, response: Response) -> Array:
    """Return the mesh forces of the orbit that DOP853 closes next to a response.

    Parameters
    ----------
    problem : steady state of a scene
    equation : its equation of motion
    response : of the default method, where Newton's method begins

    Returns
    -------
    (n_periods, n_mesh · n_phases) [N]
    """
    rows = 2 * len(equation.push)
    periods = response.period
    derivative = response.derivative
    assert derivative is not None  # what shooting finds has one
    system = problem.vibration.system
    balance = balance_of(system, response.mesh_period)
    if len(balance.held):
        derivative = true_derivative(system, balance, derivative)

    scale = np.abs(response.state).max(axis=(0, 1))
    scaled_derivative = derivative * scale / scale[:, None]
    state = response.state[0, 0].copy()
    for _ in range(MAX_CORRECTIONS):
        states, end = over_periods(equation, state, periods, problem.phase, scale)
        missing = (end - state) / scale
        if np.abs(missing).max() <= CLOSED:
            break
        # A set free to turn has an orbit in every position: the nearest is taken.
        matrix = np.eye(rows) - scaled_derivative
        state = state + scale * np.linalg.lstsq(matrix, missing, rcond=1e-9)[0]
    return problem.force_of_states(states)


def over_periods(
    equation: Motion, start: Array, periods: int, phases: Array, scale: Array
) -> tuple[Array, Array]:
    """Integrate mesh periods by DOP853, as `landing` does.

    Parameters
    ----------
    equation, start, periods, phases : as for `landing`
    scale : (2n,) size of the states
    """

    def solve(piece: int, begin: float, state: Array, times: Array) -> Array:
        cells = equation.first_cell[piece : piece + 2]
        solution = solve_ivp(
            motion_within,
            (begin, times[-1]),
            state,
            "DOP853",
            times,
            args=(equation, *cells),
            rtol=SECOND_TOLERANCE,
            atol=SECOND_TOLERANCE * scale,
            max_step=equation.period / MIN_STEPS,
        )
        return np.asarray(solution.y.T)

    return landing(equation, start, periods, phases, solve)

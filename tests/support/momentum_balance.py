"""What the mean of all forces leaves of the loads, over an orbit: nothing, by momentum.

Where contact lasts, forces are integrated along the motion that the response keeps. The
polynomials of that motion do not bend where contact changes: such a step is integrated
from the state at its start, under the viscous law written out, any other law by SciPy
under the package's own forces, and what is left is the difference of both ends.
"""

from dataclasses import replace

import numpy as np
from law_written_out import integrated, written_out
from scipy.integrate import solve_ivp

from wearlab.dynamics.steady.response import Response, dashpot_of, forces_at
from wearlab.mesh.force import Deflections, NormalForces, normal_forces
from wearlab.mesh.stages import parabola

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
X = 0.5 + 0.5 * NODES
WEIGHTS = 0.5 * WEIGHTS
MAX_PERIODS = 24
"""Periods looked at of an aperiodic motion, the first of those that are kept."""
CLOSE = 1e-10
"""Impulse of a step over that of the load in a period, above which the motion that is
kept does not serve."""
STILL = 1e-6
"""Size of a coordinate over the largest, below which errors of its motion are measured
by that."""


def unbalanced(response: Response) -> np.ndarray:
    """Return what the mean of all forces leaves of the loads on every coordinate, over
    the largest load.

    Of an aperiodic motion less the change of momentum over the periods that are looked
    at.
    """
    response = replace(response, between=None)  # the parabolas that the steps know
    system = response.system
    kept = min(MAX_PERIODS, len(response.state))
    largest = np.abs(system.load).max()
    left = np.zeros(len(system.load))
    for period in range(kept):
        of_steps = _of_steps(response, period) / largest
        for step in np.flatnonzero(np.abs(of_steps).max(axis=1) > CLOSE):
            of_steps[step] = _anew(response, period, int(step)) / largest
        left += of_steps.sum(axis=0) / kept
    return left


def _gain(response: Response, period: int) -> np.ndarray:
    """Return the momentum that each step adds, over the mesh period, (n_steps, n)."""
    n = len(response.system.load)
    speed = response.state[period, :, n:]
    return np.asarray(
        np.diff(speed, axis=0) @ response.system.mass / response.mesh_period
    )


def _of_steps(response: Response, period: int) -> np.ndarray:
    """Return the impulse of load less forces that the momentum gained does not account
    for, (n_steps, n).
    """
    count = len(response.tables.width)
    steps = np.repeat(np.arange(count), len(X))
    x = np.tile(X, count)
    own = slice(period, period + 1)
    q, v = (part[period] for part in response.motion.at(steps, x))
    left = _left(response, forces_at(response, steps, x, own), steps, x, q, v).reshape(
        count, len(X), -1
    )
    return np.asarray(
        np.einsum("s,x,sxn->sn", response.tables.width, WEIGHTS, left)
        - _gain(response, period)
    )


def _anew(response: Response, period: int, step: int) -> np.ndarray:
    """Return by what momentum a step under the forces that wear ends
    elsewhere, over a period, (n,).
    """
    system = response.system
    n, start, end = len(system.load), *response.state[period, step : step + 2]
    sizes = np.abs(response.state[period]).max(axis=0).reshape(2, n)
    scale = np.maximum(sizes, STILL * sizes.max(axis=1, keepdims=True)).ravel()
    if system.damping_law is None:
        reached = integrated(written_out(response, step), start, scale)
    else:
        reached = _by_scipy(response, step, start, scale)
    return np.asarray(system.mass @ (reached[n:] - end[n:]) / response.mesh_period)


def _by_scipy(
    response: Response, step: int, start: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Return the state at the end of a step under the package's own forces, (2n,)."""
    system = response.system
    tables = response.tables
    n = len(system.load)
    length = tables.width[step] * response.mesh_period
    inverse = np.linalg.inv(system.mass)
    dashpot = dashpot_of(system)
    steps = np.array([step])

    def rate(x: float, state: np.ndarray) -> np.ndarray:
        at = np.array([x])
        q = state[None, :n]
        v = state[None, n:]
        error, slope = tables.errors_at(steps, at)
        motion = Deflections(
            (q @ system.direction.T - error)[None],
            (v @ system.direction.T - slope / response.mesh_period)[None],
        )
        forces = normal_forces(
            tables.springs_at(steps, at).per(response.mesh_period), motion, dashpot
        )
        return (
            length * np.r_[v[0], inverse @ _left(response, forces, steps, at, q, v)[0]]
        )

    tight = solve_ivp(
        rate, (0.0, 1.0), start, "DOP853", rtol=1e-12, atol=1e-13 * scale, max_step=0.1
    )
    assert tight.success
    return np.asarray(tight.y[:, -1])


def _left(
    response: Response,
    forces: NormalForces,
    steps: np.ndarray,
    x: np.ndarray,
    q: np.ndarray,
    v: np.ndarray,
) -> np.ndarray:
    """Return the loads less the forces on every coordinate, (n_points, n)."""
    system = response.system
    tables = response.tables
    left = system.load - forces.normal[0] @ system.direction
    left = left - q @ system.total_stiffness.T - v @ system.total_damping.T
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        left = (
            left
            + parabola(tables.fluctuation, steps, x)[:, None]
            * system.fluctuation_direction
        )
    rubbing = (
        (tables.sliding, system.friction_constant),
        (tables.moment, system.friction_slope),
    )
    for table, vectors in rubbing:
        if table is not None and vectors is not None:
            left = (
                left
                - (parabola(table, steps, x) * forces.pair_normal[0]).sum(axis=-1)
                @ vectors
            )
    return np.asarray(left)

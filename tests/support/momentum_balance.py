"""What the mean of all forces leaves of the loads, over an orbit: nothing, by momentum."""

import numpy as np

from wearlab.dynamics.orbits.response import Response, forces_at
from wearlab.mesh.force import NormalForces
from wearlab.mesh.stages import parabola

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
LOOKS = np.array([1e-9, 0.25, 0.5, 0.75, 1.0 - 1e-9])
HALVINGS = 24
"""Of a step in which contact changes: what is left of it weighs nothing."""


def unbalanced(response: Response) -> np.ndarray:
    """Return what the mean of all forces leaves of the loads on every coordinate, over the largest load.

    Of an aperiodic motion less the change of momentum over the periods that were kept.
    """
    system, width = response.system, response.tables.width
    kept, n = len(response.state), len(response.system.load)
    left = np.zeros(n)
    for period in range(kept):
        step = np.arange(len(width))
        low, high = np.zeros(len(width)), np.ones(len(width))
        for _ in range(HALVINGS):
            changes = _changes(response, period, step, low, high)
            left += _over(response, period, step[~changes], low[~changes], high[~changes]) / kept
            step, low, high = step[changes], low[changes], high[changes]
            middle = 0.5 * (low + high)
            step, low, high = np.r_[step, step], np.r_[low, middle], np.r_[middle, high]
        left += _over(response, period, step, low, high) / kept
    gained = response.state[-1, -1, n:] - response.state[0, 0, n:]
    left -= system.mass @ gained / (kept * response.mesh_period)
    return np.asarray(left / np.abs(system.load).max())


def _points(low: np.ndarray, high: np.ndarray, x: np.ndarray) -> np.ndarray:
    return (low[:, None] + (high - low)[:, None] * x).ravel()


def _changes(
    response: Response, period: int, step: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return in which parts of steps another flank begins or ceases to touch or to push."""
    if not len(step):
        return np.zeros(0, bool)
    own = slice(period, period + 1)
    forces = forces_at(response, np.repeat(step, len(LOOKS)), _points(low, high, LOOKS), own)
    pattern = [forces.pair > 0.0, forces.pair_normal > 0.0, (forces.elastic < 0.0)[..., None]]
    seen = np.concatenate(pattern, axis=-1)[0].reshape(len(step), len(LOOKS), -1)
    return np.asarray((seen != seen[:, :1]).any(axis=(1, 2)))


def _over(response: Response, period: int, step: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the integral of load less forces over parts of steps, in shares of the mesh period, (n,)."""
    system, tables = response.system, response.tables
    if not len(step):
        return np.zeros(len(system.load))
    own, steps, x = (
        slice(period, period + 1),
        np.repeat(step, len(NODES)),
        _points(low, high, 0.5 + 0.5 * NODES),
    )
    forces: NormalForces = forces_at(response, steps, x, own)
    q, v = (part[period] for part in response.motion.at(steps, x))
    left = system.load - forces.normal[0] @ system.direction
    left = left - q @ system.total_stiffness.T - v @ system.total_damping.T
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        left = left + parabola(tables.fluctuation, steps, x)[:, None] * system.fluctuation_direction
    rubbing = ((tables.sliding, system.friction_constant), (tables.moment, system.friction_slope))
    for table, vectors in rubbing:
        if table is not None and vectors is not None:
            left = left - (parabola(table, steps, x) * forces.pair_normal[0]).sum(axis=-1) @ vectors
    weight = np.repeat(tables.width[step] * (high - low), len(NODES)) * np.tile(0.5 * WEIGHTS, len(step))
    return np.asarray(weight @ left)

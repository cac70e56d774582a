"""Newton shooting: the state that a number of mesh periods maps onto itself."""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from wearlab.arrays import Array
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.orbits.integrate import OnTables
from wearlab.dynamics.orbits.period_map import LOCATED, PERMANENT

CONVERGED, STALLED, SINGULAR = 0, 1, 2
SMALL_STEP = 1e-7
"""Size of the last step over that of the state."""
SAME_PATH = 1e-9
"""Difference of two paths, over the size of the state, that is rounding."""
HALVINGS = 6
LEAST_PIVOT = 1e-13
"""Least pivot of ``I − P`` over its largest entry with which it is not singular."""


class Shot(NamedTuple):
    """What a shooting came to.

    Parameters
    ----------
    code : `CONVERGED`, `STALLED` or `SINGULAR`
    passes : Newton steps
    checks : paths without tangents
    error : size of the last step
    changes : contact changes met in the last pass
    path : (periods · n_steps + 1, 2n) the answer
    derivative : (2n, 2n) of the map at the answer
    """

    code: int
    passes: int
    checks: int
    error: float
    changes: int
    path: Array
    derivative: Array


def exchange(balance: Balance, start: Array) -> None:
    """Let the sizes of the unknown loads and the coordinates held change places in ``start``."""
    balance.position[:] = start[balance.held]
    start[balance.held] = balance.size


def restore(balance: Balance, start: Array) -> None:
    """Undo `exchange`, keeping the sizes found."""
    balance.size[:] = start[balance.held]
    start[balance.held] = balance.position


def weighted_norm(values: Array, scale: Array) -> float:
    """Return the largest entry of states (…, 2n) in units of ``scale`` (2n,)."""
    return float(np.abs(values / scale).max())


def least_pivot(factors: Array, matrix: Array) -> float:
    """Return the least pivot of LU ``factors`` over the largest entry of ``matrix``; 0: not finite."""
    pivots, largest = np.abs(factors.diagonal()), np.abs(matrix).max()
    return float(pivots.min() / largest) if np.isfinite(pivots).all() and largest > 0.0 else 0.0


def fixed_point_matrix(balance: Balance, derivative: Array) -> Array:
    """Return ``I − P``, mended where the size of a load stands for a coordinate, (2n, 2n)."""
    matrix = np.eye(len(derivative)) - derivative
    matrix[balance.held, balance.held] -= 1.0
    return np.asarray(matrix)


def shoot(
    shooter: OnTables, plain: OnTables, periods: int, start: Array, contact: int, most: int, scale: Array
) -> Shot:
    """Find the orbit over ``periods`` mesh periods near ``start`` (2n,), which it moves.

    Newton's step solves ``(I − P) x = P(y) − y``; steps that lead away are halved. While contact does not
    change the map is affine: one step is exact when the path without tangents follows it.

    Parameters
    ----------
    shooter, plain : what integrates with tangents and without, with one balance
    periods : of the orbit
    start : near the orbit; where loads are unknown, they are the balance's
    contact : of the first pass: `LOCATED`, or `PERMANENT`, the affine map of a mesh whose pairs all touch
    most : passes allowed
    scale : (2n,) units of the state, see `weighted_norm`
    """
    balance, rows, states = shooter.kernel.balance, len(start), shooter.states(periods)
    exchange(balance, start)
    trial, step = start.copy(), np.zeros(rows)
    path, derivative = states[:, :, 0], np.empty((rows, rows))
    old_residual, halved, error, changes, checks = np.inf, 0, np.inf, 0, 0

    def shot(code: int, passes: int) -> Shot:
        restore(balance, start)
        return Shot(code, passes, checks, error, changes, path, derivative)

    for passes in range(1, most + 1):
        changes = shooter.advance(states, trial, contact)
        derivative = states[-1, :, 1 : 1 + rows].copy()
        missed = states[-1, :, 0] - states[0, :, 0]
        residual = weighted_norm(missed, scale)
        if contact != PERMANENT and not residual <= 4.0 * old_residual and halved < HALVINGS:
            halved += 1
            step *= 0.5
            trial = start + step
            continue
        start[:] = trial
        matrix = fixed_point_matrix(balance, derivative) * (scale / scale[:, None])
        factors, pivots, _ = dgetrf(matrix)
        if not least_pivot(factors, matrix) > LEAST_PIVOT:
            error = np.inf
            return shot(SINGULAR, passes)
        step = scale * dgetrs(factors, pivots, missed / scale)[0]
        error = weighted_norm(step, scale)
        path = states[:, :, 0] + states[:, :, 1 : 1 + rows] @ step
        exact = False
        if changes == 0 and shooter.kernel.meshes.law is None:
            checks += 1
            exact = follows(plain, path, start + step, scale)
        if exact or (contact != PERMANENT and error <= SMALL_STEP * weighted_norm(start, scale)):
            start += step
            return shot(CONVERGED, passes)
        trial = start + step
        old_residual = np.inf if contact == PERMANENT else residual
        halved, contact = 0, LOCATED
    return shot(STALLED, most)


def follows(plain: OnTables, path: Array, start: Array, scale: Array) -> bool:
    """Whether the motion from ``start`` takes a ``path`` (n_states, 2n) without a change of contact."""
    states = plain.states((len(path) - 1) // len(plain.tables.width))
    if plain.advance(states, start, LOCATED, tangents=False):
        return False
    return weighted_norm(states[:, :, 0] - path, scale) <= SAME_PATH * weighted_norm(path, scale)

"""The orbit of meshes that never lose contact: their period map is affine, and one linear solve finds it."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgecon, dgeev, dgetrf, dgetrs

from wearlab.dynamics.balance import Balance, balance_of, found_load, true_derivative
from wearlab.dynamics.collocation import affine_map
from wearlab.dynamics.response import Counts, Response, Verdict
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
REGULAR = 1e-13
"""Reciprocal condition of I − P above which its orbit is alone."""
RHS_PER_STEP = 2


def touching_orbit(system: System, tables: StageTables, period: float, margin: float) -> Response | None:
    """Return the response if no flank parts in it, None where one does or where orbits are not alone.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    margin : an orbit attracts when max |μ| < 1 − margin
    """
    balance = balance_of(system, period)
    found = affine_map(system, balance, tables, period) if system.load.any() else None
    if found is None:
        return None
    rows = len(found.whole)
    derivative, start = found.whole[:, :rows].copy(), found.whole[:, rows].copy()
    matrix = np.eye(rows)
    if balance is not None:
        # The size of a load stands for the coordinate it balances, which is held at 0.
        derivative[:, balance.held] = found.whole[:, rows + 1 :]
        matrix[balance.held, balance.held] = 0.0
    rate = 2.0 * np.pi * len(tables.width) / (16.0 * period)
    scale = np.repeat([1.0, rate], rows // 2)
    matrix = (matrix - derivative) * scale / scale[:, None]
    factors, pivots, failed = dgetrf(matrix)
    if failed or dgecon(factors, np.abs(matrix).sum(axis=0).max())[0] < REGULAR:
        return None
    start = scale * dgetrs(factors, pivots, start / scale)[0]
    sizes = np.empty(0)
    if balance is not None:
        sizes, balance.size[:] = start[balance.held], start[balance.held]
        start[balance.held] = 0.0
    path = found.path(start, sizes)
    if not touches(system, tables, period, path):
        return None
    multipliers = multipliers_of(system, balance, derivative)
    largest = abs(multipliers[0])
    if not largest <= 1.0 + margin:
        return None
    closure = float((np.abs(path[-1] - start) / scale).max() / (np.abs(path / scale).max() or 1.0))
    return Response(
        1, path[None], multipliers, Verdict(True, bool(largest < 1.0 - margin), True, True),
        Counts(1, len(tables.width) * RHS_PER_STEP, 1), closure, found_load(system, balance), tables, period,
        derivative,
    )  # fmt: skip


def touches(system: System, tables: StageTables, period: float, path: Array) -> bool:
    """Whether every pair in the path touches at the ends and in the middle of all steps.

    Parameters
    ----------
    path : (n_steps + 1, 2n) states at the ends of the steps
    """
    n, d = len(system.load), system.direction.T
    q, v = path[:, :n] @ d, path[:, n:] @ d
    bend = 0.125 * (tables.width * period)[:, None] * (v[:-1] - v[1:])
    stages = np.stack([q[:-1], 0.5 * (q[:-1] + q[1:]) + bend, q[1:]], axis=1) - tables.error
    approach = stages[..., None] - tables.gap
    return bool(((approach >= 0.0) | (tables.stiffness <= 0.0)).all())


def multipliers_of(system: System, balance: Balance | None, derivative: Array) -> NDArray[np.complex128]:
    """Return the multipliers, largest first; position and speed of a free rotation are left out."""
    matrix = derivative if balance is None else true_derivative(system, balance, derivative)
    real, imaginary, *_ = dgeev(matrix, compute_vl=0, compute_vr=0)
    found = real + 1j * imaginary
    if balance is not None:
        found = found[abs(found - 1.0).argsort()[2 * len(balance.held) :]]
    return np.asarray(found[abs(found).argsort()[::-1]], np.complex128)


def halved(tables: StageTables) -> StageTables:
    """Return the tables on steps half as long, from the parabola through the three stages of each."""
    to = np.array(
        [[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]]
    )

    def finer(table: Array) -> Array:
        five = np.einsum("xi,si...->sx...", to, table)
        both = np.stack([five[:, :3], five[:, 2:]], axis=1)
        return both.reshape(2 * len(table), 3, *table.shape[2:])

    values = {
        name: finer(table)
        for name, table in tables._asdict().items()
        if table is not None and name != "width"
    }
    return tables._replace(width=np.repeat(0.5 * tables.width, 2), **values)

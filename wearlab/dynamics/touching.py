"""The orbit of meshes that never lose contact: their period map is affine, and one linear solve finds it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgecon, dgeev, dgetrf

from wearlab.compiled import jit
from wearlab.dynamics.balance import Balance, balance_of, found_load, true_derivative
from wearlab.dynamics.collocation import affine_map
from wearlab.dynamics.neighbour import Closing, Found, Neighbour, corrected
from wearlab.dynamics.response import Counts, Response, Verdict
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
REGULAR = 1e-13
"""Reciprocal condition of I − P above which its orbit is alone."""
RHS_PER_STEP = 2


def touching_orbit(
    system: System, tables: StageTables, period: float, margin: float, near: Neighbour | None = None
) -> Response | None:
    """Return the response if no flank parts in it, None where one does or where orbits are not alone.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    margin : an orbit attracts when max |μ| < 1 − margin
    near : a case solved before, from which the orbit is looked for first
    """
    found = None if near is None else corrected(near, system, tables, period)
    if near is None or found is None:
        near, found = solved(system, balance_of(system, period), tables, period) or (None, None)
    if near is None or found is None or not touches(system, tables, period, found.path):
        return None
    largest = abs(found.multipliers[0])
    if not largest <= 1.0 + margin:
        return None
    verdict = Verdict(True, bool(largest < 1.0 - margin), True, True)
    counts = Counts(found.corrections, found.corrections * len(tables.width) * RHS_PER_STEP, 1)
    balance = None if near.balance is None else near.balance._replace(size=found.sizes)
    return Response(
        1, found.path[None], found.multipliers, verdict, counts, found.closure, found_load(system, balance),
        tables, period, near.derivative, near,
    )  # fmt: skip


def solved(
    system: System, balance: Balance | None, tables: StageTables, period: float
) -> tuple[Neighbour, Found] | None:
    """Return the orbit and what neighbours need of it; None where orbits are not alone.

    Parameters
    ----------
    system, balance, tables, period : the case, balance None where nothing is free
    """
    known = affine_map(system, balance, tables, period) if system.load.any() else None
    if known is None:
        return None
    rows = len(known.whole)
    derivative, held = known.whole[:, :rows].copy(), np.empty(0, np.int64)
    matrix = np.eye(rows)
    if balance is not None:
        # The size of a load stands for the coordinate it balances, which is held at 0.
        held = balance.held
        derivative[:, held] = known.whole[:, rows + 1 :]
        matrix[held, held] = 0.0
    rate = 2.0 * np.pi * len(tables.width) / (16.0 * period)
    scale = np.repeat([1.0, rate], rows // 2)
    matrix = (matrix - derivative) * scale / scale[:, None]
    factors, pivots, failed = dgetrf(matrix)
    if failed or dgecon(factors, np.abs(matrix).sum(axis=0).max())[0] < REGULAR:
        return None
    closing = Closing((factors, pivots), scale, held)
    given = closing.of(known.whole[:, rows])
    given[rows] = 1.0
    path = known.path(given)
    multipliers = multipliers_of(system, balance, derivative)
    closure = float((np.abs(path[-1] - path[0]) / scale).max() / (np.abs(path / scale).max() or 1.0))
    near = Neighbour(
        system, balance, tables, period, given, known.whole[:, :rows], derivative, closing, multipliers
    )
    return near, Found(path, given[rows + 1 :], multipliers, closure, 1)


def touches(system: System, tables: StageTables, period: float, path: Array) -> bool:
    """Whether every pair in the path touches at the ends and in the middle of all steps.

    Parameters
    ----------
    path : (n_steps + 1, 2n) states at the ends of the steps
    """
    n, d = len(system.load), system.direction.T
    return bool(all_touch(path[:, :n] @ d, path[:, n:] @ d, period, *tables[:4]))


@jit
def all_touch(q: Any, v: Any, period: float, width: Any, stiffness: Any, gap: Any, error: Any) -> bool:
    """Whether no pair in the path parts; ``q``, ``v``: d·q and its rate at the ends of the steps."""
    for step in range(len(width)):
        for m in range(q.shape[1]):
            bend = 0.125 * width[step] * period * (v[step, m] - v[step + 1, m])
            middle = 0.5 * (q[step, m] + q[step + 1, m]) + bend
            for stage, at in enumerate((q[step, m], middle, q[step + 1, m])):
                for p in range(stiffness.shape[3]):
                    apart = not at - error[step, stage, m] - gap[step, stage, m, p] >= 0.0
                    if apart and stiffness[step, stage, m, p] > 0.0:
                        return False
    return True


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

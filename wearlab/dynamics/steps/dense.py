"""The Runge–Kutta step of a structure with full matrices: the trajectory alone."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.steps.kernel import VECTORS
from wearlab.dynamics.steps.mesh_law import END, MIDST, START


def dense_step(
    structure: Any,
    columns: Any,
    w: Any,
    source: Any,
    i: Any,
    target: Any,
    j: Any,
    mesh: Any,
    load: Any,
    h: Any,
) -> None:
    """Advance a trajectory alone at ``source[i:]`` by time ``h`` into ``target[j:]``.

    Parameters are those of `wearlab.dynamics.steps.rk4.diagonal_step`.

    References
    ----------
    Kutta, Z. Math. Phys. 46 (1901) 435–453.
    """
    n = len(structure.push)
    work = structure.work.reshape((VECTORS, n))
    q0, v0, q, v = work[0], work[1], work[2], work[3]
    first, second, third, fourth = work[4], work[5], work[6], work[7]
    for row in range(n):
        at = i + np.uint64(row) * w
        q0[row], v0[row] = source[at], source[at + np.uint64(n) * w]
    half, quarter = 0.5 * h, 0.25 * h * h
    _acceleration(structure, mesh, load, START, q0, v0, first, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row], v0[row] + half * first[row]
    _acceleration(structure, mesh, load, MIDST, q, v, second, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row] + quarter * first[row], v0[row] + half * second[row]
    _acceleration(structure, mesh, load, MIDST, q, v, third, w)
    for row in range(n):
        q[row] = q0[row] + h * v0[row] + 2.0 * quarter * second[row]
        v[row] = v0[row] + h * third[row]
    _acceleration(structure, mesh, load, END, q, v, fourth, w)
    for row in range(n):
        middles, to = second[row] + third[row], j + np.uint64(row) * w
        target[to] = q0[row] + h * v0[row] + h * h / 6.0 * (first[row] + middles)
        target[to + np.uint64(n) * w] = v0[row] + h / 6.0 * (first[row] + 2.0 * middles + fourth[row])


@jit_inner
def _acceleration(structure: Any, mesh: Any, load: Any, stage: int, q: Any, v: Any, a: Any, w: Any) -> None:
    """Write the acceleration at a stage into ``a`` (n,)."""
    n = len(structure.push)
    channels = len(structure.direction) // n
    for row in range(n):
        a[row] = load[np.uint64(stage * n + row) * w]
        for col in range(n):
            a[row] -= structure.stiffness[row, col] * q[col] + structure.damping[row, col] * v[col]
    for c in range(channels):
        place, speed = 0.0, 0.0
        for row in range(n):
            place += structure.direction[c * n + row] * q[row]
            speed += structure.direction[c * n + row] * v[row]
        at = stage * channels + c
        force = mesh[at] * place + mesh[3 * channels + at] * speed
        for row in range(n):
            a[row] -= structure.per_force[c * n + row] * force

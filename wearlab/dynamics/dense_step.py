"""The Runge–Kutta step of a structure with full matrices."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.registers import END, MIDST, START

VECTORS = 8
"""Vectors as long as the coordinates that a step takes as scratch."""


@jit_inner
def times(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out``, both (rows, columns)."""
    if x.shape[1] == 1:
        np.dot(matrix, x.reshape(x.shape[0]), out.reshape(out.shape[0]))
    else:
        np.dot(matrix, x, out)


def dense_step(
    structure: Any,
    meshes: Any,
    columns: Any,
    width: Any,
    source: Any,
    i: Any,
    target: Any,
    j: Any,
    mesh: Any,
    push: Any,
    h: Any,
) -> None:
    """Advance a trajectory alone at ``source[i:]`` by time ``h`` into ``target[j:]``, as `rk4_step` does.

    Tangents of a structure with full matrices go by exact steps, see `wearlab.dynamics.exact_step`.
    """
    n, channels, w = len(structure.push), len(meshes), len(width)
    work = structure.work.reshape((VECTORS, n))
    q0, v0, q, v = work[0], work[1], work[2], work[3]
    first, second, third, fourth = work[4], work[5], work[6], work[7]
    for row in range(n):
        q0[row], v0[row] = source[i + np.uint64(row * w)], source[i + np.uint64((n + row) * w)]
    half, quarter = 0.5 * h, 0.25 * h * h
    _acceleration(structure, channels, mesh, push, START, q0, v0, first, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row], v0[row] + half * first[row]
    _acceleration(structure, channels, mesh, push, MIDST, q, v, second, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row] + quarter * first[row], v0[row] + half * second[row]
    _acceleration(structure, channels, mesh, push, MIDST, q, v, third, w)
    for row in range(n):
        q[row] = q0[row] + h * v0[row] + 2.0 * quarter * second[row]
        v[row] = v0[row] + h * third[row]
    _acceleration(structure, channels, mesh, push, END, q, v, fourth, w)
    for row in range(n):
        middles = second[row] + third[row]
        target[j + np.uint64(row * w)] = q0[row] + h * v0[row] + h * h / 6.0 * (first[row] + middles)
        target[j + np.uint64((n + row) * w)] = v0[row] + h / 6.0 * (first[row] + 2.0 * middles + fourth[row])


@jit_inner
def _acceleration(
    structure: Any, channels: int, mesh: Any, push: Any, time: int, q: Any, v: Any, a: Any, w: int
) -> None:
    """Write the acceleration at stage time 0, 1 or 2 into ``a`` (n,), column after column of the matrices."""
    n = len(structure.push)
    across = structure.across
    for row in range(n):
        a[row] = push[np.uint64((time * n + row) * w)]
    for col in range(n):
        x, y, ks, cs = q[col], v[col], across[0, col], across[1, col]
        for row in range(n):
            a[row] -= ks[row] * x + cs[row] * y
    for c in range(channels):
        deflection, rate = 0.0, 0.0
        for row in range(c * n, (c + 1) * n):
            deflection += structure.direction[row] * q[row - c * n]
            rate += structure.direction[row] * v[row - c * n]
        force = mesh[time * channels + c] * deflection + mesh[3 * channels + c] * rate
        for row in range(n):
            a[row] -= structure.per_force[c * n + row] * force

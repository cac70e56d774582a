"""The Runge–Kutta step of a structure with full matrices, for all columns at once."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner

MATRICES = 9
"""Matrices as large as the coordinates in all columns that a step takes as scratch."""


@jit_inner(allocates=True)
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
    """Advance the state at ``source[i:]`` by time ``h`` into ``target[j:]``, as `rk4_step` does.

    The columns to advance are gathered first: they may be one of many.
    """
    n, channels, used, w = len(structure.load), len(meshes), np.int64(columns), len(width)
    if used == 1:
        _step_of_one(structure, channels, w, source, i, target, j, mesh, push, h)
        return
    size = n * used
    work = structure.work[: MATRICES * size].reshape((MATRICES, n, used))
    q0, v0, q, v, product, acceleration = work[0], work[1], work[2], work[3], work[4], work[5:9]
    for row in range(n):
        at, below = i + np.uint64(row * w), i + np.uint64((n + row) * w)
        for col in range(np.uint64(0), np.uint64(used)):
            q0[row, col], v0[row, col] = source[at + col], source[below + col]
    for stage in range(4):
        before, earlier = acceleration[max(stage - 1, 0)], acceleration[max(stage - 2, 0)]
        # Nyström form: the velocity takes the last stage's acceleration, the position the one before it.
        velocity_share = (0.0, 0.5 * h, 0.5 * h, h)[stage]
        position_share = (0.0, 0.0, 0.25 * h * h, 0.5 * h * h)[stage]
        for row in range(n):
            for col in range(used):
                q[row, col] = v0[row, col] * velocity_share + q0[row, col]
                v[row, col] = v0[row, col]
                if stage > 0:
                    q[row, col] += position_share * earlier[row, col]
                    v[row, col] += velocity_share * before[row, col]
        _dense_acceleration(
            structure, channels, mesh, push, (stage + 1) // 2, q, v, acceleration[stage], product, w
        )
    for row in range(n):
        at, below = j + np.uint64(row * w), j + np.uint64((n + row) * w)
        for col in range(np.uint64(0), np.uint64(used)):
            a1, a4 = acceleration[0, row, col], acceleration[3, row, col]
            middles = acceleration[1, row, col] + acceleration[2, row, col]
            target[at + col] = q0[row, col] + h * v0[row, col] + h * h / 6.0 * (a1 + middles)
            target[below + col] = v0[row, col] + h / 6.0 * (a1 + 2.0 * middles + a4)


@jit_inner
def _dense_acceleration(
    structure: Any, channels: int, mesh: Any, push: Any, time: int, q: Any, v: Any, a: Any, product: Any,
    w: int,
) -> None:  # fmt: skip
    """Write the acceleration at stage time 0, 1 or 2 (start, middle, end) into ``a`` (n, columns)."""
    n, used = q.shape
    times(structure.stiffness, q, a)
    times(structure.damping, v, product)
    for row in range(n):
        at = np.uint64((time * n + row) * w)
        for col in range(np.uint64(0), np.uint64(used)):
            a[row, col] = push[at + col] - a[row, col] - product[row, col]
    for c in range(channels):
        stiffness, damp = mesh[time * channels + c], mesh[3 * channels + c]
        direction = structure.direction[c * n : (c + 1) * n]
        response = structure.response[c * n : (c + 1) * n]
        force = product[0]
        force[:] = 0.0
        for row in range(n):
            if direction[row] != 0.0:
                k, d = direction[row] * stiffness, direction[row] * damp
                for col in range(np.uint64(0), np.uint64(used)):
                    force[col] += k * q[row, col] + d * v[row, col]
        for row in range(n):
            if response[row] != 0.0:
                for col in range(np.uint64(0), np.uint64(used)):
                    a[row, col] -= response[row] * force[col]


@jit_inner
def _step_of_one(
    structure: Any, channels: int, w: int, source: Any, i: Any, target: Any, j: Any, mesh: Any, push: Any,
    h: float,
) -> None:  # fmt: skip
    """Advance a trajectory alone: the same step, a fifth of its time where matrices meet single columns."""
    n = len(structure.load)
    work = structure.work[: MATRICES * n].reshape((MATRICES, n))
    q0, v0, q, v = work[0], work[1], work[2], work[3]
    first, second, third, fourth = work[4], work[5], work[6], work[7]
    for row in range(n):
        q0[row], v0[row] = source[i + np.uint64(row * w)], source[i + np.uint64((n + row) * w)]
    half, quarter = 0.5 * h, 0.25 * h * h
    _acceleration_of_one(structure, channels, mesh, push, 0, q0, v0, first, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row], v0[row] + half * first[row]
    _acceleration_of_one(structure, channels, mesh, push, 1, q, v, second, w)
    for row in range(n):
        q[row], v[row] = q0[row] + half * v0[row] + quarter * first[row], v0[row] + half * second[row]
    _acceleration_of_one(structure, channels, mesh, push, 1, q, v, third, w)
    for row in range(n):
        q[row] = q0[row] + h * v0[row] + 2.0 * quarter * second[row]
        v[row] = v0[row] + h * third[row]
    _acceleration_of_one(structure, channels, mesh, push, 2, q, v, fourth, w)
    for row in range(n):
        middles = second[row] + third[row]
        target[j + np.uint64(row * w)] = q0[row] + h * v0[row] + h * h / 6.0 * (first[row] + middles)
        target[j + np.uint64((n + row) * w)] = v0[row] + h / 6.0 * (first[row] + 2.0 * middles + fourth[row])


@jit_inner
def _acceleration_of_one(
    structure: Any, channels: int, mesh: Any, push: Any, time: int, q: Any, v: Any, a: Any, w: int
) -> None:
    """Write the acceleration at stage time 0, 1 or 2 into ``a`` (n,), column after column of the matrices."""
    n = len(structure.load)
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
            a[row] -= structure.response[c * n + row] * force

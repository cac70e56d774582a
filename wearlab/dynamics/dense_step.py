"""The Runge–Kutta step of a structure with full matrices, for all columns at once."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner, jit_inner_apart

MATRICES = 9
"""Matrices as large as the coordinates in all columns that a step takes as scratch."""


@jit_inner
def times(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out``, both (rows, columns)."""
    if x.shape[1] == 1:
        np.dot(matrix, x.reshape(x.shape[0]), out.reshape(out.shape[0]))
    else:
        np.dot(matrix, x, out)


@jit_inner_apart
def dense_step(
    structure: Any,
    channels: int,
    columns: Any,
    w: int,
    source: Any,
    i: Any,
    target: Any,
    j: Any,
    mesh: Any,
    push: Any,
    h: float,
) -> None:
    """Advance the state at ``source[i:]`` by time ``h`` into ``target[j:]``, as `rk4_step` does.

    The columns to advance are gathered first: they may be one of many.
    """
    n, used = len(structure.load), np.int64(columns)
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

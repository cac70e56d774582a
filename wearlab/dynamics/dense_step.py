"""The Runge–Kutta step of a structure with full matrices, for all columns at once."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner


@jit_inner
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
    """Advance the state at ``source[i:]`` by time ``h`` into ``target[j:]``, as `rk4_step` does."""
    n = len(structure.load)
    size, used = n * w, int(columns)
    old = source[i : i + np.uint64(2 * size)]
    new = target[j : j + np.uint64(2 * size)]
    q, v = structure.work[:size], structure.work[size : 2 * size]
    acceleration = structure.work[2 * size :]
    for stage in range(4):
        a = acceleration[stage * size : (stage + 1) * size]
        before = acceleration[max(stage - 1, 0) * size :]
        earlier = acceleration[max(stage - 2, 0) * size :]
        # Nyström form: the velocity takes the last stage's acceleration, the position the one before it.
        velocity_share = (0.0, 0.5 * h, 0.5 * h, h)[stage]
        position_share = (0.0, 0.0, 0.25 * h * h, 0.5 * h * h)[stage]
        for row in range(n):
            for col in range(used):
                x = row * w + col
                q[x] = old[x] + velocity_share * old[size + x] + position_share * earlier[x]
                v[x] = old[size + x] + velocity_share * before[x]
        _dense_acceleration(structure, channels, mesh, push, (stage + 1) // 2, q, v, a, w, used)
    for x in range(size):
        a1, a4 = acceleration[x], acceleration[3 * size + x]
        middles = acceleration[size + x] + acceleration[2 * size + x]
        new[x] = old[x] + h * old[size + x] + h * h / 6.0 * (a1 + middles)
        new[size + x] = old[size + x] + h / 6.0 * (a1 + 2.0 * middles + a4)


@jit_inner
def _dense_acceleration(
    structure: Any, meshes: int, mesh: Any, push: Any, time: int, q: Any, v: Any, a: Any, w: int, used: int
) -> None:
    """Write the acceleration at stage time 0, 1 or 2 (start, middle, end) into ``a``, row by row."""
    n = len(structure.load)
    for row in range(n):
        for col in range(used):
            a[row * w + col] = push[(time * n + row) * w + col]
        for other in range(n):
            k, c = structure.stiffness[row, other], structure.damping[row, other]
            if k != 0.0 or c != 0.0:
                for col in range(used):
                    a[row * w + col] -= k * q[other * w + col] + c * v[other * w + col]
    for m in range(meshes):
        stiffness, damp = mesh[time * meshes + m], mesh[3 * meshes + m]
        for col in range(used):
            force = 0.0
            for row in range(n):
                d = structure.direction[m * n + row]
                force += d * (stiffness * q[row * w + col] + damp * v[row * w + col])
            for row in range(n):
                a[row * w + col] -= structure.response[m * n + row] * force

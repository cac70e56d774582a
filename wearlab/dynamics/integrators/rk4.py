"""The classical Runge–Kutta step between changes of contact, for all columns at once.

While contact lasts, channels exert ``Q = k d·q + b d·q̇ − w`` with k, b and w known at
the stages. The trajectory (column 0) and its tangents (the other columns) then obey the
same linear equation; only column 0 has an inhomogeneous part. Columns lie side by side,
so they ride in one vector register and the tangents cost almost nothing.

A state is a flat row-major array (2n, width): n rows of q, then n rows of q̇. Offsets
are unsigned: a signed index may count from the end, and checking that stops the
compiler from vectorising.
"""

from typing import Any

import numpy as np

from wearlab.compiled import by_type, jit_inner
from wearlab.dynamics.integrators.kernel import (
    Dense,
    Diagonal,
    Propagated,
    add,
    put,
    structure_of,
    take,
    write,
)
from wearlab.dynamics.integrators.mesh_law import END, MIDST, START, motion_of
from wearlab.dynamics.integrators.propagator import exact_step


def diagonal_step(
    kernel: Any,
    step: int,
    columns: Any,
    w: Any,
    states: Any,
    i: Any,
    j: Any,
) -> None:
    """Advance the state at ``states[i:]`` by one step into ``states[j:]``.

    Parameters
    ----------
    kernel : the system, its structure
        `wearlab.dynamics.integrators.kernel.Diagonal`; the scratch has stiffness and
        damping of the channels, and the inputs
    step : of the tables
    columns, w : how many columns to advance, and how many a state has (uint64)
    states, i, j : flat arrays of states and offsets into them (uint64)

    References
    ----------
    Kutta, Z. Math. Phys. 46 (1901) 435–453.
    """
    structure = kernel.structure
    coordinates = kernel.structure.coordinates
    mesh = kernel.flanks.scratch.mesh[0]
    load = kernel.flanks.scratch.load
    _fill_load(kernel, w)
    n = len(coordinates)
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    below = np.uint64(n) * w
    half = 0.5 * h
    sixth = h / 6.0
    for col in range(np.uint64(0), columns):
        q = take(coordinates, states, i + col, w)
        v = take(coordinates, states, i + below + col, w)
        load_at_start = take(coordinates, load, col, w)
        load_midst = take(coordinates, load, below + col, w)
        load_at_end = take(coordinates, load, below + below + col, w)

        a1 = _acceleration(structure, mesh, START, load_at_start, q, v)

        q_half = add(q, half, v)
        v2 = add(v, half, a1)
        a2 = _acceleration(structure, mesh, MIDST, load_midst, q_half, v2)

        q3 = add(q_half, half * half, a1)
        v3 = add(v, half, a2)
        a3 = _acceleration(structure, mesh, MIDST, load_midst, q3, v3)

        q_end = add(q, h, v)
        q4 = add(q_end, h * half, a2)
        v4 = add(v, h, a3)
        a4 = _acceleration(structure, mesh, END, load_at_end, q4, v4)

        for row in range(n):
            middles = a2[row] + a3[row]
            to = j + np.uint64(row) * w + col
            states[to] = q_end[row] + h * sixth * (a1[row] + middles)
            states[to + below] = v[row] + sixth * (a1[row] + 2.0 * middles + a4[row])


@jit_inner(counted=False, inline=True)
def _fill_load(kernel: Any, w: Any) -> None:
    """Write accelerations by the inputs at all stages into column 0 of the load."""
    scratch = kernel.flanks.scratch
    enters = kernel.series.enters
    n = len(kernel.structure.coordinates)
    inputs = scratch.inputs
    load = scratch.load
    for stage in range(3):
        for row in range(n):
            total = 0.0
            for x in range(len(enters)):
                total += inputs[0, stage, x] * enters[x, row]
            load[np.uint64(stage * n + row) * w] = total


@jit_inner(counted=False, inline=True)
def _acceleration(
    structure: Any,
    mesh: Any,
    stage: int,
    load: Any,
    q: Any,
    v: Any,
) -> Any:
    """Return ``a − K q − C q̇ − Σ_m M⁻¹ d_m (k_m d_m·q + b_m d_m·q̇)`` as a tuple."""
    n = len(q)
    k = structure.stiffness
    c = structure.damping
    d = structure.direction
    p = structure.per_force
    out = load
    meshes = len(d) // n
    for row in range(n):
        out = put(out, row, load[row] - k[row] * q[row] - c[row] * v[row])
    for m in range(meshes):
        place = 0.0
        speed = 0.0
        for row in range(n):
            place += d[m * n + row] * q[row]
            speed += d[m * n + row] * v[row]
        at = np.uint64(stage * meshes + m)
        force = mesh[at] * place + mesh[at + np.uint64(3 * meshes)] * speed
        for row in range(n):
            out = put(out, row, out[row] - p[m * n + row] * force)
    return out


def dense_step(
    kernel: Any,
    step: int,
    columns: Any,
    w: Any,
    states: Any,
    i: Any,
    j: Any,
) -> None:
    """Advance a trajectory, without tangents, by one step.

    Parameters
    ----------
    kernel, step, columns, w, states, i, j : as in `diagonal_step`, the structure
        `wearlab.dynamics.integrators.kernel.Dense`

    References
    ----------
    Kutta, Z. Math. Phys. 46 (1901) 435–453.
    """
    n = len(kernel.structure.coordinates)
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    work = kernel.structure.work.reshape((4, 2 * n))
    first = work[0]
    trial = work[1]
    slope = work[2]
    end = work[3]
    for row in range(2 * n):
        first[row] = states[i + np.uint64(row) * w]
        end[row] = first[row]
        slope[row] = 0.0
    for evaluation in range(4):
        stage = (evaluation + 1) // 2
        for row in range(2 * n):
            trial[row] = first[row] + 0.5 * stage * h * slope[row]
        write(trial[n:], slope)
        acceleration(kernel, stage, trial, slope[n:])
        for row in range(2 * n):
            end[row] += (h / 3.0 if stage == MIDST else h / 6.0) * slope[row]
    for row in range(2 * n):
        states[j + np.uint64(row) * w] = end[row]


@jit_inner(counted=False)
def acceleration(kernel: Any, stage: int, state: Any, out: Any) -> None:
    """Write q̈ of a state at a stage whose law and inputs are in the scratch.

    Parameters
    ----------
    kernel : the system
    stage : `START`, `MIDST` or `END`
    state : (2n,) q [m] and q̇ [m/s]
    out : (n,) written [m/s²]
    """
    series = kernel.series
    mesh = kernel.flanks.scratch.mesh[0]
    inputs = kernel.flanks.scratch.inputs[0]
    n = len(out)
    channels = len(kernel.flanks.meshes.channels)
    for row in range(n):
        out[row] = 0.0
        for x in range(len(series.enters)):
            out[row] += inputs[stage, x] * series.enters[x, row]
        for col in range(n):
            out[row] -= (
                series.stiffness[row, col] * state[col]
                + series.damping[row, col] * state[n + col]
            )
    for c in range(channels):
        place, speed = motion_of(kernel.structure, c, np.uint64(1), state, np.uint64(0))
        at = stage * channels + c
        force = mesh[at] * place + mesh[3 * channels + at] * speed
        for row in range(n):
            out[row] -= series.enters[c, row] * force


STEPS = {Diagonal: diagonal_step, Dense: dense_step, Propagated: exact_step}
step_of = by_type(lambda kernel, *rest: STEPS[structure_of(kernel)])
"""Advance by the step of the structure's kind."""

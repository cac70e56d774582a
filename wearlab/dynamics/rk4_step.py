"""One classical Runge–Kutta step of the affine motion between contact changes, for all columns at once.

While no flank gains or loses contact, ``W_m = k_m d·q + c_m d·q̇ − w_m`` with k_m and w_m known at the
stages. The trajectory (column 0) and its tangents (the other columns) then obey the same linear equation;
only column 0 has an inhomogeneous part. Columns lie side by side, so they ride in one vector register and
the tangents cost almost nothing.

A state is a flat row-major array (2n, width): n rows of q, then n rows of q̇. Offsets are unsigned: a signed
index may count from the end, and checking that stops the compiler from vectorising. The number of columns is
passed as a value, because a short loop of known length is not vectorised either.
"""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import KERNEL, jit_inner
from wearlab.dynamics.dense_step import dense_step
from wearlab.dynamics.exact_step import exact_step
from wearlab.dynamics.registers import add, put, take
from wearlab.dynamics.structure import Dense, Diagonal, Propagated


@jit_inner(forceinline=True)
def rk4_step(
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
    """Advance the state at ``source[i:]`` by time ``h`` into ``target[j:]``.

    Parameters
    ----------
    structure : `Diagonal`, `Dense` or `Propagated`
    meshes : as long as there are channels of force, its values unused; the first are the meshes
    columns : how many columns to advance (uint64)
    width : as long as a state has columns, its values unused
    source, i, target, j : flat arrays of states and offsets into them (uint64)
    mesh : (4, n_channel) flat: stiffness k_m at the start, middle and end [N/m], and damping c_m [N s/m]
    push : (3, n, width) flat: inhomogeneous acceleration at the start, middle and end, in column 0 [m/s²]
    h : length of the step [s]

    References
    ----------
    Kutta, Z. Math. Phys. 46 (1901) 435–453.
    """
    _step_of_kind(structure, meshes, columns, width, source, i, target, j, mesh, push, h)


def _step_of_kind(structure: Any, *rest: Any) -> None:
    """Advance by the step of the structure's kind, which `rk4_step` alone calls.

    Numba compiles what it chooses by types anew for callers compiled with other options.
    """
    raise NotImplementedError("compiled code only")


@overload(_step_of_kind, jit_options=KERNEL, strict=False)
def _choose_step(structure: Any, *rest: Any) -> Any:
    return {Diagonal: _diagonal, Dense: dense_step, Propagated: exact_step}[structure.instance_class]


def _diagonal(
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
    like, k, c, d, p = (
        structure.push,
        structure.stiffness,
        structure.damping,
        structure.direction,
        structure.per_force,
    )
    w, zero, unit, nm = np.uint64(len(width)), np.uint64(0), np.uint64(1), np.uint64(len(meshes))
    below = np.uint64(len(like)) * w
    start = take(meshes, mesh, zero, unit)
    middle = take(meshes, mesh, nm, unit)
    end = take(meshes, mesh, nm + nm, unit)
    damp = take(meshes, mesh, nm + nm + nm, unit)
    half, h6 = 0.5 * h, h / 6.0
    for col in range(zero, columns):
        q = take(like, source, i + col, w)
        v = take(like, source, i + below + col, w)
        b1 = take(like, push, col, w)
        b2 = take(like, push, below + col, w)
        b3 = take(like, push, below + below + col, w)
        a1 = _acceleration(k, c, d, p, start, damp, b1, q, v)
        q_half = add(q, half, v)
        a2 = _acceleration(k, c, d, p, middle, damp, b2, q_half, add(v, half, a1))
        a3 = _acceleration(k, c, d, p, middle, damp, b2, add(q_half, half * half, a1), add(v, half, a2))
        q_end = add(q, h, v)
        a4 = _acceleration(k, c, d, p, end, damp, b3, add(q_end, h * half, a2), add(v, h, a3))
        for row in range(len(like)):
            middles = a2[row] + a3[row]
            to = j + np.uint64(row) * w + col
            target[to] = q_end[row] + h * h6 * (a1[row] + middles)
            target[to + below] = v[row] + h6 * (a1[row] + 2.0 * middles + a4[row])


@jit_inner
def _acceleration(
    k: Any, c: Any, d: Any, p: Any, stiffness: Any, damp: Any, push: Any, q: Any, v: Any
) -> Any:
    """Return ``b − K q − C q̇ − Σ_m M⁻¹ d_m (k_m d_m·q + c_m d_m·q̇)`` as a tuple."""
    n = len(q)
    out = push
    for row in range(n):
        out = put(out, row, push[row] - k[row] * q[row] - c[row] * v[row])
    for m in range(len(stiffness)):
        deflection, rate = 0.0, 0.0
        for row in range(n):
            deflection += d[m * n + row] * q[row]
            rate += d[m * n + row] * v[row]
        force = stiffness[m] * deflection + damp[m] * rate
        for row in range(n):
            out = put(out, row, out[row] - p[m * n + row] * force)
    return out

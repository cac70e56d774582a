"""The equation of motion itself, for methods that do not follow contact changes."""

from typing import Any

from numba.extending import overload

from wearlab.compiled import KERNEL, jit_inner
from wearlab.dynamics.flanks import behind, gated, within
from wearlab.dynamics.structure import Dense, Diagonal


def unmeshed(structure: Any, state: Any, out: Any) -> None:
    """Write ``M⁻¹ (F − C q̇ − K q)`` into ``out`` (n,) for ``state`` (2n,)."""
    raise NotImplementedError("compiled code only")


@overload(unmeshed, jit_options=KERNEL)
def _choose_unmeshed(structure: Any, state: Any, out: Any) -> Any:
    return {Diagonal: _unmeshed_diagonal, Dense: _unmeshed_dense}[structure.instance_class]


def _unmeshed_diagonal(structure: Any, state: Any, out: Any) -> None:
    n = len(out)
    for row in range(n):
        out[row] = (
            structure.push[row]
            - structure.stiffness[row] * state[row]
            - structure.damping[row] * state[n + row]
        )


def _unmeshed_dense(structure: Any, state: Any, out: Any) -> None:
    n = len(out)
    for row in range(n):
        out[row] = structure.push[row]
        for col in range(n):
            out[row] -= (
                structure.stiffness[row, col] * state[col] + structure.damping[row, col] * state[n + col]
            )


@jit_inner
def fluctuating(fluctuation: Any, kernel: Any, table: Any, step: int, x: float, out: Any) -> None:
    """Add the fluctuating load at fraction ``x`` of the step."""
    if kernel.fluctuates:
        factor = within(table[step], x)
        for row in range(len(out)):
            out[row] += factor * fluctuation[row]


@jit_inner
def mesh_force_at(
    kernel: Any, tables: Any, step: int, x: float, period: float, m: int, q: float, v: float
) -> float:
    """Return elastic plus damping force of mesh ``m`` at fraction ``x`` for ``q = d·q``, ``v = d·q̇`` [N]."""
    delta = q - within(tables.error[step, :, m], x)
    rate = v - within(tables.error_rate[step, :, m], x) / period
    elastic, every, touching = 0.0, 0.0, False
    for p in range(len(kernel.pairs)):
        k = within(tables.stiffness[step, :, m, p], x)
        approach = delta - within(tables.gap[step, :, m, p], x)
        every += k
        if approach > 0.0 and k > 0.0:
            elastic += k * approach
            touching = True
    back = behind(kernel.backlash, m, delta)
    if back > 0.0:
        elastic -= every * back
        touching = True
    return elastic + gated(kernel.gate, kernel.mesh_damping[m] * rate, touching)


@jit_inner
def add_friction_at(
    sliding: Any, kernel: Any, tables: Any, step: int, x: float, m: int, q: float, out: Any
) -> None:
    """Add the acceleration by the friction of mesh ``m`` at fraction ``x`` for ``q = d·q``.

    References
    ----------
    B23, rederived: friction with the sign of the sliding, at the arms ``ρ``.
    """
    n, meshes = len(out), len(kernel.mesh_damping)
    if sliding is not None and len(kernel.channels) > meshes:
        delta = q - within(tables.error[step, :, m], x)
        for p in range(len(kernel.pairs)):
            approach = delta - within(tables.gap[step, :, m, p], x)
            k = within(tables.stiffness[step, :, m, p], x)
            if approach > 0.0 and k > 0.0:
                force = k * approach * within(sliding[step, :, m, p], x)
                arm = k * approach * within(tables.moment[step, :, m, p], x)
                for row in range(n):
                    out[row] -= kernel.structure.per_force[(meshes + m) * n + row] * force
                    out[row] -= kernel.structure.per_force[(2 * meshes + m) * n + row] * arm


@jit_inner
def add_balance_at(balance: Any, out: Any) -> None:
    """Add the loads of unknown size."""
    if balance is not None:
        for row in range(len(balance.held)):
            for col in range(len(out)):
                out[col] += balance.size[row] * balance.push[row, col]


@jit_inner
def acceleration(kernel: Any, tables: Any, step: int, x: float, period: float, state: Any, out: Any) -> None:
    """Write q̈ (n,) at fraction ``x`` of ``step`` for ``state`` (2n,)."""
    n = len(out)
    structure = kernel.structure
    unmeshed(structure, state, out)
    fluctuating(kernel.fluctuation, kernel, tables.fluctuation, step, x, out)
    add_balance_at(kernel.balance, out)
    for m in range(len(kernel.mesh_damping)):
        q, v = 0.0, 0.0
        for row in range(n):
            q += structure.direction[m * n + row] * state[row]
            v += structure.direction[m * n + row] * state[n + row]
        force = mesh_force_at(kernel, tables, step, x, period, m, q, v)
        for row in range(n):
            out[row] -= structure.per_force[m * n + row] * force
        add_friction_at(tables.sliding, kernel, tables, step, x, m, q, out)

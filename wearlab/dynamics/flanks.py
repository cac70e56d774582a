"""Which flanks touch during a step, and the affine mesh law that follows.

With contact known, ``W_m = k_m d·q + c_m d·q̇ − w_m`` where ``k_m = Σ_p k_p`` over the touching pairs and
``w_m = Σ_p k_p g_p + k_m e + c_m ė`` (a back flank adds its stiffness to k_m and ``k (e − j_bn)`` to w_m).

``contact`` is (n_mesh, n_pairs + 1): 1 where a pair touches, last column the back flank.
Parts of a step are given as fractions a…b of it; tables are interpolated quadratically within the step.

Friction is affine in the same δ: ``Σ_p Λμ_p F_p = k_a d·q − w_a`` and ``Σ_p Λμ_p s_p F_p = k_b d·q − w_b`` go
to the channels of f0 and f1.
"""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import KERNEL, jit_inner
from wearlab.dynamics.structure import Propagated


@jit_inner
def within(table: Any, x: float) -> float:
    """Interpolate three stage values quadratically at fraction ``x`` of the step."""
    y = 1.0 - x
    return table[0] * y * (y - x) + 4.0 * table[1] * x * y + table[2] * x * (x - y)


@jit_inner
def slope_within(table: Any, x: float) -> float:
    """Derivative of `within` with respect to the fraction ``x``."""
    return table[0] * (4.0 * x - 3.0) + 4.0 * table[1] * (1.0 - 2.0 * x) + table[2] * (4.0 * x - 1.0)


@jit_inner(forceinline=True)
def in_path(tables: Any, step: int, m: int, p: int) -> bool:
    """Whether pair ``p`` of mesh ``m`` is in the path of contact at any time of the step."""
    k = tables.stiffness
    return k[step, 1, m, p] > 0.0 or k[step, 0, m, p] > 0.0 or k[step, 2, m, p] > 0.0


@jit_inner(forceinline=True)
def row_product(direction: Any, m: int, n: int, state: Any, offset: Any, stride: Any) -> float:
    """Return ``d_m · q`` of the rows that start at ``state[offset]``."""
    total = 0.0
    for row in range(n):
        total += direction[m * n + row] * state[offset + np.uint64(row) * stride]
    return total


@jit_inner(forceinline=True)
def behind(backlash: Any, m: int, deflection: float) -> float:
    """Return the approach of the back flanks, ``−j_bn − δ``; never in contact where none are modelled."""
    return -backlash[m] - deflection


@jit_inner(forceinline=True)
def see_contact(
    kernel: Any, tables: Any, step: int, deflection: float, m: int, stage: int, contact: Any
) -> None:
    """Set the contact of mesh ``m`` from its ``deflection`` at stage 0, 1 or 2 of ``step``."""
    pairs = len(kernel.pairs)
    for p in range(pairs):
        contact[m, p] = deflection > tables.gap[step, stage, m, p] and in_path(tables, step, m, p)
    contact[m, pairs] = behind(kernel.backlash, m, deflection) > 0.0


@jit_inner(forceinline=True)
def contact_differs(
    kernel: Any, tables: Any, step: int, deflection: float, m: int, stage: int, contact: Any
) -> bool:
    """Whether ``deflection`` at a stage of ``step`` contradicts ``contact``."""
    pairs = len(kernel.pairs)
    for p in range(pairs):
        x = deflection - tables.gap[step, stage, m, p]
        if (x < 0.0 if contact[m, p] else x > 0.0) and in_path(tables, step, m, p):
            return True
    return contact_behind_differs(kernel.backlash, m, deflection, contact[m, pairs])


@jit_inner(forceinline=True)
def contact_behind_differs(backlash: Any, m: int, deflection: float, contact: bool) -> bool:
    """Whether ``deflection`` contradicts the contact of the back flank; False where there is none."""
    x = -backlash[m] - deflection
    return x < 0.0 if contact else x > 0.0


@jit_inner
def gated(gate: bool, damping: float, touching: bool) -> float:
    """Return a mesh's damping, or its damping force: always there, or only while flanks touch."""
    return damping if touching or not gate else 0.0


@jit_inner
def add_back_flank(
    backlash: Any, m: int, contact: bool, stiffness: float, error: float
) -> tuple[float, float]:
    """Return what the back flank adds to k_m and to w_m."""
    if not contact:
        return 0.0, 0.0
    return stiffness, stiffness * (error - backlash[m])


def begin_push(structure: Any, stage: Any, w: Any, push: Any) -> None:
    """Fill column 0 of ``push`` at a stage with what the constant loads give."""
    raise NotImplementedError("compiled code only")


@overload(begin_push, jit_options=KERNEL, strict=False)
def _choose_begin(structure: Any, *rest: Any) -> Any:
    return _begin_inputs if structure.instance_class is Propagated else _begin_acceleration


def _begin_acceleration(structure: Any, stage: Any, w: Any, push: Any) -> None:
    n = len(structure.push)
    for row in range(n):
        push[(stage * n + row) * w] = structure.push[row]


def _begin_inputs(structure: Any, stage: Any, w: Any, push: Any) -> None:
    channels, inputs = len(structure.tables.stiffness), len(structure.force) // 5
    for row in range(inputs):
        push[stage * inputs + row] = 0.0
    push[stage * inputs + channels] = 1.0


def push_channel(structure: Any, channel: Any, stage: Any, total: Any, w: Any, push: Any) -> None:
    """Add the force ``total`` along the vector of a channel to ``push`` at a stage."""
    raise NotImplementedError("compiled code only")


@overload(push_channel, jit_options=KERNEL, strict=False)
def _choose_push(structure: Any, *rest: Any) -> Any:
    return _push_input if structure.instance_class is Propagated else _push_acceleration


def _push_acceleration(structure: Any, channel: Any, stage: Any, total: Any, w: Any, push: Any) -> None:
    n = len(structure.push)
    for row in range(n):
        push[(stage * n + row) * w] += structure.per_force[channel * n + row] * total


def _push_input(structure: Any, channel: Any, stage: Any, total: Any, w: Any, push: Any) -> None:
    push[stage * (len(structure.force) // 5) + channel] += total


def push_load(
    structure: Any, vector: Any, index: Any, stage: Any, column: Any, size: Any, w: Any, push: Any
) -> None:
    """Add a load to a column of ``push``: M⁻¹F is ``vector``, among the loads it has an index."""
    raise NotImplementedError("compiled code only")


@overload(push_load, jit_options=KERNEL, strict=False)
def _choose_load(structure: Any, *rest: Any) -> Any:
    return _push_load_input if structure.instance_class is Propagated else _push_load_acceleration


def _push_load_acceleration(
    structure: Any, vector: Any, index: Any, stage: Any, column: Any, size: Any, w: Any, push: Any
) -> None:
    n = len(structure.push)
    for row in range(n):
        at = (stage * n + row) * w + column
        push[at] = size * vector[row] if column > 0 else push[at] + size * vector[row]


def _push_load_input(
    structure: Any, vector: Any, index: Any, stage: Any, column: Any, size: Any, w: Any, push: Any
) -> None:
    # The column of a tangent is filled by the step itself, which knows its unit input.
    if column == 0:
        inputs = len(structure.force) // 5
        push[stage * inputs + len(structure.tables.stiffness) + index] += size


@jit_inner(forceinline=True)
def add_fluctuation(
    fluctuation: Any, kernel: Any, table: Any, step: int, stage: int, x: float, w: int, push: Any
) -> int:
    """Add the fluctuating load to ``push``; return the number of loads so far."""
    if not kernel.fluctuates:
        return 1
    push_load(kernel.structure, fluctuation, 1, stage, 0, within(table[step], x), w, push)
    return 2


@jit_inner(forceinline=True)
def add_balance(structure: Any, balance: Any, first: int, stage: int, w: int, push: Any) -> None:
    """Add the loads of unknown size, and their unit loads to the tangents by them."""
    if balance is not None:
        for row in range(len(balance.held)):
            push_load(structure, balance.push[row], first + row, stage, 0, balance.size[row], w, push)
            column = 1 + balance.held[row]
            if column < w:
                push_load(structure, balance.push[row], first + row, stage, column, 1.0, w, push)


@jit_inner(forceinline=True)
def start_law(kernel: Any, tables: Any, step: int, a: float, b: float, width: Any, push: Any) -> None:
    """Fill column 0 of ``push`` (3, n, width) with the acceleration that the loads alone give."""
    w = len(width)
    for stage in range(3):
        x = a + 0.5 * stage * (b - a)
        begin_push(kernel.structure, stage, w, push)
        loads = add_fluctuation(kernel.fluctuation, kernel, tables.fluctuation, step, stage, x, w, push)
        add_balance(kernel.structure, kernel.balance, loads, stage, w, push)


@jit_inner(forceinline=True)
def gate_damping(kernel: Any, m: int, contact: Any) -> float:
    """Return the damping of mesh ``m`` while ``contact`` lasts."""
    touching = False
    for p in range(len(kernel.pairs) + 1):
        touching = touching or contact[m, p]
    return gated(kernel.gate, kernel.mesh_damping[m], touching)


@jit_inner(forceinline=True)
def finish_stage(
    kernel: Any, stage: int, m: int, k: float, w_m: float, every: float, e: float, rate: float, back: bool,
    damping: float, width: Any, mesh: Any, push: Any,
) -> None:  # fmt: skip
    """Write k_m of one stage into ``mesh`` and add w_m to ``push``."""
    channels = len(kernel.channels)
    k_back, w_back = add_back_flank(kernel.backlash, m, back, every, e)
    mesh[stage * channels + m] = k + k_back
    push_channel(kernel.structure, m, stage, w_m + k * e + w_back + damping * rate, len(width), push)


@jit_inner(forceinline=True)
def friction_stage(
    sliding: Any, kernel: Any, tables: Any, step: int, stage: int, x: float, m: int, e: float, contact: Any,
    width: Any, mesh: Any, push: Any,
) -> None:  # fmt: skip
    """Fill the two friction channels of mesh ``m`` at one stage, fraction ``x`` of the step.

    References
    ----------
    B23, rederived: friction with the sign of the sliding, at the arms ``ρ``.
    """
    channels, meshes = len(kernel.channels), len(kernel.mesh_damping)
    if sliding is not None and channels > meshes:
        k_a, w_a, k_b, w_b = 0.0, 0.0, 0.0, 0.0
        for p in range(len(kernel.pairs)):
            if contact[m, p]:
                k = within(tables.stiffness[step, :, m, p], x)
                rubs = k * within(sliding[step, :, m, p], x)
                arm = k * within(tables.moment[step, :, m, p], x)
                gap = within(tables.gap[step, :, m, p], x) + e
                k_a += rubs
                w_a += rubs * gap
                k_b += arm
                w_b += arm * gap
        constant, slope = meshes + m, 2 * meshes + m
        mesh[stage * channels + constant], mesh[stage * channels + slope] = k_a, k_b
        mesh[3 * channels + constant], mesh[3 * channels + slope] = 0.0, 0.0
        push_channel(kernel.structure, constant, stage, w_a, len(width), push)
        push_channel(kernel.structure, slope, stage, w_b, len(width), push)


@jit_inner(forceinline=True)
def mesh_law(
    kernel: Any, tables: Any, step: int, period: float, contact: Any, width: Any, mesh: Any, push: Any
) -> None:
    """Fill ``mesh`` (4, n_channel) and column 0 of ``push`` (3, n, width) for a whole step."""
    meshes, pairs, channels = len(kernel.mesh_damping), len(kernel.pairs), len(kernel.channels)
    start_law(kernel, tables, step, 0.0, 1.0, width, push)
    frequency = 1.0 / period
    for m in range(meshes):
        damping = gate_damping(kernel, m, contact)
        mesh[3 * channels + m] = damping
        for stage in range(3):
            k, w_m, every = 0.0, 0.0, 0.0
            for p in range(pairs):
                k_p = tables.stiffness[step, stage, m, p]
                every += k_p
                if contact[m, p]:
                    k += k_p
                    w_m += k_p * tables.gap[step, stage, m, p]
            e, rate = tables.error[step, stage, m], tables.error_rate[step, stage, m] * frequency
            finish_stage(
                kernel, stage, m, k, w_m, every, e, rate, contact[m, pairs], damping, width, mesh, push
            )
            friction_stage(
                tables.sliding, kernel, tables, step, stage, 0.5 * stage, m, e, contact, width, mesh, push
            )


@jit_inner(forceinline=True)
def part_law(
    kernel: Any,
    tables: Any,
    step: int,
    a: float,
    b: float,
    period: float,
    contact: Any,
    width: Any,
    mesh: Any,
    push: Any,
) -> None:
    """As `mesh_law`, for the part a…b of a step."""
    meshes, pairs, channels = len(kernel.mesh_damping), len(kernel.pairs), len(kernel.channels)
    start_law(kernel, tables, step, a, b, width, push)
    for m in range(meshes):
        damping = gate_damping(kernel, m, contact)
        mesh[3 * channels + m] = damping
        for stage in range(3):
            x = a + 0.5 * stage * (b - a)
            k, w_m, every = 0.0, 0.0, 0.0
            for p in range(pairs):
                k_p = within(tables.stiffness[step, :, m, p], x)
                every += k_p
                if contact[m, p]:
                    k += k_p
                    w_m += k_p * within(tables.gap[step, :, m, p], x)
            e, rate = within(tables.error[step, :, m], x), within(tables.error_rate[step, :, m], x) / period
            finish_stage(
                kernel, stage, m, k, w_m, every, e, rate, contact[m, pairs], damping, width, mesh, push
            )
            friction_stage(tables.sliding, kernel, tables, step, stage, x, m, e, contact, width, mesh, push)

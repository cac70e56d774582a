"""Meshes whose flanks gain and lose contact, as polynomials of time over blocks of steps.

Over a block every pair has polynomials of ``k``, of ``k (g + e)`` and of ``g + e``, at which it parts: those
through all stages of the group of steps that the block is a part of. What touches is summed:
``W = k_c d·q + c δ̇ − w_c``.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit_inner

DEGREE = 8
"""Of the polynomials through the nine stages of a group of four steps."""
FIRST, SIZE, GROUP, STAGES = 0, 1, 2, 3
"""Of a block: its first step, and how many it has; first step and stages of the group it is a part of."""
HOLDS, DAMPS, LOAD, UNKNOWN = 0, 1, 2, 3
"""Of a coordinate: K/M [1/s²], C/M [1/s], F/M [m/s²], and 1/M times the loads of unknown size [m/s²]."""
MESH_DAMPING, BACKLASH, VECTORS = 0, 1, 2
"""Of a mesh: c [N s/m], j_bn (inf: no back flank) [m], d (n,) [1] and M⁻¹ d (n,) [1/kg]."""
SPRING, CARRIED, REACH = 0, 1, 2
"""Polynomials of a pair: k, k (g + e), g + e."""
ERROR, RATE, STIFFNESS, SHIFTED = 0, 1, 2, 3
"""Polynomials of a mesh: e, de/dphase, Σ_p k_p and Σ_p k_p e, the last two for its back flank."""


class StepTables(NamedTuple):
    """Tables of steps that end where contact changes, see `wearlab.mesh.stages.StageTables`."""

    width: Array
    stiffness: Array
    gap: Array
    error: Array
    error_rate: Array


class PartingPlan(NamedTuple):
    """What all wear states of a system on the same steps share.

    Parameters
    ----------
    joined : (n_steps − 1,) where no table jumps from step to step
    block : (n_blocks, 4) `FIRST`, `SIZE`, `GROUP`, `STAGES`
    length : (n_blocks,) duration [s]
    coordinate : (n, 3 + n_balance) `HOLDS`, `DAMPS`, `LOAD`, `UNKNOWN`
    mesh : (n_mesh, 2 + 2n) `MESH_DAMPING`, `BACKLASH`, `VECTORS`
    always : the mesh damping acts in separation, too
    held : (n_balance,) coordinates whose place a load of unknown size takes
    scale : (2n,) sizes of the states
    """

    joined: Flags
    block: Index
    length: Array
    coordinate: Array
    mesh: Array
    always: bool
    held: Index
    scale: Array


@jit_inner
def fit_through(values: Any, count: int, scale: float, offset: float, polynomial: Any) -> None:
    """Write the polynomial (9,) in u through ``count`` values at ``scale u + offset = 0, 1, 2 …``.

    Newton's, from differences: they take the values' place, and are small where values are smooth. A product
    with the inverse of Vandermonde's matrix would round off 1e5 times as much.
    """
    for j in range(np.uint64(1), np.uint64(count)):
        for i in range(np.uint64(count) - np.uint64(1), j - np.uint64(1), -1):
            values[i] -= values[i - np.uint64(1)]
    for power in range(np.uint64(0), np.uint64(DEGREE + 1)):
        polynomial[power] = 0.0
    polynomial[0] = values[count - 1]
    for j in range(count - 2, -1, -1):
        over = 1.0 / (j + 1.0)
        shift, rise = (offset - j) * over, scale * over
        for power in range(np.uint64(count - 1 - j), np.uint64(0), -1):
            polynomial[power] = polynomial[power] * shift + polynomial[power - np.uint64(1)] * rise
        polynomial[0] = polynomial[0] * shift + values[j]


@jit_inner
def fill_polynomials(
    plan: Any, stiffness: Any, gap: Any, error: Any, error_rate: Any, present: Any, of_pair: Any, of_mesh: Any
) -> None:
    """Fill the polynomials of all blocks from the tables.

    Parameters
    ----------
    plan : `PartingPlan`
    stiffness, gap, error, error_rate : of `wearlab.mesh.stages.StageTables`
    present : (n_blocks, n_mesh, n_pairs) filled: whether the pair is in the path
    of_pair : (n_blocks, n_mesh, n_pairs, 3, 9) filled: `SPRING`, `CARRIED`, `REACH`
    of_mesh : (n_blocks, n_mesh, 4, 9) filled: `ERROR`, `RATE`, `STIFFNESS`, `SHIFTED`, the last two
        only where there is a back flank
    """
    pair, mesh = np.empty((3, DEGREE + 1)), np.empty((4, DEGREE + 1))
    for at in range(len(plan.block)):
        count, group = plan.block[at, STAGES], plan.block[at, GROUP]
        scale, offset = 2.0 * plan.block[at, SIZE], 2.0 * (plan.block[at, FIRST] - group)
        for m in range(error.shape[2]):
            for i in range(count):
                last = 1 if i == count - 1 else 0
                step, x = group + i // 2 - last, i % 2 + 2 * last
                mesh[ERROR, i], mesh[RATE, i] = error[step, x, m], error_rate[step, x, m]
                mesh[STIFFNESS, i], mesh[SHIFTED, i] = 0.0, 0.0
            for p in range(gap.shape[3]):
                present[at, m, p] = stiffness[group, 1, m, p] > 0.0
                if present[at, m, p]:
                    for i in range(count):
                        last = 1 if i == count - 1 else 0
                        step, x = group + i // 2 - last, i % 2 + 2 * last
                        pair[SPRING, i] = stiffness[step, x, m, p]
                        pair[REACH, i] = gap[step, x, m, p] + mesh[ERROR, i]
                        pair[CARRIED, i] = pair[SPRING, i] * pair[REACH, i]
                        mesh[STIFFNESS, i] += pair[SPRING, i]
                        mesh[SHIFTED, i] += pair[SPRING, i] * mesh[ERROR, i]
                    for kind in range(3):
                        fit_through(pair[kind], count, scale, offset, of_pair[at, m, p, kind])
            for kind in range(4 if plan.mesh[m, BACKLASH] < np.inf else 2):
                fit_through(mesh[kind], count, scale, offset, of_mesh[at, m, kind])


@jit_inner
def touches(contact: Any, m: int) -> bool:
    """Whether any flank of a mesh touches; ``contact`` (n_mesh, n_pairs + 1), back flanks last."""
    for p in range(contact.shape[1]):
        if contact[m, p]:
            return True
    return False


@jit_inner
def see(
    plan: Any, present: Any, of_pair: Any, of_mesh: Any, at: int, state: Any, everything: bool, contact: Any
) -> None:
    """Set what touches at the start of a block: by the state, or ``everything`` in the path."""
    pairs, n = contact.shape[1] - 1, len(plan.coordinate)
    for m in range(contact.shape[0]):
        position = 0.0
        for row in range(n):
            position += plan.mesh[m, VECTORS + row] * state[row]
        for p in range(pairs):
            near = everything or position > of_pair[at, m, p, REACH, 0]
            contact[m, p] = present[at, m, p] and near
        behind = of_mesh[at, m, ERROR, 0] - plan.mesh[m, BACKLASH]
        contact[m, pairs] = position < behind and not everything


@jit_inner
def fill_law(
    plan: Any, of_pair: Any, of_mesh: Any, at: int, period: float, contact: Any, law: Any, damping: Any
) -> None:
    """Fill k_c and w_c (n_mesh, 2, 9), and the damping (n_mesh,), of what touches in a block."""
    pairs = contact.shape[1] - 1
    for m in range(contact.shape[0]):
        damping[m] = plan.mesh[m, MESH_DAMPING] if plan.always or touches(contact, m) else 0.0
        behind = contact[m, pairs]
        for x in range(DEGREE + 1):
            k, w = 0.0, damping[m] / period * of_mesh[at, m, RATE, x]
            for p in range(pairs):
                if contact[m, p]:
                    k += of_pair[at, m, p, SPRING, x]
                    w += of_pair[at, m, p, CARRIED, x]
            if behind:
                k += of_mesh[at, m, STIFFNESS, x]
                w += of_mesh[at, m, SHIFTED, x] - plan.mesh[m, BACKLASH] * of_mesh[at, m, STIFFNESS, x]
            law[m, 0, x], law[m, 1, x] = k, w


@jit_inner
def value_at(p: Any, u: float) -> float:
    """Return a polynomial (9,) at ``u``."""
    low, high, square = p[DEGREE], p[DEGREE - 1], u * u
    for power in range(DEGREE - 2, -1, -2):  # even and odd powers side by side
        low = low * square + p[power]
        if power > 0:
            high = high * square + p[power - 1]
    return low + high * u


@jit_inner
def tabulate_pieces(
    plan: Any, tables: Any, present: Any, of_pair: Any, of_mesh: Any, place: Any, steps: int, cut: Any
) -> None:
    """Fill the tables of steps that begin and end anywhere in their blocks, as the polynomials have them.

    Parameters
    ----------
    plan, tables, present, of_pair, of_mesh : what was solved on, as `fill_polynomials` has it
    place, steps : as `wearlab.dynamics.parting_kernel.small_orbit` fills it, and how many there are
    cut : `StepTables`, filled
    """
    for step in range(steps):
        at, low, high = np.int64(place[step, 3]), place[step, 1], place[step, 2]
        first, passed = plan.block[at, FIRST], np.int64(low)
        whole = low == passed and high == passed + 1
        cut.width[step] = (high - low) * tables.width[first]
        for stage in range(3):
            if whole:
                of = first + passed
                for m in range(present.shape[1]):
                    cut.error[step, stage, m] = tables.error[of, stage, m]
                    cut.error_rate[step, stage, m] = tables.error_rate[of, stage, m]
                    for p in range(present.shape[2]):
                        cut.stiffness[step, stage, m, p] = tables.stiffness[of, stage, m, p]
                        cut.gap[step, stage, m, p] = tables.gap[of, stage, m, p]
                continue
            u = (low + 0.5 * stage * (high - low)) / plan.block[at, SIZE]
            for m in range(present.shape[1]):
                cut.error[step, stage, m] = value_at(of_mesh[at, m, ERROR], u)
                cut.error_rate[step, stage, m] = value_at(of_mesh[at, m, RATE], u)
                for p in range(present.shape[2]):
                    cut.stiffness[step, stage, m, p], cut.gap[step, stage, m, p] = 0.0, 0.0
                    if present[at, m, p]:
                        cut.stiffness[step, stage, m, p] = value_at(of_pair[at, m, p, SPRING], u)
                        reach = value_at(of_pair[at, m, p, REACH], u)
                        cut.gap[step, stage, m, p] = reach - cut.error[step, stage, m]

"""How the pairs in contact share the mesh force: ``δ − g_i = Σ_j C_ij F_j``, F_j ≥ 0, ΣF_j = F.

Uncoupled pairs (C diagonal) are springs that engage one after another as δ passes their gaps. Pairs that
share a gear body (C full) do the same, only at shifted gaps and with shifted slopes: the total force is
still a sum of one-sided springs, and that equivalent is what the dynamics integrate.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner

ROUNDED = 1e-15
"""Difference of gaps that is rounding: where a pair begins to touch its gap is that of its mate [m]."""


class Sharing(NamedTuple):
    """Pairs at one phase: what they yield under each other's forces, and the forces of those that touch.

    Parameters
    ----------
    matrix : (n_pairs, n_pairs) C, inf on the diagonal of an absent pair [m/N]
    active : (n_pairs,) which pairs touch
    unit, offset : (n_pairs,) forces ``unit δ − offset`` [N/m], [N]
    work, place : (n_pairs, n_pairs + 2) and (n_pairs,) room to solve for them
    """

    matrix: Array
    active: Flags
    unit: Array
    offset: Array
    work: Array
    place: Index


@jit_inner
def _room(n):  # type: ignore[no-untyped-def]
    work, place = np.zeros((n, n + 2)), np.zeros(n, np.int64)
    return Sharing(np.zeros((n, n)), np.zeros(n, np.bool_), np.zeros(n), np.zeros(n), work, place)


@jit
def share(compliance: Array, gap: Array, cross: Array, load: Array) -> tuple[Array, Array, Array]:
    """Solve the load sharing at every phase.

    Parameters
    ----------
    compliance : (n, n_pairs) own compliance of each pair, inf when absent [m/N]
    gap : (n, n_pairs) gap of each pair, inf when absent [m]
    cross : (n, n_pairs, n_apart) compliance shared by slot p with slot p − 1 − a; n_apart = 0: none [m/N]
    load : (n,) total normal force [N]

    Returns
    -------
    deflection, tangent : (n,) δ [m] and dF/dδ [N/m], where pairs engage that of a growing load
    force : (n, n_pairs) of the pairs [N]
    """
    n, n_pairs = compliance.shape
    deflection, tangent, force = np.full(n, np.inf), np.zeros(n), np.zeros((n, n_pairs))
    pairs = _room(n_pairs)
    for i in range(n):
        _begin(compliance[i], cross[i], pairs)
        for _ in range(n_pairs):
            following, where = _next_in_contact(gap[i], pairs)
            if following < 0 or where > deflection[i]:
                break
            _touch(gap[i], pairs, following)
            tangent[i] = pairs.unit.sum()
            deflection[i] = (load[i] + pairs.offset.sum()) / tangent[i]
        for p in range(n_pairs):
            if pairs.active[p]:
                force[i, p] = max(0.0, pairs.unit[p] * deflection[i] - pairs.offset[p])
    return deflection, tangent, force


@jit_inner
def _begin(compliance, cross, pairs):  # type: ignore[no-untyped-def]
    """Fill the matrix, and let no pair touch."""
    pairs.active[:] = False
    for p in range(len(compliance)):
        pairs.matrix[p, p] = compliance[p]
        for q in range(p):
            apart = p - 1 - q
            value = cross[p, apart] if apart < cross.shape[1] else 0.0
            pairs.matrix[p, q], pairs.matrix[q, p] = value, value


@jit_inner
def eliminate(work, n):  # type: ignore[no-untyped-def]
    """Solve n equations (n, n + 2) for two right-hand sides, the last columns, in place: no pivots."""
    for row in range(n):
        for below in range(row + 1, n):
            factor = work[below, row] / work[row, row]
            for column in range(row, n + 2):
                work[below, column] -= factor * work[row, column]
    for row in range(n - 1, -1, -1):
        for column in range(n, n + 2):
            for k in range(row + 1, n):
                work[row, column] -= work[row, k] * work[k, column]
            work[row, column] /= work[row, row]


@jit_inner
def _touch(gap, pairs, following):  # type: ignore[no-untyped-def]
    """Let one more pair touch: ``F_A = unit δ − offset`` with ``C_AA [unit, offset] = [1, g_A]``."""
    matrix, active, unit, offset, work, place = pairs
    active[following] = True
    m = 0
    for p in range(len(gap)):
        unit[p], offset[p] = 0.0, 0.0
        if active[p]:
            place[m] = p
            m += 1
    for r in range(m):
        for c in range(m):
            work[r, c] = matrix[place[r], place[c]]
        work[r, m], work[r, m + 1] = 1.0, gap[place[r]]
    eliminate(work, m)
    for r in range(m):
        unit[place[r]], offset[place[r]] = work[r, m], work[r, m + 1]


@jit_inner
def _contact_at(gap, pairs, p):  # type: ignore[no-untyped-def]
    """Return the δ at which slot ``p`` engages while the active ones bear, inf where it does not."""
    slope, level = 1.0, gap[p]
    for q in range(len(gap)):
        if pairs.active[q]:
            slope -= pairs.matrix[p, q] * pairs.unit[q]
            level -= pairs.matrix[p, q] * pairs.offset[q]
    return level / slope if slope > 0.0 else np.inf


@jit_inner
def _next_in_contact(gap, pairs):  # type: ignore[no-untyped-def]
    """Return the slot that engages next as δ grows, and the δ at which it does; −1: none."""
    matrix, nearest, where = pairs.matrix, -1, np.inf
    for p in range(len(gap)):
        if pairs.active[p] or not (matrix[p, p] < np.inf and gap[p] < np.inf):
            continue
        at = _contact_at(gap, pairs, p)
        later = at - where
        if abs(later) <= ROUNDED:  # the stiffer one: a pair that begins to touch is the softer
            later = matrix[p, p] - matrix[nearest, nearest]
        if later < 0.0:
            nearest, where = p, at
    return nearest, where


@jit
def equivalent_springs(
    compliance: Array, gap: Array, cross: Array, stages: int
) -> tuple[Array, Array, Array]:
    """Turn coupled pairs into the uncoupled springs of the same total force, at every phase.

    ``Σ_j F_j(δ) = Σ_p k_p max(0, δ − g_p)`` with the springs in their order of engagement. Without
    coupling each slot keeps its own stiffness and gap.

    Where pairs change places in that order within a step, springs would jump and no parabola could follow.
    So the stages of a step all have the order of the middle one: springs are smooth, and carry the force of
    the pairs but for deflections between the gaps of the two, as close as these come within the step.

    Parameters
    ----------
    compliance, gap : (n, n_pairs) as in :func:`share`
    cross : (n, n_pairs, n_apart) as in :func:`share`
    stages : phases one after another that have one order, that of the middle one

    Returns
    -------
    stiffness, gap : (n, n_pairs) of the springs; absent ones have stiffness 0 and gap 0 [N/m], [m]
    part : (n, n_pairs, n_pairs) what each spring (rows) adds to dF/dδ of each pair, so that ``F_j(δ) =
        Σ_p k_pj max(0, δ − g_p)`` and ``k_p = Σ_j k_pj``; a spring takes from pairs that touched before it
        [N/m]
    """
    n, n_pairs = compliance.shape
    stiffness, level = np.zeros((n, n_pairs)), np.zeros((n, n_pairs))
    part = np.zeros((n, n_pairs, n_pairs))
    pairs, earlier, order = _room(n_pairs), np.zeros(n_pairs), np.arange(n_pairs)
    for i in range(n):
        if cross.shape[2] > 0 and i % stages == 0:
            _begin(compliance[i + stages // 2], cross[i + stages // 2], pairs)
            order[:] = -1
            for slot in range(n_pairs):
                order[slot], _ = _next_in_contact(gap[i + stages // 2], pairs)
                if order[slot] < 0:
                    break
                _touch(gap[i + stages // 2], pairs, order[slot])
        _begin(compliance[i], cross[i], pairs)
        earlier[:] = 0.0
        for slot in range(n_pairs):
            p = order[slot]
            if p < 0 or not (compliance[i, p] < np.inf and gap[i, p] < np.inf):
                continue
            if cross.shape[2] == 0:
                stiffness[i, p], level[i, p] = 1.0 / compliance[i, p], gap[i, p]
                part[i, p, p] = stiffness[i, p]
                continue
            level[i, slot] = _contact_at(gap[i], pairs, p)
            _touch(gap[i], pairs, p)
            stiffness[i, slot] = pairs.unit.sum() - earlier.sum()
            for q in range(n_pairs):  # not by slices: telling of unequal lengths compiles for seconds
                part[i, slot, q] = pairs.unit[q] - earlier[q]
                earlier[q] = pairs.unit[q]
    return stiffness, level, part

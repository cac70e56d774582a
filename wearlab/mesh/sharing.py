"""How the pairs in contact share the mesh force: ``δ − g_i = Σ_j C_ij F_j``, F_j ≥ 0, ΣF_j = F.

Uncoupled pairs (C diagonal) are springs that engage one after another as δ passes their gaps. Pairs that
share a gear body (C full) do the same, only at shifted gaps and with shifted slopes: the total force is
still a sum of one-sided springs, and that equivalent is what the dynamics integrate.
"""

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner

ROUNDED = 1e-15
"""Difference of gaps that is rounding: where a pair begins to touch its gap is that of its mate [m]."""


@jit
def share(
    compliance: Array,
    gap: Array,
    cross: Array,
    load: Array,
    deflection: Array,
    force: Array,
    tangent: Array,
) -> None:
    """Solve the load sharing at every phase.

    Parameters
    ----------
    compliance : (n, n_pairs) own compliance of each pair, inf when absent [m/N]
    gap : (n, n_pairs) gap of each pair, inf when absent [m]
    cross : (n, n_pairs, n_apart) compliance shared by slot p with slot p − 1 − a; n_apart = 0: none [m/N]
    load : (n,) total normal force [N]
    deflection, tangent : (n,) filled with δ [m] and dF/dδ [N/m], where pairs engage that of a growing load
    force : (n, n_pairs) filled with the pair forces [N]
    """
    n, n_pairs = compliance.shape
    matrix = np.zeros((n_pairs, n_pairs))
    active = np.zeros(n_pairs, np.bool_)
    unit, offset = np.zeros(n_pairs), np.zeros(n_pairs)
    work, index = np.zeros((n_pairs, n_pairs + 2)), np.zeros(n_pairs, np.int64)
    for i in range(n):
        _fill_matrix(compliance[i], cross[i], matrix)
        deflection[i], tangent[i] = _share(
            matrix, gap[i], load[i], active, unit, offset, work, index, force[i]
        )


@jit_inner
def _fill_matrix(compliance, cross, matrix):  # type: ignore[no-untyped-def]
    n_pairs = len(compliance)
    for p in range(n_pairs):
        matrix[p, p] = compliance[p]
        for q in range(p):
            apart = p - 1 - q
            value = cross[p, apart] if apart < cross.shape[1] else 0.0
            matrix[p, q] = value
            matrix[q, p] = value


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
def _respond(matrix, gap, active, unit, offset, work, index):  # type: ignore[no-untyped-def]
    """Solve ``C_AA [unit, offset] = [1, g_A]`` by elimination, so that ``F_A = unit δ − offset``."""
    n = len(gap)
    m = 0
    for p in range(n):
        unit[p], offset[p] = 0.0, 0.0
        if active[p]:
            index[m] = p
            m += 1
    for r in range(m):
        for c in range(m):
            work[r, c] = matrix[index[r], index[c]]
        work[r, m] = 1.0
        work[r, m + 1] = gap[index[r]]
    eliminate(work, m)
    for r in range(m):
        unit[index[r]] = work[r, m]
        offset[index[r]] = work[r, m + 1]


@jit_inner
def _first_in_contact(compliance_diagonal_finite, gap):  # type: ignore[no-untyped-def]
    first = -1
    for p in range(len(gap)):
        if compliance_diagonal_finite[p, p] < np.inf and gap[p] < np.inf:
            if first < 0:
                first = p
                continue
            ahead = gap[first] - gap[p]
            if abs(ahead) <= ROUNDED:  # the stiffer one: a pair that begins to touch is the softer
                ahead = compliance_diagonal_finite[first, first] - compliance_diagonal_finite[p, p]
            first = p if ahead > 0.0 else first
    return first


@jit_inner
def _contact_at(matrix, gap, active, unit, offset, p):  # type: ignore[no-untyped-def]
    """Return the δ at which slot ``p`` engages while the active ones bear, inf where it does not."""
    slope, level = 1.0, gap[p]
    for q in range(len(gap)):
        if active[q]:
            slope -= matrix[p, q] * unit[q]
            level -= matrix[p, q] * offset[q]
    return level / slope if slope > 0.0 else np.inf


@jit_inner
def _next_in_contact(matrix, gap, active, unit, offset):  # type: ignore[no-untyped-def]
    """Return the slot that engages next as δ grows, and the δ at which it does."""
    nearest, where = -1, np.inf
    for p in range(len(gap)):
        if active[p] or not (matrix[p, p] < np.inf and gap[p] < np.inf):
            continue
        at = _contact_at(matrix, gap, active, unit, offset, p)
        if at < where:
            nearest, where = p, at
    return nearest, where


@jit_inner
def _share(matrix, gap, load, active, unit, offset, work, index, force):  # type: ignore[no-untyped-def]
    active[:] = False
    first = _first_in_contact(matrix, gap)
    if first >= 0:
        active[first] = True
    deflection, stiffness = np.inf, 0.0
    for _ in range(len(gap)):
        _respond(matrix, gap, active, unit, offset, work, index)
        stiffness, moment = unit.sum(), offset.sum()
        deflection = (load + moment) / stiffness
        following, where = _next_in_contact(matrix, gap, active, unit, offset)
        if following < 0 or where > deflection:
            break
        active[following] = True
    for p in range(len(gap)):
        force[p] = max(0.0, unit[p] * deflection - offset[p]) if active[p] else 0.0
    return deflection, stiffness


@jit
def equivalent_springs(
    compliance: Array,
    gap: Array,
    cross: Array,
    stages: int,
    stiffness_out: Array,
    gap_out: Array,
    pair_out: Array | None = None,
) -> None:
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
    stiffness_out, gap_out : (n, n_pairs) filled; absent springs get stiffness 0 and gap 0
    pair_out : (n, n_pairs, n_pairs) filled with what each spring (rows) adds to dF/dδ of each pair, so that
        ``F_j(δ) = Σ_p k_pj max(0, δ − g_p)`` and ``k_p = Σ_j k_pj``; a spring takes from pairs that touched
        before it. None: not wanted [N/m]
    """
    n, n_pairs = compliance.shape
    matrix = np.zeros((n_pairs, n_pairs))
    active = np.zeros(n_pairs, np.bool_)
    unit, offset = np.zeros(n_pairs), np.zeros(n_pairs)
    work, index = np.zeros((n_pairs, n_pairs + 2)), np.zeros(n_pairs, np.int64)
    earlier, order = np.zeros(n_pairs), np.full(n_pairs, -1)
    for i in range(n):
        for p in range(n_pairs):
            present = compliance[i, p] < np.inf and gap[i, p] < np.inf
            stiffness_out[i, p] = 1.0 / compliance[i, p] if present else 0.0
            gap_out[i, p] = gap[i, p] if present else 0.0
            if pair_out is not None:
                pair_out[i, p, :] = 0.0
                pair_out[i, p, p] = stiffness_out[i, p]
        if cross.shape[2] == 0:
            continue
        stiffness_out[i, :] = 0.0
        gap_out[i, :] = 0.0
        earlier[:] = 0.0
        if pair_out is not None:
            pair_out[i, :, :] = 0.0
        if i % stages == 0:
            at = i + stages // 2
            _fill_matrix(compliance[at], cross[at], matrix)
            _order_of(matrix, gap[at], active, unit, offset, work, index, order)
        _fill_matrix(compliance[i], cross[i], matrix)
        active[:] = False
        for slot in range(n_pairs):
            p = order[slot]
            if p < 0 or not (compliance[i, p] < np.inf and gap[i, p] < np.inf):
                continue
            gap_out[i, slot] = _contact_at(matrix, gap[i], active, unit, offset, p)
            active[p] = True
            _respond(matrix, gap[i], active, unit, offset, work, index)
            stiffness_out[i, slot] = unit.sum() - earlier.sum()
            for q in range(n_pairs):  # not by slices: telling of unequal lengths compiles for seconds
                if pair_out is not None:
                    pair_out[i, slot, q] = unit[q] - earlier[q]
                earlier[q] = unit[q]


@jit_inner
def _order_of(matrix, gap, active, unit, offset, work, index, order):  # type: ignore[no-untyped-def]
    """Fill the slots in their order of engagement, −1 after the last."""
    active[:], order[:] = False, -1
    following = _first_in_contact(matrix, gap)
    for slot in range(len(gap)):
        if following < 0:
            break
        order[slot], active[following] = following, True
        _respond(matrix, gap, active, unit, offset, work, index)
        following, _ = _next_in_contact(matrix, gap, active, unit, offset)

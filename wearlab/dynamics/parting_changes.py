"""Where flanks of a small system gain or lose contact, and what that does to the map of its motion."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.parting_law import BACKLASH, DEGREE, ERROR, MESH_DAMPING, REACH, VECTORS
from wearlab.dynamics.parting_series import LOOKS, NOWHERE, both_at, first_passing, look


@jit_inner
def next_change(
    plan: Any, present: Any, of_pair: Any, of_mesh: Any, at: int, start: float, terms: int, motion: Any,
    contact: Any, changed: Any, roots: Any, lines: Any, looks: Any,
) -> float:  # fmt: skip
    """Return where contact first changes in a block after ``start``, 2: nowhere; ``roots``: of each flank."""
    n, pairs, soonest = len(plan.coordinate), contact.shape[1] - 1, NOWHERE
    along, flank = lines[0], lines[1]
    for m in range(contact.shape[0]):
        for j in range(np.uint64(0), np.uint64(terms)):
            along[j] = 0.0
            for row in range(np.uint64(0), np.uint64(n)):
                along[j] += plan.mesh[m, np.uint64(VECTORS) + row] * motion[row, j]
        look(along, terms, start, looks[0])
        for p in range(pairs + 1):
            roots[m, p] = NOWHERE
            back = p == pairs
            if plan.mesh[m, BACKLASH] == np.inf if back else not present[at, m, p]:
                continue
            reach = of_mesh[at, m, ERROR] if back else of_pair[at, m, p, REACH]
            shift = -plan.mesh[m, BACKLASH] if back else 0.0
            look(reach, DEGREE + 1, start, looks[1])
            sign = 1.0 if contact[m, p] != back else -1.0
            part: Any = np.int64(LOOKS)  # no literal, for which `first_passing` compiles once more
            dips: Any = np.bool_(False)
            before = 0.0 if start > 0.0 else sign * (along[1] - reach[1])
            for i in range(LOOKS):
                value = sign * (looks[0, 0, i] - looks[1, 0, i] - shift)
                slope = sign * (looks[0, 1, i] - looks[1, 1, i])
                if changed[m, p]:  # its approach over time: at the start it has a root
                    time = (i + 1) * (1.0 / LOOKS) * (1.0 - start)
                    value /= time
                    slope = (slope - value) / time
                looks[1, 0, i], looks[1, 1, i] = value, slope
                if part == LOOKS:
                    # Where it falls and then rises it stays above the point where both tangents meet.
                    dips = value >= 0.0 and before < 0.0 < slope and value < slope * (1.0 / LOOKS)
                    part = i if dips or value < 0.0 else part
                before = slope
            if part < LOOKS:
                for j in range(terms):
                    flank[j] = sign * (along[j] - reach[j]) if j <= DEGREE else sign * along[j]
                flank[0] -= sign * shift
                roots[m, p] = first_passing(flank, terms, start, changed[m, p], part, dips, looks[1], soonest)
                soonest = min(soonest, roots[m, p])
    return soonest


@jit_inner
def add_jump(
    plan: Any, of_pair: Any, of_mesh: Any, at: int, x: float, m: int, begins: bool, changed: Any, state: Any,
    whole: Any,
) -> None:  # fmt: skip
    """Add to the map what the damping of a mesh does that begins or ends at fraction ``x`` of a block.

    The instant moves by ``dt = −(d·dq − dg)/ẋ``, and with it the rate by the jump of acceleration times dt.
    """
    n, pairs, length = len(plan.coordinate), changed.shape[1] - 1, plan.length[at]
    rate = 0.0
    for row in range(n):
        rate += plan.mesh[m, VECTORS + row] * state[n + row]
    error, error_rate = both_at(of_mesh[at, m, ERROR], DEGREE + 1, x)
    reach, reach_rate = error - plan.mesh[m, BACKLASH], error_rate
    for p in range(pairs):
        if changed[m, p]:
            reach, reach_rate = both_at(of_pair[at, m, p, REACH], DEGREE + 1, x)
    closing = rate - reach_rate / length
    if closing == 0.0:
        return  # a grazing contact has no time of its own
    factor = plan.mesh[m, MESH_DAMPING] * (rate - error_rate / length) / closing
    factor = -factor if begins else factor
    for col in range(whole.shape[1]):
        moved = -reach if col == 2 * n else 0.0
        for row in range(n):
            moved += plan.mesh[m, VECTORS + row] * whole[row, col]
        for row in range(n):
            whole[n + row, col] += factor * plan.mesh[m, VECTORS + n + row] * moved


@jit_inner
def key_of(contact: Any) -> Any:
    """Return what touches as one integer."""
    key = np.int64(1)
    for m in range(contact.shape[0]):
        for p in range(contact.shape[1]):
            key = 2 * key + (1 if contact[m, p] else 0)
    return key


@jit_inner
def follow_map(affine: Any, whole: Any, carried: Any, local: Any) -> None:
    """Let an affine map (2n, columns) follow ``whole``, and move ``local`` (columns,) by it."""
    rows, columns = np.uint64(whole.shape[0]), np.uint64(whole.shape[1])
    for row in range(np.uint64(0), rows):
        for col in range(np.uint64(0), columns):
            total = affine[row, col] if col >= rows else 0.0
            for inner in range(np.uint64(0), rows):
                total += affine[row, inner] * whole[inner, col]
            carried[row, col] = total
    for row in range(np.uint64(0), rows):
        total = 0.0
        for col in range(np.uint64(0), columns):
            total += affine[row, col] * local[col]
        whole[row, 0] = total
    for row in range(np.uint64(0), rows):
        local[row] = whole[row, 0]
        for col in range(np.uint64(0), columns):
            whole[row, col] = carried[row, col]


@jit_inner
def go_back(affine: Any, whole: Any, local: Any) -> bool:
    """Undo an affine map (2n, columns) on ``whole`` and ``local``, by elimination with row pivots.

    References
    ----------
    Golub & Van Loan, Matrix Computations, 4th ed., 2013, §3.4.
    """
    rows, columns = whole.shape
    matrix = np.empty((rows, rows))
    for row in range(rows):
        for col in range(rows):
            matrix[row, col] = affine[row, col]
        for col in range(rows, columns):
            whole[row, col] -= affine[row, col]
            local[row] -= affine[row, col] * local[col]
    for k in range(rows):
        pivot = k
        for row in range(k + 1, rows):
            if abs(matrix[row, k]) > abs(matrix[pivot, k]):
                pivot = row
        if matrix[pivot, k] == 0.0:
            return False
        if pivot != k:
            local[k], local[pivot] = local[pivot], local[k]
            for col in range(rows):
                matrix[k, col], matrix[pivot, col] = matrix[pivot, col], matrix[k, col]
            for col in range(columns):
                whole[k, col], whole[pivot, col] = whole[pivot, col], whole[k, col]
        over = 1.0 / matrix[k, k]
        for row in range(rows):
            if row != k:
                factor = matrix[row, k] * over
                for col in range(k, rows):
                    matrix[row, col] -= factor * matrix[k, col]
                for col in range(columns):
                    whole[row, col] -= factor * whole[k, col]
                local[row] -= factor * local[k]
        for col in range(columns):
            whole[k, col] *= over
        for col in range(k, rows):
            matrix[k, col] *= over
        local[k] *= over
    return True

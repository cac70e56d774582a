"""The orbit of a small system: Newton's method on its period map, its motion in pieces of power series.

A block of steps in which no flank gains or loses contact maps its start affinely, however the motion runs:
its series is computed once, and again only where other flanks touch. A change of contact is the root of a
polynomial; the map goes on from there with what touches then. Elastic forces are continuous at a change, so
its time moves the map to second order alone; damping that begins or ends adds its jump (the saltation of
Leine & Nijmeijer 2004, ch. 7), and the map is the derivative of the motion computed.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.collocation import SMOOTH
from wearlab.dynamics.collocation_kernel import largest_of, part_at_jumps
from wearlab.dynamics.parting_law import (
    BACKLASH,
    CARRIED,
    DEGREE,
    ERROR,
    FIRST,
    MESH_DAMPING,
    REACH,
    SIZE,
    SPRING,
    STAGES,
    VECTORS,
    fill_law,
    fill_polynomials,
    see,
    tabulate_pieces,
    touches,
)
from wearlab.dynamics.parting_series import (
    LOOKS,
    MOST_TERMS,
    NOWHERE,
    both_at,
    expand,
    first_passing,
    follow,
    look,
    map_at,
    state_at,
)
from wearlab.dynamics.touching_kernel import closed_by, contracts

FOUND, LOST, SINGULAR, ANOTHER_PLAN, ROUGH = 0, 1, 2, 3, 4
"""An orbit; Newton's method led to none; orbits are not alone; other steps join; a series takes too long."""
MOST_CHANGES, MOST_PASSES, HALVINGS = 16, 30, 6
MORE_SLOTS = 32
"""Series that are kept beside those of the blocks: of other contact there."""
NEAR = 1e-2
"""Distance between the ends of a period over the size of the state from which a pass may be the last."""
BEST = 1e-11
"""The same from which Newton's method is done where it gains no more."""
REGULAR = 1e-13
"""Least pivot of I − P, over its largest entry, above which its orbit is alone."""
TOGETHER = 1e-10
"""Fraction of a piece within which flanks change at the same instant: those of one gap do."""
SHORT = 1e-9
"""Fraction of a block too short for steps of its own."""


@jit_inner
def next_change(
    plan: Any, present: Any, of_pair: Any, of_mesh: Any, at: int, start: float, terms: int, motion: Any,
    contact: Any, changed: Any, roots: Any, lines: Any, looks: Any,
) -> float:  # fmt: skip
    """Return where contact first changes in a block after ``start``, 2: nowhere; ``roots``: of each flank."""
    n, pairs, found = len(plan.coordinate), contact.shape[1] - 1, NOWHERE
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
            sign, part, dips = 1.0 if contact[m, p] != back else -1.0, LOOKS, False
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
                roots[m, p] = first_passing(flank, terms, start, changed[m, p], part, dips, looks[1], found)
                found = min(found, roots[m, p])
    return found


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
def distance(a: Any, b: Any, scale: Any) -> float:
    """Return the largest difference of two states in their scale."""
    worst = 0.0
    for row in range(len(scale)):
        worst = max(worst, abs(a[row] - b[row]) / scale[row])
    return worst


@jit_inner
def follow_map(one: Any, whole: Any, carried: Any, local: Any) -> None:
    """Let an affine map (2n, columns) follow ``whole``, and move ``local`` (columns,) by it."""
    rows, columns = np.uint64(whole.shape[0]), np.uint64(whole.shape[1])
    for row in range(np.uint64(0), rows):
        for col in range(np.uint64(0), columns):
            total = one[row, col] if col >= rows else 0.0
            for inner in range(np.uint64(0), rows):
                total += one[row, inner] * whole[inner, col]
            carried[row, col] = total
    for row in range(np.uint64(0), rows):
        total = 0.0
        for col in range(np.uint64(0), columns):
            total += one[row, col] * local[col]
        whole[row, 0] = total
    for row in range(np.uint64(0), rows):
        local[row] = whole[row, 0]
        for col in range(np.uint64(0), columns):
            whole[row, col] = carried[row, col]


@jit_inner(allocates=True)
def go_back(one: Any, whole: Any, local: Any) -> bool:
    """Undo an affine map (2n, columns) on ``whole`` and ``local``, by elimination with row pivots.

    References
    ----------
    Golub & Van Loan, Matrix Computations, 4th ed., 2013, §3.4.
    """
    rows, columns = whole.shape
    matrix = np.empty((rows, rows))
    for row in range(rows):
        for col in range(rows):
            matrix[row, col] = one[row, col]
        for col in range(rows, columns):
            whole[row, col] -= one[row, col]
            local[row] -= one[row, col] * local[col]
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


@jit_inner
def unresolved(plan: Any, present: Any, of_pair: Any, path: Any, steps: int) -> float:
    """Return the part of pair forces that alternates from stage to stage, over the largest mesh force.

    A polynomial through 2J + 1 stages is as good as its highest difference is small: that of its last
    coefficient.
    """
    n, worst = len(plan.coordinate), 0.0
    for m in range(present.shape[1]):
        farthest, stiffest, missed = 0.0, 0.0, 0.0
        for step in range(steps + 1):
            position = 0.0
            for row in range(n):
                position += plan.mesh[m, VECTORS + row] * path[step, row]
            farthest = max(farthest, abs(position))
        for at in range(len(plan.block)):
            last, share = plan.block[at, STAGES] - 1, 1.0
            for power in range(1, last + 1):
                share *= power / (4.0 * plan.block[at, SIZE])
            total = 0.0
            for p in range(present.shape[2]):
                if present[at, m, p]:
                    pair = of_pair[at, m, p]
                    lost = abs(pair[SPRING, last]) * farthest + abs(pair[CARRIED, last])
                    missed, total = max(missed, share * lost), total + pair[SPRING, 0]
            stiffest = max(stiffest, total)
        worst = max(worst, missed / max(stiffest * farthest, 1e-300))
    return worst


@jit(allocates=True)
def small_orbit(
    plan: Any, tables: Any, period: float, given: Any,
    known: bool, bound: float, closed: float, path: Any, place: Any, derivative: Any, cut: Any,
) -> tuple[int, int, Any, Any, float, float, bool]:  # fmt: skip
    """Find an orbit by Newton's method, flanks parting or not.

    Parameters
    ----------
    plan : what wear states share
    tables : the mesh at the stages, `StepTables`
    period : duration of a mesh period [s]
    given : (2n + 1 + n_balance,) start, 1 and sizes of loads: filled with those of the orbit
    known : whether ``given`` is a start to go from; else the orbit of touching flanks is
    bound : of the multipliers
    closed : distance between the ends of an orbit over its size
    path : (most + 1, 2n) filled with the states at the ends of the steps
    place : (most, 4) filled with what the steps are: first step of their block, where they begin and end
        after its begin [steps], and the block
    derivative : (2n, 2n) filled with that of the map, loads in the columns of held coordinates
    cut : tables for (most,) steps, filled with those of the steps where there are changes of contact

    Returns
    -------
    what was found; passes; changes of contact in a period; steps; distance between the ends over the size;
    the part of the mesh force that the polynomials do not resolve; whether all multipliers are seen to be
    less than the bound
    """
    width, stiffness, gap, error, error_rate = tables
    joined = np.empty(len(plan.joined), np.bool_)
    for step in range(len(joined)):
        joined[step] = width[step] == width[step + 1]
    part_at_jumps(stiffness, SMOOTH * largest_of(stiffness), joined)
    part_at_jumps(gap, SMOOTH * largest_of(gap), joined)
    for step in range(len(joined)):
        if joined[step] != plan.joined[step]:
            return ANOTHER_PLAN, 0, 0, 0, np.inf, np.inf, False
    n, columns, blocks = len(plan.coordinate), len(given), len(plan.block)
    meshes, pairs, rows = error.shape[2], gap.shape[3], 2 * n
    present = np.empty((blocks, meshes, pairs), np.bool_)
    of_pair = np.empty((blocks, meshes, pairs, 3, DEGREE + 1))
    of_mesh = np.empty((blocks, meshes, 4, DEGREE + 1))
    fill_polynomials(plan, stiffness, gap, error, error_rate, present, of_pair, of_mesh)
    slots, used = blocks + MORE_SLOTS, blocks
    series = np.empty((slots, MOST_TERMS, n, columns))
    sensed = np.empty((meshes, columns, DEGREE + MOST_TERMS))
    count, key, owner = np.empty(slots, np.int64), np.zeros(slots, np.int64), np.empty(slots, np.int64)
    maps, mapped = np.empty((slots, rows, columns)), np.empty(slots, np.bool_)
    whole, one, carried = np.empty((rows, columns)), np.empty((rows, columns)), np.empty((rows, columns))
    law, lines = np.empty((meshes, 2, DEGREE + 1)), np.empty((2, MOST_TERMS))
    looks, damping = np.empty((2, 2, LOOKS)), np.empty(meshes)
    motion, roots = np.empty((n, MOST_TERMS)), np.empty((meshes, pairs + 1))
    contact, changed = np.zeros((meshes, pairs + 1), np.bool_), np.zeros((meshes, pairs + 1), np.bool_)
    local, before, after, nought = given.copy(), given.copy(), given.copy(), np.zeros(rows)
    residual, halved, everything, kept = np.inf, 0, not known, False
    for passes in range(1, MOST_PASSES + 1):
        changes, steps = np.int64(0), np.int64(0)  # no literals, for which callees compile once more
        for row in range(rows):
            for col in range(columns):
                whole[row, col] = 1.0 if row == col else 0.0
            path[0, row] = given[row]
        for col in range(columns):
            local[col] = given[col]
        for at in range(blocks):
            see(plan, present, of_pair, of_mesh, at, local, everything, contact)
            h, start = plan.length[at], 0.0
            for m in range(meshes):
                for p in range(pairs + 1):
                    changed[m, p] = False
            while True:
                touched = key_of(contact)
                slot = at
                if key[at] != 0 and key[at] != touched:
                    slot = blocks
                    while slot < used and not (owner[slot] == at and key[slot] == touched):
                        slot += 1
                    if slot == used:
                        slot, used = (used, used + 1) if used < slots else (blocks, blocks + 1)
                        key[slot] = 0
                if key[slot] == 0:
                    fill_law(plan, of_pair, of_mesh, at, period, contact, law, damping)
                    owner[slot], key[slot], mapped[slot] = at, touched, False
                    count[slot] = expand(plan, damping, law, h, sensed, series[slot])
                terms = count[slot]
                if terms == 0:
                    return ROUGH, passes, 0, 0, np.inf, np.inf, False
                if start > 0.0:
                    map_at(series[slot], terms, start, h, one)
                    if not go_back(one, whole, local):
                        return LOST, passes, 0, 0, np.inf, np.inf, False
                u = NOWHERE
                if not everything:
                    follow(series[slot], terms, local, motion)
                    u = next_change(
                        plan, present, of_pair, of_mesh, at, start, terms, motion, contact, changed, roots,
                        lines, looks,
                    )  # fmt: skip
                end = min(u, 1.0)
                if kept and end - start >= SHORT:
                    parts = plan.block[at, SIZE] if end - start > 0.5 else 2
                    if steps + parts > len(place):
                        return LOST, passes, 0, 0, np.inf, np.inf, False
                    for x in range(parts):
                        low, high = x / parts, (x + 1) / parts
                        place[steps + x, 0], place[steps + x, 3] = plan.block[at, FIRST], at
                        place[steps + x, 1] = plan.block[at, SIZE] * (start + (end - start) * low)
                        place[steps + x, 2] = plan.block[at, SIZE] * (start + (end - start) * high)
                        state_at(motion, terms, start + (end - start) * high, h, path[steps + x + 1])
                    steps += parts
                if not u < 1.0:
                    if not mapped[slot]:
                        map_at(series[slot], terms, 1.0, h, maps[slot])
                        mapped[slot] = True
                    follow_map(maps[slot], whole, carried, local)
                    break
                map_at(series[slot], terms, u, h, one)
                follow_map(one, whole, carried, local)
                start, changes = u, changes + 1
                if changes > MOST_CHANGES:
                    return LOST, passes, 0, 0, np.inf, np.inf, False
                for m in range(meshes):
                    gated = touches(contact, m)
                    for p in range(pairs + 1):
                        changed[m, p] = roots[m, p] <= u + TOGETHER
                        if changed[m, p]:
                            contact[m, p] = not contact[m, p]
                    begins = touches(contact, m)
                    if begins != gated and not plan.always:
                        add_jump(plan, of_pair, of_mesh, at, start, m, begins, changed, local, whole)
                if 1.0 - start < SHORT:
                    break
        size, missing = distance(given, nought, plan.scale), distance(local, given, plan.scale)
        if kept and (missing <= closed * size or (missing <= BEST * size and missing >= 0.5 * residual)):
            closed_by(whole, plan.held, plan.scale, after, derivative)
            if changes:
                tabulate_pieces(plan, tables, present, of_pair, of_mesh, place, steps, cut)
            left = unresolved(plan, present, of_pair, path, steps)
            attracting = contracts(derivative, plan.scale, bound)
            return FOUND, passes, changes, steps, missing / max(size, 1e-300), left, attracting
        if not everything and not missing <= 4.0 * residual and halved < HALVINGS:
            halved += 1
            for col in range(columns):
                given[col] = 0.5 * (given[col] + before[col])
            continue
        if not closed_by(whole, plan.held, plan.scale, after, derivative) > REGULAR:
            return SINGULAR, passes, 0, 0, np.inf, np.inf, False
        kept = everything or missing <= NEAR * size
        residual = np.inf if everything else missing
        everything, halved = False, 0
        for col in range(columns):
            before[col], given[col] = given[col], after[col]
    return LOST, MOST_PASSES, 0, 0, np.inf, np.inf, False

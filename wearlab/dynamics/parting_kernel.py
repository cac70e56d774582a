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
from wearlab.dynamics.collocation_kernel import join
from wearlab.dynamics.parting_changes import add_jump, follow_map, go_back, key_of, next_change
from wearlab.dynamics.parting_law import (
    CARRIED,
    DEGREE,
    FIRST,
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
    expand,
    follow,
    map_at,
    state_at,
)
from wearlab.dynamics.touching_kernel import REGULAR, closed_by, contracts

FOUND, LOST, SINGULAR, ANOTHER_PLAN, ROUGH = 0, 1, 2, 3, 4
"""An orbit; Newton's method led to none; orbits are not alone; other steps join; a series takes too long."""
MOST_CHANGES, MOST_PASSES, HALVINGS = 16, 30, 6
MORE_SLOTS = 32
"""Series that are kept beside those of the blocks: of other contact there."""
NEAR = 1e-2
"""Distance between the ends of a period over the size of the state from which a pass may be the last."""
BEST = 1e-11
"""The same from which Newton's method is done where it gains no more."""
TOGETHER = 1e-10
"""Fraction of a piece within which flanks change at the same instant: those of one gap do."""
SHORT = 1e-9
"""Fraction of a block too short for steps of its own."""


@jit_inner
def distance(a: Any, b: Any, scale: Any) -> float:
    """Return the largest difference of two states in their scale."""
    worst = 0.0
    for row in range(len(scale)):
        worst = max(worst, abs(a[row] - b[row]) / scale[row])
    return worst


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


@jit
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
    join(width, stiffness, gap, joined)
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
    whole, affine, carried = np.empty((rows, columns)), np.empty((rows, columns)), np.empty((rows, columns))
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
                    map_at(series[slot], terms, start, h, affine)
                    if not go_back(affine, whole, local):
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
                map_at(series[slot], terms, u, h, affine)
                follow_map(affine, whole, carried, local)
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

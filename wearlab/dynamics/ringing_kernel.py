"""The orbit of a small stiff system whose flanks touch, in pieces of power series: one compiled call."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.ringing_series import (
    DEGREE,
    LOOKS,
    MOST_TERMS,
    STAGES,
    at_ends,
    begin,
    expand,
    in_columns,
    law_at_stages,
    map_between,
    smooth,
)
from wearlab.dynamics.touching_kernel import FOUND, PARTED, REGULAR, SINGULAR, closed_by, contracts

ROUGH = 4
"""A series takes too long."""
STEPS = 4
"""Of a group."""


@jit_inner
def along(basis: Any, given: Any, out: Any) -> None:
    """Write coordinates and speeds (2n,) in a basis, its vectors in rows."""
    n = len(basis)
    for row in range(n):
        place, speed = 0.0, 0.0
        for k in range(n):
            place += basis[row, k] * given[k]
            speed += basis[row, k] * given[n + k]
        out[row], out[n + row] = place, speed


@jit_inner
def follow(
    plan: Any, series: Any, terms: Any, to_middle: Any, maps: Any, given: Any, middle: Any, states: Any,
    motion: Any,
) -> None:  # fmt: skip
    """Fill the one motion with this start, 1 and loads: its series, and its states at the ends of groups.

    Parameters
    ----------
    series, terms, to_middle, maps : of all groups
    given : (columns,) start of the first group, 1 and sizes of loads
    middle : (columns of the series,) scratch
    states : (n_groups + 1, 2n) filled
    motion : (n, n_groups, MOST_TERMS) filled
    """
    n, (_, rows, columns) = series.shape[2], to_middle.shape
    felt, beyond = rows // 2, len(given) - columns
    for row in range(2 * n):
        states[0, row] = given[row]
    for col in range(rows, columns):
        middle[col] = given[beyond + col]
    for at in range(len(maps)):
        half, start, count = plan.half[at], states[at], np.uint64(terms[at])
        for row in range(rows):
            total = 0.0
            for k in range(felt):
                total += to_middle[at, row, k] * start[k] + to_middle[at, row, felt + k] * start[n + k]
            for col in range(rows, columns):
                total += to_middle[at, row, col] * middle[col]
            middle[row] = total
        for row in range(n):
            line, back, slope, sign = motion[row, at], 0.0, 0.0, 1.0
            for j in range(np.uint64(0), count):
                total = 0.0
                for col in range(np.uint64(0), np.uint64(columns)):
                    total += series[at, j, row, col] * middle[col]
                line[j] = total
                back, slope, sign = back + sign * total, slope - sign * float(j) * total, -sign
            for j in range(count, np.uint64(MOST_TERMS)):
                line[j] = 0.0
            if row >= felt:  # what nothing feels goes on from where it was
                line[1] = half * start[n + row] - slope
                line[0] = start[row] + line[1] - back
        for row in range(2 * n):
            total = 0.0
            for col in range(2 * n):
                total += maps[at, row, col] * start[col]
            for col in range(rows, columns):
                total += maps[at, row, beyond + col] * middle[col]
            states[at + 1, row] = total


@jit_inner
def parts(plan: Any, tables: Any, positions: Any, ends: Any) -> bool:
    """Whether some pair in the path parts at a look.

    Parameters
    ----------
    positions : (n · n_groups, …) coordinates at the looks inside the groups
    ends : (n_groups + 1, 2n) states at their ends
    """
    meshes, felt = plan.direction.shape
    groups, x, looks = len(plan.half), np.empty(felt), STEPS * LOOKS
    for step in range(len(tables.width)):
        group = step // STEPS
        for look in range(LOOKS + 1):
            at, share = LOOKS * (step % STEPS) + look, plan.within[look]
            for k in range(felt):
                if at % looks == 0:
                    x[k] = ends[group + at // looks, k]
                else:
                    x[k] = positions[k * groups + group, at - 1]
            for m in range(meshes):
                of, delta = plan.mesh[m], 0.0
                for stage in range(3):
                    delta -= share[stage] * tables.error[step, stage, of]
                for k in range(felt):
                    delta += plan.direction[m, k] * x[k]
                for p in range(tables.stiffness.shape[3]):
                    gap = 0.0
                    for stage in range(3):
                        gap += share[stage] * tables.gap[step, stage, of, p]
                    if not delta >= gap and tables.stiffness[step, 1, of, p] > 0.0:
                        return True
    return False


@jit
def ringing_orbit(
    plan: Any, tables: Any, bound: float, given: Any, path: Any, motion: Any, derivative: Any
) -> tuple[int, Any, float, float, bool]:
    """Find the orbit on which every pair in the path touches.

    Parameters
    ----------
    plan : `wearlab.dynamics.ringing_plan.RingingPlan`
    tables : the mesh at the stages, `wearlab.mesh.stages.StageTables.filled`
    bound : of the multipliers
    given : (2n + 1 + n_balance,) filled with start, 1 and sizes of loads
    path : (n_steps + 1, 2n) filled with the states at the ends of the steps; of none: it rests
    motion : (n, n_groups, MOST_TERMS) filled with coordinates in the basis of the plan, by powers of the time
        from the middle of each group, in halves of it
    derivative : (2n, 2n) filled with that of the map, loads in the columns of held coordinates

    Returns
    -------
    what was found; most terms of a series; distance between the ends over the size of the path; the part of
    the mesh law that the steps do not resolve; whether all multipliers are seen to be less than the bound
    """
    (n, felt), groups, loads = plan.stiffness.shape, len(plan.half), len(plan.load)
    rows, columns = 2 * n, 2 * felt + loads
    every, width = rows + loads, in_columns(columns)
    law, shares = np.empty((STAGES, n * (felt + 1))), np.empty((STAGES, n * (felt + 1)))
    pushed, damped = np.zeros((DEGREE + 1, n, width)), np.empty((n, felt))
    ends, matrix = np.empty((2, 2, n, width)), np.empty((2 * felt, 2 * felt + columns))
    series, terms = np.empty((groups, MOST_TERMS, n, width)), np.empty(groups, np.int64)
    to_middle, maps = np.empty((groups, 2 * felt, columns)), np.zeros((groups, rows, every))
    whole, carried = np.zeros((rows, every)), np.zeros((rows, every))
    most, left = np.int64(0), 0.0
    for row in range(rows):
        whole[row, row] = 1.0
    for at in range(groups):
        law_at_stages(plan, tables, STEPS * at, law)
        degree, missed = smooth(plan, law, shares)
        begin(plan, law, degree, plan.half[at], pushed, damped, series[at])
        count = expand(felt, law, degree, damped, pushed, series[at])
        if count == 0:
            return ROUGH, 0, 0.0, np.inf, False
        terms[at], most, left = count, max(most, count), max(left, missed)
        at_ends(series[at], count, ends)
        map_between(ends, plan.half[at], matrix, to_middle[at], maps[at])
        for row in range(rows):
            for col in range(every):
                total = maps[at, row, col] if col >= rows else 0.0
                for k in range(rows):
                    total += maps[at, row, k] * whole[k, col]
                carried[row, col] = total
        whole, carried = carried, whole
    back = plan.basis.T.copy()
    for col in range(every):
        along(back, whole[:, col], carried[:, col])
    for row in range(rows):
        along(back, carried[row], whole[row])
        for col in range(rows, every):
            whole[row, col] = carried[row, col]
    if not closed_by(whole, plan.held, plan.scale, given, derivative) > REGULAR:
        return SINGULAR, most, 0.0, left, False
    attracting = contracts(derivative, plan.scale, bound)
    if len(path) == 0:
        return FOUND, most, 0.0, left, attracting
    states, inside = np.empty((groups + 1, rows)), given.copy()
    along(plan.basis, given, inside)
    follow(plan, series, terms, to_middle, maps, inside, np.empty(columns), states, motion)
    looked = np.dot(motion.reshape((n * groups, MOST_TERMS)), plan.looks)
    if parts(plan, tables, looked, states):
        return PARTED, most, 0.0, left, False
    apart, size = 0.0, 0.0
    for at in range(groups + 1):
        along(back, states[at], path[STEPS * at])
        for step in range(1, STEPS if at < groups else 1):
            for row in range(n):
                line = looked[row * groups + at]
                inside[row], slope = line[LOOKS * step - 1], line[STEPS * LOOKS - 2 + step]
                inside[n + row] = slope / plan.half[at]
            along(back, inside, path[STEPS * at + step])
    for row in range(rows):
        apart = max(apart, abs(path[-1, row] - path[0, row]) / plan.scale[row])
        for step in range(len(path)):
            size = max(size, abs(path[step, row]) / plan.scale[row])
    return FOUND, most, apart / max(size, 1e-300), left, attracting

"""The orbit of touching meshes in one compiled call: map, closing of the period, path, and its worth."""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.collocation import SIZES
from wearlab.dynamics.collocation_inputs import Inputs, tabulate
from wearlab.dynamics.collocation_kernel import (
    join,
    largest_of,
    over_groups,
    part_at_jumps,
    path_over_groups,
    starts_of_groups,
)
from wearlab.dynamics.newton import solve_linear
from wearlab.dynamics.propagator import GRID
from wearlab.dynamics.sections import turn_back

FOUND, PARTED, SINGULAR, ANOTHER_PLAN = 0, 1, 2, 3
"""The orbit is there; a flank parts on it; orbits are not alone; the tables ask for another plan."""
REGULAR = 1e-13
"""Least pivot of I − P, over its largest entry, above which its orbit is alone."""
SQUARINGS = 9
"""Powers of two to which the derivative of the map is raised to see it contract."""


class TouchingPlan(NamedTuple):
    """What all wear states of a system on the same steps share.

    Parameters
    ----------
    tables, groups : groups of steps, see `wearlab.dynamics.collocation.Cut`
    joined : (n_steps − 1,) where no table jumps from step to step
    power : (n_mesh,) mean mesh stiffnesses in powers, see `wearlab.dynamics.collocation.mean_powers`
    mean : (n_mesh,) stiffness that the linear part holds [N/m]
    direction : (n_mesh, n) d
    damping : (n_mesh,) mesh damping over the mesh period [N]
    share, to, of, load : see `wearlab.dynamics.collocation_inputs.Inputs`
    held : (n_balance,) coordinates whose place a load of unknown size takes
    scale : (2n,) sizes of the states
    static : (n,) state from which coordinates are counted, so that the constant load is no input; or 0 [m]
    sections, turn, mesh : see `wearlab.dynamics.symmetry.Symmetry`; groups, and loads that vary, are those of
        the first section
    """

    tables: Array
    groups: Index
    joined: Flags
    power: Index
    mean: Array
    direction: Array
    damping: Array
    share: Array
    to: Index
    of: Index
    load: Array
    held: Index
    scale: Array
    static: Array
    sections: int
    turn: Array
    mesh: Index


@jit_inner
def powers_into(width: Any, stiffness: Any, power: Any) -> None:
    """Fill the powers of ``1 + GRID`` that mean mesh stiffnesses are nearest to, (n_mesh,)."""
    for m in range(len(power)):
        total = 0.0
        for step in range(len(width)):
            for p in range(stiffness.shape[3]):
                k = stiffness[step, 0, m, p] + 4.0 * stiffness[step, 1, m, p] + stiffness[step, 2, m, p]
                total += width[step] * k
        power[m] = np.int64(np.round(np.log(max(total / 6.0, 1e-300)) / GRID))


@jit
def describe(width: Any, stiffness: Any, gap: Any, sliding: Any, joined: Any, power: Any) -> None:
    """Fill what the plan of tables depends on: where steps join, and the mean stiffnesses."""
    join(width, stiffness, gap, joined)
    if len(sliding):
        part_at_jumps(sliding, joined)
    powers_into(width, stiffness, power)


@jit_inner
def closed_by(whole: Any, held: Any, scale: Any, given: Any, derivative: Any) -> float:
    """Fill start, 1 and sizes of loads of the orbit; return the least pivot over the largest entry.

    ``derivative`` (2n, 2n) becomes that of the map where loads take the columns of held coordinates.
    """
    rows = len(scale)
    matrix = np.empty((rows, rows))
    right = np.empty(rows)
    for row in range(rows):
        for col in range(rows):
            derivative[row, col] = whole[row, col]
        for b in range(len(held)):
            derivative[row, held[b]] = whole[row, rows + 1 + b]
    for row in range(rows):
        right[row] = whole[row, rows] / scale[row]
        for col in range(rows):
            matrix[row, col] = -derivative[row, col] * scale[col] / scale[row]
        matrix[row, row] += 1.0
    for b in range(len(held)):
        matrix[held[b], held[b]] -= 1.0
    pivot = solve_linear(matrix, right)
    for row in range(rows):
        given[row] = right[row] * scale[row]
    given[rows] = 1.0
    for b in range(len(held)):
        given[rows + 1 + b] = given[held[b]]
        given[held[b]] = 0.0
    return pivot


@jit_inner
def contracts(derivative: Any, scale: Any, bound: float) -> bool:
    """Whether all multipliers are seen to be less than ``bound``: a power of the map is, in the norm.

    ``|μ|^m ≤ ‖P^m‖``, m = 2, 4, 8 …; False says nothing.
    """
    rows, limit = len(scale), bound
    power, square = np.empty((rows, rows)), np.empty((rows, rows))
    for row in range(rows):
        for col in range(rows):
            power[row, col] = derivative[row, col] * scale[col] / scale[row]
    for _ in range(SQUARINGS):
        norm = 0.0
        for row in range(rows):
            total = 0.0
            for col in range(rows):
                total += abs(power[row, col])
            norm = max(norm, total)
        if norm < limit:
            return True
        if not norm < 1e100:
            return False
        for row in range(rows):
            for col in range(rows):
                square[row, col] = 0.0
            for inner in range(rows):
                factor = power[row, inner]
                for col in range(rows):
                    square[row, col] += factor * power[inner, col]
        power, square = square, power
        limit *= limit
    return False


@jit_inner
def shift(static: Any, direction: Any, law: Any, push: Any) -> None:
    """Count the coordinates from ``static``: ``push − law d·static``."""
    meshes, n = direction.shape
    for channel in range(law.shape[2]):
        felt = 0.0
        for row in range(n):
            felt += direction[channel % meshes, row] * static[row]
        for step in range(len(law)):
            for stage in range(3):
                push[step, stage, channel] -= law[step, stage, channel] * felt


@jit_inner
def unresolved(entering: Any, groups: Any, count: int) -> float:
    """Return the part of the inputs that alternates from stage to stage, over their size: the largest.

    A polynomial through 2J + 1 stages is as good as its highest differences are small.
    """
    worst = 0.0
    for a in range(count):
        scale, largest = 0.0, 0.0
        for group in range(len(groups)):
            last = 2 * groups[group, 1]
            factor, total, weights = 1.0, 0.0, 0.0
            for stage in range(last + 1):
                value = entering[group, stage * count + a]
                scale = max(scale, abs(value))
                total += factor * value
                weights += abs(factor)
                factor *= -(last - stage) / (stage + 1.0)
            largest = max(largest, abs(total) / weights)
        if scale > 0.0:
            worst = max(worst, largest / scale)
    return worst


@jit
def parts(path: Any, direction: Any, period: float, tables: Any) -> bool:
    """Whether some pair in the path parts at an end or in the middle of a step.

    The middle is that of the cubic Hermite polynomial between both ends.
    """
    meshes, n = direction.shape
    for m in range(meshes):
        before, rate_before = 0.0, 0.0
        for step in range(len(path)):
            at, rate = 0.0, 0.0
            for row in range(n):
                at += direction[m, row] * path[step, row]
                rate += direction[m, row] * path[step, n + row]
            if step > 0:
                last = step - 1
                middle = 0.5 * (before + at) + 0.125 * tables.width[last] * period * (rate_before - rate)
                for stage, value in enumerate((before, middle, at)):
                    delta = value - tables.error[last, stage, m]
                    for p in range(tables.stiffness.shape[3]):
                        if not delta >= tables.gap[last, stage, m, p]:
                            if tables.stiffness[last, stage, m, p] > 0.0:
                                return True
            before, rate_before = at, rate
    return False


@jit
def suits(plan: Any, tables: Any) -> bool:
    """Whether a plan is of tables of a mesh period: of their jumps and mean stiffnesses."""
    joined, power = np.empty(len(plan.joined), np.bool_), np.empty(len(plan.power), np.int64)
    describe(tables.width, tables.stiffness, tables.gap, tables.sliding, joined, power)
    for m in range(len(power)):
        if power[m] != plan.power[m]:
            return False
    for step in range(len(joined)):
        if joined[step] != plan.joined[step]:
            return False
    return True


@jit
def orbit_of(
    plan: Any, tables: Any, period: float, bound: float, given: Any, path: Any, whole: Any, derivative: Any
) -> tuple[int, float, float, bool]:  # fmt: skip
    """Find the orbit on which every pair in the path touches.

    Parameters
    ----------
    plan : what wear states share
    tables : the mesh at the stages, of the first section where there are more: those that `suits` the plan
    period : duration of a mesh period [s]
    bound : of the multipliers
    given : (2n + 1 + n_balance,) filled with start, 1 and sizes of loads
    path : (n_steps + 1, 2n) filled with the states at the ends of the steps
    whole : (2n, 2n + 1 + n_balance) filled with the map over the period, or over a section, turned back
    derivative : (2n, 2n) filled with its derivative, loads in the columns of held coordinates

    Returns
    -------
    what was found; distance between the ends over the size of the path; the part of the inputs that the steps
    do not resolve, over their size; whether all multipliers are seen to be less than the bound
    """
    if plan.sections == 1 and not suits(plan, tables):
        return ANOTHER_PLAN, 0.0, 0.0, False
    steps, columns, rows = len(tables.width), len(given), len(plan.scale)
    channels = 3 * len(plan.direction) if len(tables.sliding) else len(plan.direction)
    law, push = np.empty((steps, 3, channels)), np.empty((steps, 3, channels))
    tabulate(
        tables.stiffness, tables.gap, tables.error, tables.error_rate, tables.sliding, tables.moment,
        plan.mean, plan.damping, law, push,
    )  # fmt: skip
    shift(plan.static, plan.direction, law, push)
    inputs = Inputs(plan.share, plan.to, plan.of, law, push, plan.load)
    count, groups = plan.load.shape[2], len(plan.groups)
    stages = np.empty((groups, (2 * SIZES[0] + 1) * count, columns))
    maps = np.empty((groups, rows, columns))
    over_groups(plan.tables, plan.groups, plan.direction, inputs, stages, maps, whole)
    if plan.sections > 1:
        turn_back(plan.turn, whole)
    if not closed_by(whole, plan.held, plan.scale, given, derivative) > REGULAR:
        return SINGULAR, 0.0, 0.0, False
    if largest_of(push) == 0.0 and largest_of(plan.load) == 0.0:  # at rest
        path[:, :] = 0.0
        return FOUND, 0.0, 0.0, contracts(derivative, plan.scale, bound ** (1.0 / plan.sections))
    starts, entering = np.empty((groups + 1, rows)), np.zeros((groups, stages.shape[1]))
    starts_of_groups(maps, stages, given.copy(), starts, entering)
    path_over_groups(plan.tables, plan.groups, len(plan.direction), count, starts, entering, path)
    for row in range(rows // 2):
        given[row] += plan.static[row]
        for step in range(steps + 1):
            path[step, row] += plan.static[row]
    if parts(path, plan.direction, period, tables):
        return PARTED, 0.0, 0.0, False
    apart, size, end = 0.0, 0.0, path[steps].copy().reshape((rows, 1))
    if plan.sections > 1:
        turn_back(plan.turn, end)
    for row in range(rows):
        apart = max(apart, abs(end[row, 0] - path[0, row]) / plan.scale[row])
        for step in range(steps + 1):
            size = max(size, abs(path[step, row]) / plan.scale[row])
    left = unresolved(entering, plan.groups, count)
    attracting = contracts(derivative, plan.scale, bound ** (1.0 / plan.sections))
    return FOUND, apart / max(size, 1e-300), left, attracting

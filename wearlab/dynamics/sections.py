"""Motion over a mesh period from that over one of its sections, see `wearlab.dynamics.symmetry`."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.collocation_kernel import largest_of
from wearlab.dynamics.symmetry import SAME

NOTHING = 1e-15
"""Difference of gaps and errors that is nothing [m]."""


@jit
def in_sections(sections: int, mesh: Any, tables: Any) -> bool:
    """Whether every mesh shows in the tables what its predecessor did a section before; of one, at once.

    Parameters
    ----------
    sections, mesh : see `wearlab.dynamics.symmetry.Symmetry`
    tables : the mesh at the stages, `wearlab.mesh.stages.StageTables.filled`
    """
    width, error, rate = tables.width, tables.error, tables.error_rate
    steps = len(width) // sections
    if steps * sections != len(width):
        return False
    for step in range(len(width)):
        if not abs(width[(step + steps) % len(width)] - width[step]) <= SAME * width[step]:
            return False
    limits, of_meshes = limits_of(tables), (*error.shape, 1)
    if not alike(error.reshape(of_meshes), steps, mesh, limits[1]):
        return False
    if not alike(rate.reshape(of_meshes), steps, mesh, limits[2]):
        return False
    if not alike(tables.gap, steps, mesh, limits[1]):
        return False
    if (
        alike(tables.stiffness, steps, mesh, limits[0])
        and alike(tables.sliding, steps, mesh, SAME * largest_of(tables.sliding))
        and alike(tables.moment, steps, mesh, SAME * largest_of(tables.moment))
    ):
        return True
    for step in range(len(width)):
        for stage in range(error.shape[1]):
            for m in range(len(mesh)):
                if not same_springs(tables, limits, step, (step + steps) % len(width), stage, m, mesh[m]):
                    return False
    return True


@jit_inner
def alike(table: Any, steps: int, mesh: Any, limit: float) -> bool:
    """Whether a table (n_steps, 3, n_mesh, n_pairs) changes from section to section by the limit at most."""
    count, stages, meshes, pairs = table.shape
    row = stages * meshes * pairs
    flat, of = table.reshape((count, row)), np.empty(row, np.int64)
    for x in range(row):
        of[x] = (x // (meshes * pairs) * meshes + mesh[x // pairs % meshes]) * pairs + x % pairs
    for step in range(count):
        now, later, same = flat[step], flat[(step + steps) % count], True
        for x in range(np.uint64(0), np.uint64(row)):
            same &= abs(later[np.uint64(of[x])] - now[x]) <= limit
        if not same:
            return False
    return True


@jit_inner
def limits_of(tables: Any) -> tuple[float, float, float, float, float]:
    """Return the differences of stiffness, gap, error rate, friction and its moment that are rounding."""
    stiffness, friction, moment = SAME * largest_of(tables.stiffness), 0.0, 0.0
    gap = max(SAME * max(largest_of(tables.gap), largest_of(tables.error)), NOTHING)
    rate = max(SAME * largest_of(tables.error_rate), NOTHING)
    if len(tables.sliding):
        friction, moment = stiffness * largest_of(tables.sliding), stiffness * largest_of(tables.moment)
    return stiffness, gap, rate, friction, moment


@jit_inner
def same_springs(tables: Any, limits: Any, step: int, another: int, stage: int, m: int, n: int) -> bool:
    """Whether mesh ``m`` in a step has the springs of mesh ``n`` in another.

    Springs that stand for coupled pairs with the same gap share their stiffness in an order that rounding
    decides: their sum counts.
    """
    k, gap, more, alike = tables.stiffness, tables.gap, 0.0, np.nan
    rubs, turns = 0.0, 0.0
    for p in range(k.shape[3]):
        first, second = k[step, stage, m, p], k[another, stage, n, p]
        if not abs(gap[another, stage, n, p] - gap[step, stage, m, p]) <= limits[1]:
            return False
        if not abs(second - first) <= limits[0]:
            alike = gap[step, stage, m, p] if np.isnan(alike) else alike
            if not abs(gap[step, stage, m, p] - alike) <= limits[1]:
                return False
        more += second - first
        if len(tables.sliding):
            rubs += second * tables.sliding[another, stage, n, p] - first * tables.sliding[step, stage, m, p]
            turns += second * tables.moment[another, stage, n, p] - first * tables.moment[step, stage, m, p]
    return abs(more) <= limits[0] and abs(rubs) <= limits[3] and abs(turns) <= limits[4]


@jit_inner
def turn_back(turn: Any, states: Any) -> None:
    """Turn positions and speeds (2n, columns) back by a section, in place: ``R⁻¹ = Rᵀ``."""
    n = len(turn)
    given = states.copy()
    for row in range(n):
        for col in range(states.shape[1]):
            place, speed = 0.0, 0.0
            for at in range(n):
                place += turn[at, row] * given[at, col]
                speed += turn[at, row] * given[n + at, col]
            states[row, col], states[n + row, col] = place, speed


@jit
def path_over_sections(turn: Any, sections: int, path: Any) -> None:
    """Continue a path over the first section, in ``path`` (n_steps + 1, 2n), over all of them."""
    n, steps = len(turn), (len(path) - 1) // sections
    for step in range(steps + 1, len(path)):
        for row in range(n):
            place, speed = 0.0, 0.0
            for at in range(n):
                place += turn[row, at] * path[step - steps, at]
                speed += turn[row, at] * path[step - steps, n + at]
            path[step, row], path[step, n + row] = place, speed

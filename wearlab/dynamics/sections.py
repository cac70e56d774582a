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
    """Whether every mesh shows in the tables what its predecessor did a section before.

    Parameters
    ----------
    sections, mesh : see `wearlab.dynamics.symmetry.Symmetry`
    tables : the mesh at the stages, `wearlab.mesh.stages.StageTables.filled`
    """
    width, error, rate = tables.width, tables.error, tables.error_rate
    steps = len(width) // sections
    if steps * sections != len(width):
        return False
    for step in range(len(width) - steps):
        if not abs(width[step + steps] - width[step]) <= SAME * width[step]:
            return False
    limits, of_meshes = limits_of(tables), (*error.shape, 1)
    if not apart(error.reshape(of_meshes), steps, mesh) <= limits[1]:
        return False
    if not apart(rate.reshape(of_meshes), steps, mesh) <= limits[2]:
        return False
    if not apart(tables.gap, steps, mesh) <= limits[1]:
        return False
    if (
        apart(tables.stiffness, steps, mesh) <= limits[0]
        and apart(tables.sliding, steps, mesh) <= SAME * largest_of(tables.sliding)
        and apart(tables.moment, steps, mesh) <= SAME * largest_of(tables.moment)
    ):
        return True
    for step in range(len(width) - steps):
        for stage in range(error.shape[1]):
            for m in range(len(mesh)):
                if not same_springs(tables, limits, step, step + steps, stage, m, mesh[m]):
                    return False
    return True


@jit_inner
def apart(table: Any, steps: int, mesh: Any) -> float:
    """Return the largest change of a table (n_steps, 3, n_mesh, n_pairs) from section to section, or NaN."""
    found = 0.0
    for step in range(len(table) - steps):
        for stage in range(table.shape[1]):
            for m in range(table.shape[2]):
                for p in range(table.shape[3]):
                    value = abs(table[step + steps, stage, mesh[m], p] - table[step, stage, m, p])
                    found = value if value > found or value != value else found
    return found


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
def same_springs(tables: Any, limits: Any, one: int, other: int, stage: int, m: int, n: int) -> bool:
    """Whether mesh ``m`` in a step has the springs of mesh ``n`` in another.

    Springs that stand for coupled pairs with the same gap share their stiffness in an order that rounding
    decides: their sum counts.
    """
    k, gap, more, alike = tables.stiffness, tables.gap, 0.0, np.nan
    rubs, turns = 0.0, 0.0
    for p in range(k.shape[3]):
        first, second = k[one, stage, m, p], k[other, stage, n, p]
        if not abs(gap[other, stage, n, p] - gap[one, stage, m, p]) <= limits[1]:
            return False
        if not abs(second - first) <= limits[0]:
            alike = gap[one, stage, m, p] if np.isnan(alike) else alike
            if not abs(gap[one, stage, m, p] - alike) <= limits[1]:
                return False
        more += second - first
        if len(tables.sliding):
            rubs += second * tables.sliding[other, stage, n, p] - first * tables.sliding[one, stage, m, p]
            turns += second * tables.moment[other, stage, n, p] - first * tables.moment[one, stage, m, p]
    return abs(more) <= limits[0] and abs(rubs) <= limits[3] and abs(turns) <= limits[4]


@jit_inner(allocates=True)
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

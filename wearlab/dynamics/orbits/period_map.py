"""The map over one mesh period: the trajectory and, side by side, its derivative by the initial state."""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import UNCOUNTED, jit
from wearlab.dynamics.balance import rebalance
from wearlab.dynamics.steps.contact_change import step_with_changes
from wearlab.dynamics.steps.damping_law import step_by_law
from wearlab.dynamics.steps.exact import exact_pair
from wearlab.dynamics.steps.kernel import Propagated, copy
from wearlab.dynamics.steps.mesh_law import channel_law, contact_holds, flank_law, hold_all, see_start
from wearlab.dynamics.steps.one_step import fill_load, step_of

LOCATED, PERMANENT = 0, 1
"""Contact within a step: its changes located; or every pair in the path touches and pushes, whatever the
state."""


def two_steps(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, w: Any, states: Any, i: Any, s: Any,
    contact: Any,
) -> bool:  # fmt: skip
    """Advance two equal steps at once where the structure can and no contact changes; return whether."""
    raise NotImplementedError("compiled code only")


@overload(two_steps, jit_options=UNCOUNTED, strict=False)
def _choose_two(structure: Any, *rest: Any) -> Any:
    return _two if structure.instance_class is Propagated else _never


def _never(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, w: Any, states: Any, i: Any, s: Any,
    contact: Any,
) -> bool:  # fmt: skip
    return False


def _two(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, w: Any, states: Any, i: Any, s: Any,
    contact: Any,
) -> bool:  # fmt: skip
    if not structure.paired[step]:
        return False
    size = np.uint64(2 * len(structure.push)) * w
    second, third = i + size, i + size + size
    flank_law(kernel.meshes, tables, step + 1, 0.0, 1.0, period, s, s.law[1], s.rub[1])
    channel_law(kernel.meshes, s, s.law[1], s.rub[1], structure.second_mesh, s.force)
    fill_load(structure, kernel, tables, step + 1, w, s.force, structure.second_load)
    if not exact_pair(structure, w, states, i, second, third, s.mesh, s.load, tables.width[step] * period):
        return False
    return contact == PERMANENT or (
        contact_holds(kernel, tables, step, period, w, states, i, second, s, s.law[0])
        and contact_holds(kernel, tables, step + 1, period, w, states, second, third, s, s.law[1])
    )


@jit(counted=False)
def over_period(
    kernel: Any,
    tables: Any,
    period: float,
    columns: Any,
    width: Any,
    states: Any,
    first: Any,
    s: Any,
    contact: int,
) -> int:
    """Advance state ``first`` over one mesh period, one state a step; return the number of contact changes.

    Parameters
    ----------
    kernel : the system
    tables : the mesh at the stages
    period : duration of a mesh period [s]
    columns : columns to advance (uint64): 1 for the trajectory alone
    width : as long as a state has columns
    states : flat (…, 2n, width); state ``first`` is read, the n_steps after it are written
    s : scratch
    contact : `LOCATED`, or `PERMANENT`, the affine map of a loaded mesh
    """
    w = np.uint64(len(width))
    size = np.uint64(2 * len(kernel.structure.push)) * w
    i = np.uint64(first) * size
    changes, done = 0, 0
    for step in range(len(tables.width)):
        j = i + size
        if step < done:
            i = j
            continue
        if contact == LOCATED:
            parts = step_by_law(kernel.meshes.law, kernel, tables, step, period, columns, w, states, i, j, s)
            if parts >= 0:
                changes += parts
                i = j
                continue
        if contact == PERMANENT:
            hold_all(kernel, tables, step, s)
            flank_law(kernel.meshes, tables, step, 0.0, 1.0, period, s, s.law[0], s.rub[0])
        else:
            see_start(kernel, tables, step, period, w, states, i, s, s.law[0], s.rub[0])
        channel_law(kernel.meshes, s, s.law[0], s.rub[0], s.mesh, s.force)
        fill_load(kernel.structure, kernel, tables, step, w, s.force, s.load)
        if two_steps(kernel.structure, kernel, tables, step, period, w, states, i, s, contact):
            done = step + 2
            i = j
            continue
        step_of(
            kernel.structure, columns, w, states, i, states, j, s.mesh, s.load, tables.width[step] * period
        )
        if contact != PERMANENT and not contact_holds(
            kernel, tables, step, period, w, states, i, j, s, s.law[0]
        ):
            changes += step_with_changes(kernel, tables, step, period, columns, w, states, i, j, s)
        i = j
    return changes


@jit
def integrate_periods(
    kernel: Any, tables: Any, period: float, columns: Any, width: Any, start: Any, keep: int, states: Any,
    orbit: Any, strobe: Any, s: Any,
) -> int:  # fmt: skip
    """Integrate ``len(strobe) − 1`` periods from ``start`` (2n,), which it moves; count changes of contact.

    Parameters
    ----------
    kernel, tables, period, columns, width, s : as in `over_period`
    keep : the last periods to keep in full
    states : (n_steps + 1, 2n, width) flat, memory
    orbit : (keep · n_steps + 1, 2n) flat
    strobe : (count + 1, 2n) states at the start of every period
    """
    rows, steps, w, count = len(start), len(tables.width), len(width), len(strobe) - 1
    first = count * 0  # a variable, not a literal, which is a type of its own and would compile the map again
    copy(start, np.uint64(0), strobe[0], np.uint64(0), rows)
    changes = 0
    for k in range(count):
        states[: rows * w] = 0.0
        for row in range(rows):
            states[row * w] = start[row]
        changes += over_period(kernel, tables, period, columns, width, states, first, s, LOCATED)
        for row in range(rows):
            start[row] = states[(steps * rows + row) * w]
        rebalance(kernel.balance, strobe[k], start, period)
        copy(start, np.uint64(0), strobe[k + 1], np.uint64(0), rows)
        slot = k - (count - keep)
        if slot >= 0:
            for x in range((steps + 1) * rows):
                orbit[slot * steps * rows + x] = states[x * w]
    return changes

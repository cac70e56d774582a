"""The map over one mesh period: the trajectory and, side by side, its derivative by the initial state."""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import UNCOUNTED, jit, jit_inner
from wearlab.dynamics.balance import rebalance
from wearlab.dynamics.steps.contact_change import step_with_changes
from wearlab.dynamics.steps.damping_law import step_by_law
from wearlab.dynamics.steps.exact import exact_pair
from wearlab.dynamics.steps.kernel import Propagated
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


@jit_inner(counted=False)
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
        step_of(kernel.structure, columns, w, states, i, j, s.mesh, s.load, tables.width[step] * period)
        if contact != PERMANENT and not contact_holds(
            kernel, tables, step, period, w, states, i, j, s, s.law[0]
        ):
            changes += step_with_changes(kernel, tables, step, period, columns, w, states, i, j, s)
        i = j
    return changes


@jit
def over_periods(
    kernel: Any, tables: Any, period: float, columns: Any, width: Any, states: Any, strobe: Any, s: Any,
    contact: int, balanced: bool,
) -> int:  # fmt: skip
    """Integrate ``len(strobe) − 1`` periods, the last of them kept; return the number of contact changes.

    Every road to an orbit calls this one, so that it compiles once.

    Parameters
    ----------
    kernel, tables, period, columns, width, s, contact : as in `over_period`
    states : (keep · n_steps + 1, 2n, width) flat, tangents of the first state given
    strobe : (count + 1, 2n) states at the start of every period, the first given
    balanced : a set free to turn is held at its mean speed after every period
    """
    rows, steps, w, count = strobe.shape[1], len(tables.width), len(width), len(strobe) - 1
    dropped, changes = count - len(states) // (rows * w) // steps, 0
    for k in range(count):
        first = max(0, k - dropped) * steps
        begin = first * rows * w
        end = begin + steps * rows * w
        for row in range(rows):
            states[begin + row * w] = strobe[k, row]
        changes += over_period(kernel, tables, period, columns, width, states, first, s, contact)
        for row in range(rows):
            strobe[k + 1, row] = states[end + row * w]
        if balanced:
            rebalance(kernel.balance, strobe[k], strobe[k + 1], period)
    return changes

"""The map over one mesh period: the trajectory and, side by side, its derivative by the initial state."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wearlab.compiled import by_type, jit
from wearlab.dynamics.rigid import rebalance
from wearlab.dynamics.steps import contact_change, damping_law, mesh_law, propagator, rk4
from wearlab.dynamics.steps.kernel import Propagated, Stepped, structure_of, write
from wearlab.dynamics.steps.mesh_law import NEXT, THIS

LOCATED, PERMANENT = 0, 1
"""Contact within a step: its changes located; or every pair in the path touches and pushes, whatever the
state."""


def _never(kernel: Any, step: int, w: Any, states: Any, i: Any, contact: Any) -> bool:
    return False


def _two(kernel: Any, step: int, w: Any, states: Any, i: Any, contact: Any) -> bool:
    if not kernel.structure.paired[step]:
        return False
    mesh_law.flank_law(kernel.flanks, step + 1, 0.0, 1.0, NEXT)
    mesh_law.channel_law(kernel.flanks, NEXT)
    rk4.fill_load(kernel, step + 1, w, NEXT)
    if not propagator.exact_pair(kernel, step, w, states, i):
        return False
    j = i + np.uint64(2 * len(kernel.structure.push)) * w
    return contact == PERMANENT or (
        mesh_law.contact_holds(kernel, step, w, states, i, j, THIS)
        and mesh_law.contact_holds(kernel, step + 1, w, states, j, j + j - i, NEXT)
    )


two_steps = by_type(lambda kernel, *rest: _two if structure_of(kernel) is Propagated else _never)
"""Advance two equal steps at once where the structure can and no contact changes; return whether."""


def over_period(kernel: Any, columns: Any, states: Any, first: Any, contact: int) -> int:
    """Advance state ``first`` over one mesh period, one state a step; return the number of contact changes.

    Parameters
    ----------
    kernel : the system
    columns : columns to advance (uint64): 1 for the trajectory alone
    states : flat (…, 2n, width); state ``first`` is read, the n_steps after it are written
    contact : `LOCATED`, or `PERMANENT`, the affine map of a loaded mesh
    """
    w = np.uint64(len(kernel.width))
    size = np.uint64(2 * len(kernel.structure.push)) * w
    i = np.uint64(first) * size
    changes, done = 0, 0
    for step in range(len(kernel.flanks.tables.width)):
        j = i + size
        parts = -1 if step >= done else 0
        if parts < 0 and contact == LOCATED:
            parts = damping_law.step_by_law(kernel.flanks.meshes.law, kernel, step, columns, w, states, i, j)
        if parts >= 0:
            changes += parts
            i = j
            continue
        if contact == PERMANENT:
            mesh_law.hold_all(kernel.flanks, step)
            mesh_law.flank_law(kernel.flanks, step, 0.0, 1.0, THIS)
        else:
            mesh_law.see_start(kernel, step, w, states, i)
        mesh_law.channel_law(kernel.flanks, THIS)
        rk4.fill_load(kernel, step, w, THIS)
        if two_steps(kernel, step, w, states, i, contact):
            done = step + 2
        else:
            rk4.step_of(kernel, step, columns, w, states, i, j)
            if contact != PERMANENT and not mesh_law.contact_holds(kernel, step, w, states, i, j, THIS):
                changes += contact_change.step_with_changes(kernel, step, columns, w, states, i, j)
        i = j
    return changes


STEPS: dict[type, Callable[..., Any]] = {}
"""The step of every method that moves a single state, by the type of its memory."""
single_step = by_type(lambda memory, *rest: STEPS[memory.instance_class], counted=True)
"""Advance a state (2n,) over one step of the tables by the method of the memory; count evaluations."""


def by_method(kernel: Any, columns: Any, states: Any, first: Any, contact: int) -> int:
    """Do what `over_period` does by the steps of a method; return the number of evaluations."""
    rows, evaluations = 2 * len(kernel.structure.push), 0
    for step in range(len(kernel.flanks.tables.width)):
        i = (first + step) * rows
        after = states[i + rows : i + 2 * rows]
        write(states[i : i + rows], after)
        evaluations += single_step(kernel.structure.work, kernel, step, after)
    return evaluations


one_period = by_type(lambda kernel, *rest: by_method if structure_of(kernel) is Stepped else over_period)
"""Advance a state over one mesh period."""


@jit
def over_periods(kernel: Any, columns: Any, states: Any, strobe: Any, contact: int, balanced: bool) -> int:
    """Integrate ``len(strobe) − 1`` periods, the last of them kept; return what `one_period` counts.

    Every road to an orbit calls this one, so that it compiles once.

    Parameters
    ----------
    kernel, columns, contact : as in `over_period`
    states : (keep · n_steps + 1, 2n, width) flat, tangents of the first state given
    strobe : (count + 1, 2n) states at the start of every period, the first given
    balanced : a set free to turn is held at its mean speed after every period
    """
    rows, steps = strobe.shape[1], len(kernel.flanks.tables.width)
    w, count = len(kernel.width), len(strobe) - 1
    dropped, counted = count - len(states) // (rows * w) // steps, 0
    for k in range(count):
        first = max(0, k - dropped) * steps
        begin = first * rows * w
        end = begin + steps * rows * w
        for row in range(rows):
            states[begin + row * w] = strobe[k, row]
        counted += one_period(kernel, columns, states, first, contact)
        for row in range(rows):
            strobe[k + 1, row] = states[end + row * w]
        if balanced:
            rebalance(kernel.balance, strobe[k], strobe[k + 1], kernel.flanks.period)
    return counted

"""The map over one mesh period: the trajectory and, side by side, its derivative by the initial state."""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import KERNEL, jit, jit_inner
from wearlab.dynamics.events import step_with_changes
from wearlab.dynamics.exact_step import exact_pair
from wearlab.dynamics.flanks import contact_differs, mesh_law, row_product, see_contact
from wearlab.dynamics.registers import END, MIDST, START
from wearlab.dynamics.rk4_step import rk4_step
from wearlab.dynamics.series_step import series_step
from wearlab.dynamics.structure import Propagated

LOCATED, TOUCHING, MIDDLE, TOUCHING_FIRST = 0, 1, 2, 3
"""Contact within a step: its changes located; every pair in the path, whatever the state; as in the middle of
the step, which is redone once (large systems; any other locates); the second once and then the third."""


@jit_inner(forceinline=True)
def deflection_at_start(
    kernel: Any, tables: Any, step: int, m: int, width: Any, states: Any, i: Any
) -> float:
    """Return δ of mesh ``m`` for the state at the start of ``step``."""
    n, w = len(kernel.structure.push), np.uint64(len(width))
    return row_product(kernel.structure.direction, m, n, states, i, w) - tables.error[step, 0, m]


@jit_inner(forceinline=True)
def contact_holds(
    kernel: Any, tables: Any, step: int, period: float, width: Any, states: Any, i: Any, j: Any, contact: Any
) -> bool:
    """Whether ``contact`` is right in the middle and at the end of the step from state ``i`` to ``j``.

    The middle is that of the cubic Hermite polynomial between both ends.
    """
    n, w = len(kernel.structure.push), np.uint64(len(width))
    d, below = kernel.structure.direction, np.uint64(n) * w
    eighth = 0.125 * tables.width[step] * period
    for m in range(len(kernel.mesh_damping)):
        before = row_product(d, m, n, states, i, w)
        after = row_product(d, m, n, states, j, w)
        bend = row_product(d, m, n, states, i + below, w) - row_product(d, m, n, states, j + below, w)
        if contact_differs(kernel, tables, step, after - tables.error[step, 2, m], m, END, contact):
            return False
        middle = 0.5 * (before + after) + eighth * bend - tables.error[step, 1, m]
        if contact_differs(kernel, tables, step, middle, m, MIDST, contact):
            return False
    return True


@jit_inner(forceinline=True)
def touch_all(kernel: Any, tables: Any, step: int, contact: Any) -> None:
    """Let every pair in the path touch and no back flank: the contact of a loaded mesh."""
    pairs = len(kernel.pairs)
    for m in range(len(kernel.mesh_damping)):
        for p in range(pairs):
            contact[m, p] = tables.stiffness[step, 1, m, p] > 0.0
        contact[m, pairs] = False


def by_pair(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, width: Any, states: Any, i: Any, s: Any,
    touch: Any,
) -> bool:  # fmt: skip
    """Advance two equal steps at once where the structure can and no contact changes; return whether."""
    raise NotImplementedError("compiled code only")


@overload(by_pair, jit_options=KERNEL, strict=False)
def _choose_pair(structure: Any, *rest: Any) -> Any:
    return _pair if structure.instance_class is Propagated else _never


def _never(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, width: Any, states: Any, i: Any, s: Any,
    touch: Any,
) -> bool:  # fmt: skip
    return False


def _pair(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, width: Any, states: Any, i: Any, s: Any,
    touch: Any,
) -> bool:  # fmt: skip
    if step + 1 == len(tables.width) or not structure.paired[step]:  # a section may end between equal steps
        return False
    size = np.uint64(2 * len(structure.push) * len(width))
    second, third = i + size, i + size + size
    mesh_law(kernel, tables, step + 1, period, s.contact, width, structure.second_mesh, structure.second_push)
    h = tables.width[step] * period
    if not exact_pair(structure, len(width), states, i, second, third, s.mesh, s.push, h):
        return False
    return touch == TOUCHING or (
        contact_holds(kernel, tables, step, period, width, states, i, second, s.contact)
        and contact_holds(kernel, tables, step + 1, period, width, states, second, third, s.contact)
    )


def redone(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> bool:  # fmt: skip
    """Redo a step with the contact of its middle where the structure can; return whether."""
    raise NotImplementedError("compiled code only")


@overload(redone, jit_options=KERNEL, strict=False)
def _choose_redone(structure: Any, *rest: Any) -> Any:
    return _redone if structure.instance_class is Propagated else _not_redone


def _not_redone(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> bool:  # fmt: skip
    return False


def _redone(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> bool:  # fmt: skip
    n, w = len(structure.push), np.uint64(len(width))
    d, below = structure.direction, np.uint64(n) * w
    h = tables.width[step] * period
    for m in range(len(kernel.mesh_damping)):
        between = 0.5 * (row_product(d, m, n, states, i, w) + row_product(d, m, n, states, j, w))
        bend = row_product(d, m, n, states, i + below, w) - row_product(d, m, n, states, j + below, w)
        middle = between + 0.125 * h * bend - tables.error[step, 1, m]
        see_contact(kernel, tables, step, middle, m, MIDST, s.contact)
    mesh_law(kernel, tables, step, period, s.contact, width, s.mesh, s.push)
    rk4_step(structure, kernel.channels, columns, width, states, i, states, j, s.mesh, s.push, h)
    return True


def cut_step(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> int:  # fmt: skip
    """Advance over a step that is cut at every change of contact; return their number."""
    raise NotImplementedError("compiled code only")


@overload(cut_step, jit_options=KERNEL, strict=False)
def _choose_cut(structure: Any, *rest: Any) -> Any:
    return series_step if structure.instance_class is Propagated else step_with_changes


@jit
def over_period(
    kernel: Any,
    tables: Any,
    period: float,
    columns: Any,
    width: Any,
    states: Any,
    first: Any,
    s: Any,
    touch: int,
) -> int:
    """Advance state ``first`` over one mesh period, one state a step; return the number of contact changes.

    Parameters
    ----------
    kernel : the system
    tables : the mesh at the stages
    period : duration of a mesh period [s]
    columns : columns to advance (uint64): 1 for the trajectory alone
    width : a tuple as long as a state has columns
    states : flat (…, 2n, width); state ``first`` is read, the n_steps after it are written
    s : scratch
    touch : `LOCATED`; `TOUCHING`, the affine map of a loaded mesh; or `MIDDLE`
    """
    size = np.uint64(2 * len(kernel.structure.push) * len(width))
    i = np.uint64(first) * size
    changes, done = 0, 0
    for step in range(len(tables.width)):
        j = i + size
        if step < done:
            i = j
            continue
        if touch == TOUCHING:
            touch_all(kernel, tables, step, s.contact)
        else:
            for m in range(len(kernel.mesh_damping)):
                delta = deflection_at_start(kernel, tables, step, m, width, states, i)
                see_contact(kernel, tables, step, delta, m, START, s.contact)
        mesh_law(kernel, tables, step, period, s.contact, width, s.mesh, s.push)
        h = tables.width[step] * period
        if by_pair(kernel.structure, kernel, tables, step, period, width, states, i, s, touch):
            done = step + 2
            i = j
            continue
        rk4_step(kernel.structure, kernel.channels, columns, width, states, i, states, j, s.mesh, s.push, h)
        if touch != TOUCHING and not contact_holds(
            kernel, tables, step, period, width, states, i, j, s.contact
        ):
            if touch == MIDDLE and redone(
                kernel.structure, kernel, tables, step, period, columns, width, states, i, j, s
            ):
                changes += 1
            else:
                changes += cut_step(
                    kernel.structure, kernel, tables, step, period, columns, width, states, i, j, s
                )
        i = j
    return changes

"""One step, or two equal ones, of a `Propagated` structure: exact but for forces that are polynomials.

The forces at the later stages depend on the deflections there, which depend on the forces: from a guess by
the state at the start, every round gains two orders where only stiffnesses differ from their means, and one
where damping does too.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.dense_step import times

ROUNDS = 3
OF_ONE, OF_TWO = np.int64(2), np.int64(4)
"""Stages after the first, of one step and of two."""
NO_RATES = np.bool_(False)
"""No deflection rates are needed; of fixed types all these, as numba would compile for literals once more."""


@jit_inner
def slot_of(length: Any, h: float) -> int:
    """Return which tabulated length a step has, −1: none."""
    for k in range(len(length)):
        if length[k] == h:
            return k
    return -1


def exact_step(
    structure: Any,
    meshes: Any,
    columns: Any,
    width: Any,
    source: Any,
    i: Any,
    target: Any,
    j: Any,
    mesh: Any,
    push: Any,
    h: Any,
) -> None:
    """Advance the state at ``source[i:]`` by time ``h`` into ``target[j:]``.

    Parameters
    ----------
    structure : `wearlab.dynamics.structure.Propagated`
    meshes : see `rk4_step`
    columns : how many columns to advance (uint64)
    width : as long as a state has columns
    source, i, target, j : flat arrays of states and offsets into them (uint64)
    mesh : (4, n_channel) flat, as for `rk4_step`
    push : (3, n_input) flat: inputs at the start, middle and end
    h : one of the tabulated lengths [s]
    """
    tables, n, w = structure.tables, len(structure.push), len(width)
    slot = slot_of(tables.length, h)
    inputs, senses = len(structure.force) // 5, len(structure.sense) // 8
    rates = damping_differs(tables, mesh)
    size, rows = np.uint64(2 * n * w), 3 * inputs
    old, new = source[i : i + size].reshape((2 * n, w)), target[j : j + size].reshape((2 * n, w))
    sensed = 4 * senses if rates else 2 * senses
    sense, feed, force = structure.sense[:sensed], structure.feed[:sensed], structure.force[:rows]
    times(tables.single.sense[slot][:sensed], old, sense)
    sense_start(structure, old, rates)
    for stage in range(3):
        guess_force(structure, stage, stage, mesh, push, rates)
    for _ in range(ROUNDS):
        times(tables.single.feed[slot][:sensed], force, feed)
        for stage in range(1, 3):
            correct_force(structure, stage, stage, OF_ONE, mesh, push, rates)
    advance(tables.single.transition[slot], tables.single.inputs[slot], old, force, structure.moved, new)


@jit_inner
def exact_pair(
    structure: Any, w: int, states: Any, i: Any, j: Any, k: Any, mesh: Any, push: Any, h: float
) -> bool:
    """Advance ``states[i:]`` over two equal steps of length ``h``, into ``states[j:]`` and ``states[k:]``.

    ``mesh`` and ``push`` are those of the first step; the structure holds those of the second. Return whether
    it was done: not where damping differs from that of the linear part.
    """
    tables, n = structure.tables, len(structure.push)
    slot = slot_of(tables.length, h)
    if slot < 0 or damping_differs(tables, mesh) or damping_differs(tables, structure.second_mesh):
        return False
    meshes, size = len(structure.sense) // 8, np.uint64(2 * n * w)
    old = states[i : i + size].reshape((2 * n, w))
    sense, feed, force = structure.sense[: 4 * meshes], structure.feed[: 4 * meshes], structure.force
    times(tables.double.sense[slot][: 4 * meshes], old, sense)
    sense_start(structure, old, NO_RATES)
    for stage in range(3):
        guess_force(structure, stage, stage, mesh, push, NO_RATES)
    for stage in range(1, 3):
        guess_force(structure, 2 + stage, stage, structure.second_mesh, structure.second_push, NO_RATES)
    for _ in range(ROUNDS):
        times(tables.double.feed[slot][: 4 * meshes], force, feed)
        for stage in range(1, 3):
            correct_force(structure, stage, stage, OF_TWO, mesh, push, NO_RATES)
            correct_force(
                structure, 2 + stage, stage, OF_TWO, structure.second_mesh, structure.second_push, NO_RATES
            )
    middle, end = states[j : j + size].reshape((2 * n, w)), states[k : k + size].reshape((2 * n, w))
    advance(
        tables.double.between[slot], tables.double.between_inputs[slot], old, force, structure.moved, middle
    )
    advance(tables.double.transition[slot], tables.double.inputs[slot], old, force, structure.moved, end)
    return True


@jit_inner
def advance(transition: Any, inputs: Any, old: Any, force: Any, moved: Any, new: Any) -> None:
    """Write ``transition @ old + inputs @ force`` into ``new``."""
    times(transition, old, new)
    times(inputs, force, moved)
    out, added = new.reshape(new.size), moved.reshape(moved.size)
    for x in range(np.uint64(0), np.uint64(len(out))):
        out[x] += added[x]


@jit_inner
def damping_differs(tables: Any, mesh: Any) -> bool:
    """Whether a mesh is damped otherwise than the linear part has it: its flanks have parted."""
    channels = len(tables.stiffness)
    for c in range(channels):
        if mesh[3 * channels + c] != tables.damping[c]:
            return True
    return False


@jit_inner
def sense_start(structure: Any, old: Any, rates: bool) -> None:
    """Write d·q of all meshes at the start, and d·q̇ where asked for, into the scratch that is free then."""
    n, meshes = len(structure.push), len(structure.sense) // 8
    direction = structure.direction[: meshes * n].reshape((meshes, n))
    times(direction, old[:n], structure.feed[:meshes])
    if rates:
        times(direction, old[n:], structure.feed[meshes : 2 * meshes])


@jit_inner
def guess_force(structure: Any, at: int, stage: int, mesh: Any, push: Any, rates: bool) -> None:
    """Fill the inputs number ``at``, from mesh and inputs of a stage and the deflections at the start."""
    tables, force = structure.tables, structure.force
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        row, m = force[at * inputs + c], c % meshes
        row[:] = 0.0
        add_scaled(row, tables.stiffness[c] - mesh[stage * channels + c], structure.feed[m])
        if rates:
            add_scaled(row, tables.damping[c] - mesh[3 * channels + c], structure.feed[meshes + m])
        row[0] += push[stage * inputs + c]
    for c in range(channels, inputs):
        force[at * inputs + c, 0] = push[stage * inputs + c]


@jit_inner
def correct_force(structure: Any, at: int, stage: int, later: int, mesh: Any, push: Any, rates: bool) -> None:
    """Fill the inputs number ``at`` from the deflections there; ``later``: stages after the first."""
    tables, force = structure.tables, structure.force
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        m = (at - 1) * meshes + c % meshes
        k = mesh[stage * channels + c] - tables.stiffness[c]
        row = force[at * inputs + c]
        set_scaled(row, -k, structure.sense[m], structure.feed[m])
        if rates:
            damp = mesh[3 * channels + c] - tables.damping[c]
            m += later * meshes
            add_scaled(row, -damp, structure.sense[m])
            add_scaled(row, -damp, structure.feed[m])
        row[0] += push[stage * inputs + c]


@jit_inner
def add_scaled(out: Any, factor: float, x: Any) -> None:
    """Add ``factor x`` to ``out``."""
    for col in range(np.uint64(0), np.uint64(len(out))):
        out[col] += factor * x[col]


@jit_inner
def set_scaled(out: Any, factor: float, x: Any, y: Any) -> None:
    """Write ``factor (x + y)`` into ``out``."""
    for col in range(np.uint64(0), np.uint64(len(out))):
        out[col] = factor * (x[col] + y[col])

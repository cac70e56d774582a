"""One step, or two equal ones, of a `Propagated` structure: exact but for forces that are polynomials.

The forces at the later stages depend on the deflections there, which depend on the forces: from a guess by
the state at the start, every round gains two orders where only stiffnesses differ from their means, and one
where damping does too.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.steps.kernel import times

ROUNDS, ROUNDS_WITH_RATES = 3, 5
SAME = 1e-9
"""Difference of a damping from that of the linear part, over it, that is rounding."""
OF_ONE, OF_TWO = np.int64(2), np.int64(4)
"""Stages after the first, of one step and of two."""


@jit_inner
def slot_of(length: Any, h: float) -> int:
    """Return which tabulated length a step has, −1: none."""
    for k in range(len(length)):
        if length[k] == h:
            return k
    return -1


def exact_step(
    structure: Any, columns: Any, w: Any, states: Any, i: Any, j: Any, mesh: Any, load: Any, h: Any
) -> None:
    """Advance the state at ``states[i:]`` by time ``h`` into ``states[j:]``.

    Parameters
    ----------
    structure : `wearlab.dynamics.steps.kernel.Propagated`
    columns, w, states, i, j, mesh : as in `wearlab.dynamics.steps.rk4.diagonal_step`; all columns
    load : (3, n_input) flat: inputs at the start, middle and end
    h : one of the tabulated lengths [s]
    """
    tables, n = structure.tables, len(structure.push)
    slot = slot_of(tables.length, h)
    inputs, meshes = len(structure.force) // 5, len(structure.sense) // 8
    rates = damping_differs(tables, mesh)
    size, rows = np.uint64(2 * n) * w, 3 * inputs
    old = states[i : i + size].reshape((np.uint64(2 * n), w))
    new = states[j : j + size].reshape((np.uint64(2 * n), w))
    sensed = 4 * meshes if rates else 2 * meshes
    sense, feed, force = structure.sense[:sensed], structure.feed[:sensed], structure.force[:rows]
    times(tables.single.sense[slot][:sensed], old, sense)
    sense_start(structure, old, rates)
    for stage in range(3):
        guess_force(structure, stage, stage, mesh, load, rates)
    for _ in range(ROUNDS_WITH_RATES if rates else ROUNDS):
        times(tables.single.feed[slot][:sensed], force, feed)
        for stage in range(1, 3):
            correct_force(structure, stage, stage, OF_ONE, mesh, load, rates)
    advance(tables.single.transition[slot], tables.single.inputs[slot], old, force, structure.moved, new)


@jit_inner
def exact_pair(
    structure: Any, w: Any, states: Any, i: Any, j: Any, k: Any, mesh: Any, load: Any, h: float
) -> bool:
    """Advance ``states[i:]`` over two equal steps of length ``h``, into ``states[j:]`` and ``states[k:]``.

    ``mesh`` and ``load`` are those of the first step; the structure holds those of the second. Return whether
    it was done: not for a length that is not tabulated.
    """
    tables, n, second = structure.tables, len(structure.push), structure.second_mesh
    slot = slot_of(tables.length, h)
    if slot < 0:
        return False
    rates = damping_differs(tables, mesh) or damping_differs(tables, second)
    meshes, size = len(structure.sense) // 8, np.uint64(2 * n) * w
    old = states[i : i + size].reshape((np.uint64(2 * n), w))
    sensed = 8 * meshes if rates else 4 * meshes
    sense, feed, force = structure.sense[:sensed], structure.feed[:sensed], structure.force
    times(tables.double.sense[slot][:sensed], old, sense)
    sense_start(structure, old, rates)
    for stage in range(3):
        guess_force(structure, stage, stage, mesh, load, rates)
    for stage in range(1, 3):
        guess_force(structure, 2 + stage, stage, second, structure.second_load, rates)
    for _ in range(ROUNDS_WITH_RATES if rates else ROUNDS):
        times(tables.double.feed[slot][:sensed], force, feed)
        for stage in range(1, 3):
            correct_force(structure, stage, stage, OF_TWO, mesh, load, rates)
            correct_force(structure, 2 + stage, stage, OF_TWO, second, structure.second_load, rates)
    middle = states[j : j + size].reshape((np.uint64(2 * n), w))
    end = states[k : k + size].reshape((np.uint64(2 * n), w))
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
    """Whether a mesh is damped otherwise than the linear part has it: a pair does not push, or flanks rub."""
    channels = len(tables.stiffness)
    for stage in range(3):
        for c in range(channels):
            if abs(mesh[(3 + stage) * channels + c] - tables.damping[c]) > SAME * (1.0 + tables.damping[c]):
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
def guess_force(structure: Any, at: int, stage: int, mesh: Any, load: Any, rates: bool) -> None:
    """Fill the inputs number ``at``, from mesh and inputs of a stage and the deflections at the start."""
    tables, force = structure.tables, structure.force
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        row, m = force[at * inputs + c], c % meshes
        row[:] = 0.0
        add_scaled(row, tables.stiffness[c] - mesh[stage * channels + c], structure.feed[m])
        if rates:
            add_scaled(row, tables.damping[c] - mesh[(3 + stage) * channels + c], structure.feed[meshes + m])
        row[0] += load[stage * inputs + c]
    for c in range(channels, inputs):
        force[at * inputs + c, 0] = load[stage * inputs + c]


@jit_inner
def correct_force(structure: Any, at: int, stage: int, later: int, mesh: Any, load: Any, rates: bool) -> None:
    """Fill the inputs number ``at`` from the deflections there; ``later``: stages after the first."""
    tables, force = structure.tables, structure.force
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        m = (at - 1) * meshes + c % meshes
        k = mesh[stage * channels + c] - tables.stiffness[c]
        row = force[at * inputs + c]
        set_scaled(row, -k, structure.sense[m], structure.feed[m])
        if rates:
            damp = mesh[(3 + stage) * channels + c] - tables.damping[c]
            m += later * meshes
            add_scaled(row, -damp, structure.sense[m])
            add_scaled(row, -damp, structure.feed[m])
        row[0] += load[stage * inputs + c]


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

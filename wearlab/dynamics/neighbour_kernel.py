"""What groups of steps answer, and corrections over a period; see `wearlab.dynamics.neighbour`."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.collocation_kernel import (
    add,
    fill,
    inputs_at_stages,
    largest_of,
    padded,
    path_over_groups,
    place,
    places_of,
    scratch_of,
)
from wearlab.dynamics.elimination import eliminate
from wearlab.dynamics.registers import write


@jit_inner
def answers_of_group(
    tables: Any, group: Any, direction: Any, inputs: Any, moving: int, work: Any, by_state: Any,
    by_input: Any,
) -> None:  # fmt: skip
    """Fill the answers of one group, see `answers_of_groups`."""
    (first, steps, begin), (meshes, n) = group, direction.shape
    count, given = inputs.load.shape[2], by_state.shape[1]
    states, rows, stages = 2 * n, 2 * steps * meshes, 2 * steps + 1
    at_effect, at_sense, at_feed, at_end = places_of(begin, steps, states, count, meshes)
    transition = tables[begin:at_effect].reshape((steps * states, states))
    effect = tables[at_effect:at_sense].reshape((steps * states, stages * count))
    sense = tables[at_sense:at_feed].reshape((states, rows))
    feed = tables[at_feed:at_end].reshape((stages * count, rows))
    unknowns = padded(rows)
    columns = given + stages * moving
    matrix = work[: unknowns * (unknowns + columns)].reshape((unknowns + columns, unknowns))
    law, push = scratch_of(direction, inputs, rows)
    fill(sense, feed, direction, inputs, first, law, push, matrix)
    for stage in range(stages):
        for a in range(moving):
            write(feed[stage * count + a], matrix[unknowns + given + stage * moving + a])
    eliminate(matrix)
    entering = np.empty((stages * count, columns))
    inputs_at_stages(direction, law, push, matrix[unknowns:], rows, entering)
    for stage in range(stages):
        for a in range(moving):
            entering[stage * count + a, given + stage * moving + a] += 1.0
    last = len(effect) - states
    end = np.dot(effect[last:], entering)
    by_state[:, :], by_input[:, :] = 0.0, 0.0
    for row in range(states):
        add(end[row], transition[last + row], 1.0)
        write(end[row, :given], by_state[row])
        write(end[row, given:], by_input[row])
    for row in range(rows):
        for col in range(given):
            by_state[states + row, col] = matrix[unknowns + col, row]
        for col in range(stages * moving):
            by_input[states + row, col] = matrix[unknowns + given + col, row]


@jit
def answers_of_groups(
    tables: Any, groups: Any, direction: Any, inputs: Any, moving: int, by_state: Any, by_input: Any
) -> None:
    """Fill what end and stages of every group answer to its start and to additional inputs.

    Parameters
    ----------
    moving : the first inputs, which may be added to
    by_state : (n_groups, 2n + most stages · n_mesh, 2n + 1 + n_balance) end, and d·q at all stages but the
        first, by start, tables and loads of size one
    by_input : (n_groups, …, most stages · moving) the same by additional inputs at all stages
    """
    unknowns = padded(2 * groups[:, 1].max() * len(direction))
    work = np.empty(unknowns * (unknowns + by_state.shape[2] + by_input.shape[2]))
    for at in range(len(groups)):
        answers_of_group(tables, groups[at], direction, inputs, moving, work, by_state[at], by_input[at])


@jit
def correct(
    inputs: Any, known: Any, first: Any, stages: Any, direction: Any, by_state: Any, by_input: Any,
    inverse: Any, held: Any, limits: Any, law: Any, starts: Any, felt: Any, sizes: Any,
) -> int:  # fmt: skip
    """Correct a solution for other inputs; return how many times, 0 where corrections do not contract.

    What is left after a correction is what the inputs then missing would add, at the rate of the last ones.

    Parameters
    ----------
    inputs, known : those of other tables, and of the solved case
    first, stages : (n_groups,) first step and number of stages
    by_state, by_input : answers of all groups
    inverse, held : of ``I − P``, where loads take the columns of the held coordinates
    limits : most corrections, ratio of two in a row, size of what may be left over that of d·q
    law : (n_groups, most stages, n_channel) filled with the change of the law
    starts, felt, sizes : states at the groups' starts, d·q at all stages, sizes of loads: corrected
    """
    most, shrinks, left = limits
    rows = starts.shape[1]
    push, added = np.empty_like(law), np.empty((len(felt), by_input.shape[2]))
    answer, end, given = np.empty(by_state.shape[:2]), np.empty(rows), np.zeros(by_state.shape[2])
    steps, more = np.empty_like(starts), np.empty_like(felt)
    changes(inputs, known, first, stages, law, push)
    largest = added_inputs(inputs, law, push, felt, added)
    for count in range(1, most + 1):
        end_of_period(by_state, by_input, added, answer, end)
        np.dot(inverse, end, given[:rows])
        given[rows] = 0.0
        for x in range(len(held)):
            given[rows + 1 + x] = given[held[x]]
            given[held[x]] = 0.0
        add(sizes, given[rows + 1 :], 1.0)
        over_period(by_state, direction, given, answer, steps, more)
        add_all(starts, steps)
        add_all(felt, more)
        before = largest
        largest = added_inputs(inputs, law, None, more, added)
        if not largest <= shrinks * before:
            return 0
        if largest * largest_of(more) <= left * before * largest_of(felt):
            return count
    return 0


@jit_inner
def add_all(out: Any, given: Any) -> None:
    """Add the entries of a table to those of another."""
    add(out.reshape(out.size), given.reshape(given.size), 1.0)


@jit
def changes(inputs: Any, known: Any, first: Any, stages: Any, law: Any, push: Any) -> None:
    """Fill the changes of law and push of all channels at all stages, (n_groups, most stages, n_channel)."""
    law[:], push[:] = 0.0, 0.0
    for at in range(len(first)):
        for stage in range(stages[at]):
            step, where = place(first[at], stage, stages[at] - 1)
            for c in range(law.shape[2]):
                law[at, stage, c] = inputs.law[step, where, c] - known.law[step, where, c]
                push[at, stage, c] = inputs.push[step, where, c] - known.push[step, where, c]


@jit
def added_inputs(inputs: Any, law: Any, push: Any, felt: Any, added: Any) -> float:
    """Fill the inputs by which other tables differ, ``shares (push − law d·q)``, and return the largest.

    ``push`` None: 0; ``added`` (n_groups, most stages · moving).
    """
    groups, stages = law.shape[:2]
    moving, meshes, largest = added.shape[1] // stages, felt.shape[2], 0.0
    added[:, :] = 0.0
    for at in range(groups):
        for stage in range(stages):
            for x in range(len(inputs.share)):
                channel = inputs.of[x]
                force = -law[at, stage, channel] * felt[at, stage, channel % meshes]
                if push is not None:
                    force += push[at, stage, channel]
                added[at, stage * moving + inputs.to[x]] += inputs.share[x] * force
        for x in range(added.shape[1]):
            largest = max(largest, abs(added[at, x]))
    return largest


@jit
def end_of_period(by_state: Any, by_input: Any, added: Any, answer: Any, end: Any) -> None:
    """Fill the answers of all groups to added inputs alone, and what they add to the end of the period.

    ``answer`` (n_groups, 2n + …), ``end`` (2n,).
    """
    rows = len(end)
    given, carried = np.zeros(by_state.shape[2]), np.empty(rows)
    for at in range(len(by_state)):
        np.dot(by_input[at], added[at], answer[at])
        np.dot(by_state[at, :rows], given, carried)
        for row in range(rows):
            given[row] = carried[row] + answer[at, row]
    write(given[:rows], end)


@jit
def over_period(by_state: Any, direction: Any, given: Any, answer: Any, starts: Any, felt: Any) -> None:
    """Carry a start over all groups: fill their starts and d·q at all stages.

    Parameters
    ----------
    given : (2n + 1 + n_balance,) the start, 1 or 0 with or without the tables, sizes of loads; overwritten
    answer : (n_groups, 2n + …) what is added to every group; overwritten
    starts : (n_groups + 1, 2n)
    felt : (n_groups, most stages, n_mesh)
    """
    rows, (stages, meshes) = starts.shape[1], felt.shape[1:]
    n = direction.shape[1]
    carried = np.empty(by_state.shape[1])
    write(given[:rows], starts[0])
    for at in range(len(by_state)):
        for m in range(meshes):
            total = 0.0
            for col in range(n):
                total += direction[m, col] * given[col]
            felt[at, 0, m] = total
        np.dot(by_state[at], given, carried)
        for row in range(len(carried)):
            carried[row] += answer[at, row]
        write(carried[:rows], given)
        write(carried[:rows], starts[at + 1])
        for stage in range(stages - 1):
            for m in range(meshes):
                felt[at, stage + 1, m] = carried[rows + stage * meshes + m]


@jit
def path_of(cut: Any, inputs: Any, stages: Any, starts: Any, felt: Any, sizes: Any, states: Any) -> None:
    """Fill ``states`` (n_steps + 1, 2n) from the groups' starts and d·q at all stages."""
    load, meshes, groups = inputs.load, felt.shape[2], cut.groups
    count = load.shape[2]
    entering = np.empty((len(felt), felt.shape[1] * count))
    for at in range(len(groups)):
        for stage in range(stages[at]):
            step, where = place(groups[at, 0], stage, stages[at] - 1)
            here, now = step if len(load) > 1 else 0, where if load.shape[1] > 1 else 0
            for a in range(count):
                total = load[here, now, a, 0]
                for x in range(len(sizes)):
                    total += load[here, now, a, 1 + x] * sizes[x]
                entering[at, stage * count + a] = total
            for x in range(len(inputs.share)):
                channel = inputs.of[x]
                force = inputs.push[step, where, channel]
                force -= inputs.law[step, where, channel] * felt[at, stage, channel % meshes]
                entering[at, stage * count + inputs.to[x]] += inputs.share[x] * force
    path_over_groups(cut.tables, groups, meshes, count, starts, entering, states)


@jit
def resembles(table: Any, other: Any, limit: float) -> bool:
    """Whether no entry of two tables (n_steps, 3, n_mesh, n_pairs) differs by more than ``limit``."""
    for step in range(len(table)):
        for stage in range(table.shape[1]):
            for m in range(table.shape[2]):
                for p in range(table.shape[3]):
                    if not abs(table[step, stage, m, p] - other[step, stage, m, p]) <= limit:
                        return False
    return True

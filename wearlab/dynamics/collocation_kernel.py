"""Stages of groups of steps solved for, and the states that follow; see `wearlab.dynamics.collocation`."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner, jit_inner_apart
from wearlab.dynamics.collocation_inputs import at_stage
from wearlab.dynamics.elimination import WIDTH, eliminate


@jit
def part_at_jumps(table: Any, limit: float, joined: Any) -> None:
    """Unmark in ``joined`` (n_steps − 1,) where a table (n_steps, 3, n_mesh, n_pairs) jumps by more."""
    for step in range(len(joined)):
        for m in range(table.shape[2]):
            for p in range(table.shape[3]):
                if abs(table[step + 1, 0, m, p] - table[step, 2, m, p]) > limit:
                    joined[step] = False


@jit_inner
def padded(rows: int) -> int:
    """Return the unknowns of a group, filled up to a multiple of `WIDTH`."""
    return (rows + WIDTH - 1) // WIDTH * WIDTH


@jit_inner
def place(first: int, stage: int, stages: int) -> tuple[int, int]:
    """Return step and stage in the tables of a stage of a group; ``stages``: those after the first."""
    return (first + stage // 2, stage % 2) if stage < stages else (first + stage // 2 - 1, 2)


@jit_inner
def fill(sense: Any, feed: Any, direction: Any, inputs: Any, first: int, matrix: Any) -> None:
    """Write ``(1 + feed law) X = (sense − feed_0 law_0 d, feed push)`` of one group into ``matrix``.

    Columns lie one after another, (columns, padded rows), as in ``sense`` (2n, rows) and ``feed``
    (stages n_in, rows).
    """
    states, rows = sense.shape
    (meshes, n), count = direction.shape, inputs.load.shape[2]
    stages, begin = rows // meshes, matrix.shape[1]
    law, push = np.empty((count, meshes)), np.empty(inputs.load.shape[2:])
    matrix[:, :] = 0.0
    for row in range(begin):
        matrix[row, row] = 1.0
    matrix[begin : begin + states, :rows] = sense
    for stage in range(stages + 1):
        step, at = place(first, stage, stages)
        at_stage(inputs, step, at, law, push)
        for a in range(count):
            fed = feed[stage * count + a]
            for x in range(push.shape[1]):
                add(matrix[begin + states + x], fed, push[a, x])
            for m in range(meshes):
                value = law[a, m]
                if value != 0.0 and stage > 0:
                    add(matrix[(stage - 1) * meshes + m], fed, value)
                elif value != 0.0:
                    for col in range(n):
                        add(matrix[begin + col], fed, -value * direction[m, col])


@jit_inner
def add(out: Any, given: Any, factor: float) -> None:
    """Add a multiple of ``given`` to the first entries of ``out``."""
    if factor != 0.0:
        for row in range(np.uint64(0), np.uint64(len(given))):
            out[row] += factor * given[row]


@jit_inner
def inputs_at_stages(direction: Any, inputs: Any, first: int, found: Any, rows: int, out: Any) -> None:
    """Write the inputs at all stages of a group by its start, (stages n_in, columns).

    ``found``: (columns, padded rows) d·q at all stages but the first, ``rows`` of them.
    """
    (meshes, n), count, columns = direction.shape, inputs.load.shape[2], len(found)
    law, push, stages = np.empty((count, meshes)), np.empty(inputs.load.shape[2:]), rows // meshes
    for stage in range(stages + 1):
        step, at = place(first, stage, stages)
        at_stage(inputs, step, at, law, push)
        for a in range(count):
            row = out[stage * count + a]
            row[:] = 0.0
            for x in range(push.shape[1]):
                row[2 * n + x] = push[a, x]
            for m in range(meshes):
                value = law[a, m]
                if value != 0.0:
                    if stage > 0:
                        felt = found[:, (stage - 1) * meshes + m]
                        for col in range(columns):
                            row[col] -= value * felt[col]
                    else:
                        for col in range(n):
                            row[col] -= value * direction[m, col]


@jit_inner_apart
def over_group(
    transition: Any, effect: Any, sense: Any, feed: Any, direction: Any, inputs: Any, first: int, work: Any,
    stages: Any, one: Any,
) -> None:  # fmt: skip
    """Find the map over one group, ``one`` (2n, columns), and its stages' inputs."""
    states, rows = sense.shape
    unknowns, columns = padded(rows), one.shape[1]
    matrix = work[: unknowns * (unknowns + columns)].reshape((unknowns + columns, unknowns))
    fill(sense, feed, direction, inputs, first, matrix)
    eliminate(matrix)
    by_start = stages[: effect.shape[1]]
    inputs_at_stages(direction, inputs, first, matrix[unknowns:], rows, by_start)
    last = len(effect) - states
    np.dot(effect[last:], by_start, one)
    one[:, :states] += transition[last:]


@jit
def over_groups(
    groups: Any, first: Any, size: Any, slot: Any, direction: Any, inputs: Any, stages: Any, maps: Any,
    whole: Any,
) -> None:  # fmt: skip
    """Find the maps over all groups.

    Parameters
    ----------
    stages : (n_groups, most inputs, columns) filled with the inputs at the stages
    maps : (n_groups, 2n, columns) filled with the map over each group
    whole : (2n, columns) filled with the map over all
    """
    four, two, one = groups
    states, columns = whole.shape
    unknowns = padded(four.sense.shape[2])
    work = np.empty(unknowns * (unknowns + columns))
    whole[:, :] = 0.0
    for row in range(states):
        whole[row, row] = 1.0
    for at in range(len(first)):
        x, step = slot[at], maps[at]
        group = four if size[at] == 0 else (two if size[at] == 1 else one)
        over_group(
            group.transition[x], group.effect[x], group.sense[x], group.feed[x], direction, inputs, first[at],
            work, stages[at], step,
        )  # fmt: skip
        carried = np.dot(np.ascontiguousarray(step[:, :states]), whole)
        carried[:, states:] += step[:, states:]
        whole[:, :] = carried


@jit
def starts_of_groups(maps: Any, stages: Any, given: Any, starts: Any, inputs: Any) -> None:
    """Fill the state at the start of every group, and the inputs at its stages.

    Parameters
    ----------
    maps, stages : as `over_groups` fills them
    given : (columns,) start of the first group, 1, and the sizes of loads; left as at the end of the last
    starts : (n_groups + 1, 2n)
    inputs : (n_groups, most inputs)
    """
    rows = starts.shape[1]
    starts[0] = given[:rows]
    for at in range(len(maps)):
        np.dot(stages[at], given, inputs[at])
        np.dot(maps[at], given, starts[at + 1])
        given[:rows] = starts[at + 1]


@jit
def path_over_groups(
    groups: Any, first: Any, size: Any, slot: Any, starts: Any, inputs: Any, states: Any
) -> None:
    """Fill ``states`` (n_steps + 1, 2n) from the groups' starts and inputs, groups alike in one product."""
    four, two, one = groups
    rows, begin = states.shape[1], 0
    states[0] = starts[0]
    while begin < len(first):
        end = begin + 1
        while end < len(first) and slot[end] == slot[begin] and size[end] == size[begin]:
            end += 1
        x = slot[begin]
        group = four if size[begin] == 0 else (two if size[begin] == 1 else one)
        effect = group.effect[x]
        pushed = np.ascontiguousarray(inputs[begin:end, : effect.shape[1]])
        moved = np.dot(starts[begin:end], group.transition[x].T)
        moved += np.dot(pushed, effect.T)
        steps = len(effect) // rows
        low, count = first[begin] + 1, (end - begin) * steps
        states[low : low + count] = moved.reshape((count, rows))
        begin = end

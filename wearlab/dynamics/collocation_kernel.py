"""Stages of groups of steps solved for, and the states that follow; see `wearlab.dynamics.collocation`."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner, jit_inner_apart


@jit_inner
def eliminate(matrix: Any, rows: int) -> None:
    """Solve ``A X = B`` by elimination with row pivots, ``matrix`` (rows, …) = (A, B); X takes B's place."""
    total = np.uint64(matrix.shape[1])
    for k in range(rows):
        pivot = k
        for row in range(k + 1, rows):
            if abs(matrix[row, k]) > abs(matrix[pivot, k]):
                pivot = row
        if pivot != k:
            for col in range(np.uint64(k), total):
                matrix[k, col], matrix[pivot, col] = matrix[pivot, col], matrix[k, col]
        upper = matrix[k]
        inverse = 1.0 / upper[k]
        for row in range(k + 1, rows):
            lower = matrix[row]
            factor = lower[k] * inverse
            for col in range(np.uint64(k + 1), total):
                lower[col] -= factor * upper[col]
    for k in range(rows - 1, -1, -1):
        upper = matrix[k]
        inverse = 1.0 / upper[k]
        for col in range(np.uint64(rows), total):
            upper[col] *= inverse
        for row in range(k):
            lower = matrix[row]
            factor = lower[k]
            for col in range(np.uint64(rows), total):
                lower[col] -= factor * upper[col]


@jit_inner
def place(first: int, stage: int, stages: int) -> tuple[int, int]:
    """Return step and stage in the tables of a stage of a group; ``stages``: those after the first."""
    return (first + stage // 2, stage % 2) if stage < stages else (first + stage // 2 - 1, 2)


@jit_inner
def fill(sense: Any, feed: Any, direction: Any, law: Any, push: Any, first: int, matrix: Any) -> None:
    """Write ``(1 + feed law) X = (sense − feed_0 law_0 d, feed push)`` of one group into ``matrix``."""
    rows, states, meshes, inputs = len(sense), sense.shape[1], law.shape[3], law.shape[2]
    stages, n = rows // meshes, direction.shape[1]
    for row in range(rows):
        out = matrix[row]
        out[:] = 0.0
        out[row] = 1.0
        out[rows : rows + states] = sense[row]
    for stage in range(stages + 1):
        step, at = place(first, stage, stages)
        for a in range(inputs):
            by = stage * inputs + a
            for x in range(push.shape[3]):
                add_column(matrix, rows + states + x, feed, by, push[step, at, a, x])
            for m in range(meshes):
                value = law[step, at, a, m]
                if value != 0.0 and stage > 0:
                    add_column(matrix, (stage - 1) * meshes + m, feed, by, value)
                elif value != 0.0:
                    for col in range(n):
                        add_column(matrix, rows + col, feed, by, -value * direction[m, col])


@jit_inner
def add_column(out: Any, to: int, given: Any, source: int, factor: float) -> None:
    """Add a multiple of a column of ``given`` to a column of ``out``."""
    if factor != 0.0:
        for row in range(len(given)):
            out[row, to] += factor * given[row, source]


@jit_inner
def inputs_at_stages(direction: Any, law: Any, push: Any, first: int, found: Any, out: Any) -> None:
    """Write the inputs ``u = push − law d·q`` at all stages of a group by its start, (stages n_in, columns).

    ``found``: (rows, columns) d·q at all stages but the first.
    """
    rows, columns = found.shape
    meshes, inputs, n = law.shape[3], law.shape[2], direction.shape[1]
    stages = rows // meshes
    for stage in range(stages + 1):
        step, at = place(first, stage, stages)
        for a in range(inputs):
            row = out[stage * inputs + a]
            row[:] = 0.0
            for x in range(push.shape[3]):
                row[2 * n + x] = push[step, at, a, x]
            for m in range(meshes):
                value = law[step, at, a, m]
                if value != 0.0:
                    if stage > 0:
                        felt = found[(stage - 1) * meshes + m]
                        for col in range(np.uint64(0), np.uint64(columns)):
                            row[col] -= value * felt[col]
                    else:
                        for col in range(n):
                            row[col] -= value * direction[m, col]


@jit_inner_apart
def over_group(
    transition: Any, effect: Any, sense: Any, feed: Any, direction: Any, inputs: Any, first: int, work: Any,
    stages: Any, whole: Any,
) -> None:  # fmt: skip
    """Carry the map so far, ``whole`` (2n, columns), over one group; keep its stages' inputs."""
    rows, states = sense.shape
    columns = whole.shape[1]
    matrix = work[: rows * (rows + columns)].reshape((rows, rows + columns))
    fill(sense, feed, direction, inputs.law, inputs.push, first, matrix)
    eliminate(matrix, rows)
    by_start = stages[: effect.shape[1]]
    inputs_at_stages(direction, inputs.law, inputs.push, first, matrix[:, rows:], by_start)
    last = len(effect) - states
    one = np.dot(effect[last:], by_start)
    one[:, :states] += transition[last:]
    carried = np.dot(np.ascontiguousarray(one[:, :states]), whole)
    carried[:, states:] += one[:, states:]
    whole[:, :] = carried


@jit
def over_groups(
    groups: Any, first: Any, size: Any, slot: Any, direction: Any, inputs: Any, stages: Any, whole: Any
) -> None:
    """Fill ``whole`` (2n, columns) with the map over all groups, and ``stages`` with their inputs."""
    four, two, one = groups
    rows = four.sense.shape[1]
    work = np.empty(rows * (rows + whole.shape[1]))
    whole[:, :] = 0.0
    for row in range(len(whole)):
        whole[row, row] = 1.0
    for at in range(len(first)):
        x = slot[at]
        group = four if size[at] == 0 else (two if size[at] == 1 else one)
        over_group(
            group.transition[x], group.effect[x], group.sense[x], group.feed[x], direction, inputs, first[at],
            work, stages[at], whole,
        )  # fmt: skip


@jit
def path_over_groups(
    groups: Any, first: Any, size: Any, slot: Any, stages: Any, constant: Any, states: Any
) -> None:
    """Fill ``states`` (n_steps + 1, 2n) from its first row; ``constant``: 1 and the sizes of loads."""
    four, two, one = groups
    rows = states.shape[1]
    given = np.empty(rows + len(constant))
    given[rows:] = constant
    for at in range(len(first)):
        x, begin = slot[at], first[at]
        group = four if size[at] == 0 else (two if size[at] == 1 else one)
        effect = group.effect[x]
        given[:rows] = states[begin]
        pushed = np.dot(stages[at, : effect.shape[1]], given)
        steps = len(effect) // rows
        moved = np.dot(group.transition[x], states[begin]) + np.dot(effect, pushed)
        for step in range(steps):
            states[begin + 1 + step] = moved[step * rows : (step + 1) * rows]

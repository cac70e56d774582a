"""Stages of groups of steps solved for, and the states that follow; see `wearlab.dynamics.collocation`."""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.collocation_inputs import at_stage
from wearlab.dynamics.elimination import WIDTH, eliminate
from wearlab.dynamics.registers import write

SMOOTH = 1e-9
"""Jump between two steps, over the largest value, up to which it is rounding."""


@jit
def part_at_jumps(table: Any, joined: Any) -> None:
    """Unmark in ``joined`` (n_steps − 1,) where a table (n_steps, 3, n_mesh, n_pairs) jumps."""
    limit = SMOOTH * largest_of(table)
    for step in range(len(joined)):
        for m in range(table.shape[2]):
            for p in range(table.shape[3]):
                if abs(table[step + 1, 0, m, p] - table[step, 2, m, p]) > limit:
                    joined[step] = False


@jit_inner
def largest_of(table: Any) -> float:
    """Return the largest modulus in a table of any axes, NaN where one is.

    Without their signs numbers are ordered as their bits are, NaN last: integers are compared many at once.
    """
    most, bits, modulus = np.int64(0), table.reshape(table.size).view(np.int64), np.int64(2**63 - 1)
    for x in range(np.uint64(0), np.uint64(len(bits))):
        most = max(most, bits[x] & modulus)
    largest = np.int64(most)
    return largest.view(np.float64)


@jit
def join(width: Any, stiffness: Any, gap: Any, joined: Any) -> None:
    """Mark in ``joined`` (n_steps − 1,) where steps are equally long and neither stiffness nor gap jumps."""
    for step in range(len(joined)):
        joined[step] = width[step] == width[step + 1]
    part_at_jumps(stiffness, joined)
    part_at_jumps(gap, joined)


SMALL = 4000
"""Multiplications up to which a product is written out: a call of the library takes as long."""


@jit_inner
def product(a: Any, b: Any, out: Any) -> None:
    """Write ``a @ b`` into ``out``, all of two axes."""
    rows, inner = a.shape
    columns = b.shape[1]
    if rows * inner * columns > SMALL:
        np.dot(a, b, out)
        return
    for row in range(rows):
        for col in range(columns):
            out[row, col] = 0.0
        for at in range(0, inner - 3, 4):
            p, q, r, s = a[row, at], a[row, at + 1], a[row, at + 2], a[row, at + 3]
            for col in range(np.uint64(0), np.uint64(columns)):
                out[row, col] += p * b[at, col] + q * b[at + 1, col] + r * b[at + 2, col] + s * b[at + 3, col]
        for at in range(inner - inner % 4, inner):
            factor = a[row, at]
            for col in range(np.uint64(0), np.uint64(columns)):
                out[row, col] += factor * b[at, col]


@jit_inner
def applied(a: Any, x: Any, out: Any) -> None:
    """Write ``a @ x`` into ``out`` (rows,)."""
    rows, inner = a.shape
    if rows * inner > SMALL:
        np.dot(a, x, out)
        return
    for row in range(rows):
        total = 0.0
        for at in range(inner):
            total += a[row, at] * x[at]
        out[row] = total


@jit_inner
def padded(rows: int) -> int:
    """Return the unknowns of a group, filled up to a multiple of `WIDTH`."""
    return (rows + WIDTH - 1) // WIDTH * WIDTH


@jit_inner(forceinline=True)
def place(first: int, stage: int, stages: int) -> tuple[int, int]:
    """Return step and stage in the tables of a stage of a group; ``stages``: those after the first."""
    return (first + stage // 2, stage % 2) if stage < stages else (first + stage // 2 - 1, 2)


@jit_inner
def scratch_of(direction: Any, inputs: Any, rows: int) -> tuple[Any, Any]:
    """Return room for `at_stage` of all stages of a group."""
    stages, (count, loads) = rows // len(direction) + 1, inputs.load.shape[2:]
    return np.empty((stages, count, len(direction))), np.empty((stages, count, loads))


@jit_inner
def fill(
    sense: Any, feed: Any, direction: Any, inputs: Any, first: int, law: Any, push: Any, matrix: Any
) -> None:
    """Write ``(1 + feed law) X = (sense − feed_0 law_0 d, feed push)`` of one group into ``matrix``.

    Columns lie one after another, (columns, padded rows), as in ``sense`` (2n, rows) and ``feed``
    (stages n_in, rows). ``law``, ``push``: filled with `at_stage` of all stages, which come first.
    """
    states, rows = sense.shape
    (meshes, n), count = direction.shape, inputs.load.shape[2]
    stages, begin = rows // meshes, matrix.shape[1]
    matrix[:, :] = 0.0
    for row in range(begin):
        matrix[row, row] = 1.0
    for state in range(states):
        write(sense[state], matrix[begin + state])
    for stage in range(stages + 1):
        step, at = place(first, stage, stages)
        at_stage(inputs, step, at, law[stage], push[stage])
        for a in range(count):
            fed = feed[stage * count + a]
            for x in range(push.shape[2]):
                add(matrix[begin + states + x], fed, push[stage, a, x])
            for m in range(meshes):
                value = law[stage, a, m]
                if value != 0.0 and stage > 0:
                    add(matrix[(stage - 1) * meshes + m], fed, value)
                elif value != 0.0:
                    for col in range(n):
                        add(matrix[begin + col], fed, -value * direction[m, col])


@jit_inner(forceinline=True)
def add(out: Any, given: Any, factor: float) -> None:
    """Add a multiple of ``given`` to the first entries of ``out``."""
    if factor != 0.0:
        for row in range(np.uint64(0), np.uint64(len(given))):
            out[row] += factor * given[row]


@jit_inner
def inputs_at_stages(direction: Any, law: Any, push: Any, seen: Any, rows: int, out: Any) -> None:
    """Write the inputs at all stages of a group by its start, (stages n_in, columns).

    ``seen``: (columns, padded rows) d·q at all stages but the first, ``rows`` of them.
    """
    (meshes, n), count, columns = direction.shape, law.shape[1], len(seen)
    for stage in range(rows // meshes + 1):
        for a in range(count):
            row = out[stage * count + a]
            row[:] = 0.0
            for x in range(push.shape[2]):
                row[2 * n + x] = push[stage, a, x]
            for m in range(meshes):
                value = law[stage, a, m]
                if value != 0.0:
                    if stage > 0:
                        felt = (stage - 1) * meshes + m
                        for col in range(columns):
                            row[col] -= value * seen[col, felt]
                    else:
                        for col in range(n):
                            row[col] -= value * direction[m, col]


@jit_inner
def places_of(begin: int, steps: int, states: int, inputs: int, meshes: int) -> tuple[int, int, int, int]:
    """Return where effect, sense and feed of a group begin in the tables, and where the last ends.

    ``begin``: where its transition does; see `wearlab.dynamics.collocation.Group` for their shapes.
    """
    effect = begin + steps * states * states
    sense = effect + steps * states * (2 * steps + 1) * inputs
    feed = sense + states * 2 * steps * meshes
    return effect, sense, feed, feed + (2 * steps + 1) * inputs * 2 * steps * meshes


@jit_inner
def over_group(
    tables: Any, group: Any, direction: Any, inputs: Any, work: Any, law: Any, push: Any, stages: Any,
    affine: Any,
) -> None:  # fmt: skip
    """Find the map over one group, ``affine`` (2n, columns), and its stages' inputs."""
    (first, steps, begin), states, count = group, len(affine), inputs.load.shape[2]
    rows, ends = 2 * steps * len(direction), steps * states
    at_effect, at_sense, at_feed, end = places_of(begin, steps, states, count, len(direction))
    transition = tables[begin:at_effect].reshape((ends, states))
    effect = tables[at_effect:at_sense].reshape((ends, (2 * steps + 1) * count))
    sense = tables[at_sense:at_feed].reshape((states, rows))
    feed = tables[at_feed:end].reshape(((2 * steps + 1) * count, rows))
    unknowns, columns = padded(rows), affine.shape[1]
    matrix = work[: unknowns * (unknowns + columns)].reshape((unknowns + columns, unknowns))
    fill(sense, feed, direction, inputs, first, law, push, matrix)
    eliminate(matrix)
    by_start = stages[: effect.shape[1]]
    inputs_at_stages(direction, law, push, matrix[unknowns:], rows, by_start)
    last = len(effect) - states
    product(effect[last:], by_start, affine)
    for row in range(states):
        for col in range(states):
            affine[row, col] += transition[last + row, col]


@jit_inner
def over_groups(
    tables: Any, groups: Any, direction: Any, inputs: Any, stages: Any, maps: Any, whole: Any
) -> None:
    """Find the maps over all groups.

    Parameters
    ----------
    tables, groups : see `wearlab.dynamics.collocation.Cut`
    stages : (n_groups, most inputs, columns) filled with the inputs at the stages
    maps : (n_groups, 2n, columns) filled with the map over each group
    whole : (2n, columns) filled with the map over all
    """
    states, columns = whole.shape
    most = 2 * groups[:, 1].max() * len(direction)
    unknowns = padded(most)
    work = np.empty(unknowns * (unknowns + columns))
    law, push = scratch_of(direction, inputs, most)
    by_state, carried = np.empty((states, states)), np.empty((states, columns))
    whole[:, :] = 0.0
    for row in range(states):
        whole[row, row] = 1.0
    for at in range(len(groups)):
        step = maps[at]
        over_group(tables, groups[at], direction, inputs, work, law, push, stages[at], step)
        for row in range(states):
            for col in range(states):
                by_state[row, col] = step[row, col]
        product(by_state, whole, carried)
        for row in range(states):
            for col in range(columns):
                whole[row, col] = carried[row, col] + (step[row, col] if col >= states else 0.0)


@jit_inner
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
    write(given[:rows], starts[0])
    for at in range(len(maps)):
        applied(stages[at], given, inputs[at])
        applied(maps[at], given, starts[at + 1])
        write(starts[at + 1], given)


@jit_inner
def path_over_groups(
    tables: Any, groups: Any, meshes: int, count: int, starts: Any, inputs: Any, states: Any
) -> None:
    """Fill ``states`` (n_steps + 1, 2n) from the groups' starts and inputs, groups alike in one product."""
    rows, begin = states.shape[1], 0
    write(starts[0], states[0])
    while begin < len(groups):
        end, (first, steps, where) = begin + 1, groups[begin]
        while end < len(groups) and groups[end, 2] == where:
            end += 1
        at_effect, at_sense, _, _ = places_of(where, steps, rows, count, meshes)
        stages = (2 * steps + 1) * count
        transition = tables[where:at_effect].reshape((steps * rows, rows))
        effect = tables[at_effect:at_sense].reshape((steps * rows, stages))
        if len(effect) * stages <= SMALL:
            for at in range(begin, end):
                for step in range(steps):
                    for row in range(rows):
                        total, line = 0.0, step * rows + row
                        for col in range(rows):
                            total += transition[line, col] * starts[at, col]
                        for col in range(stages):
                            total += effect[line, col] * inputs[at, col]
                        states[groups[at, 0] + 1 + step, row] = total
        else:
            alike = end - begin
            pushed = np.empty((alike, stages))
            for at in range(alike):
                write(inputs[begin + at, :stages], pushed[at])
            moved, driven = np.empty((alike, len(effect))), np.empty((alike, len(effect)))
            np.dot(starts[begin:end], transition.T, moved)
            np.dot(pushed, effect.T, driven)
            for at in range(alike):
                for step in range(steps):
                    for row in range(rows):
                        line = step * rows + row
                        states[first + 1 + at * steps + step, row] = moved[at, line] + driven[at, line]
        begin = end

"""Marching over mesh periods with the trajectory alone, in the memory layout of the shooting."""

from typing import Any

import numpy as np

from wearlab.compiled import jit
from wearlab.dynamics.balance import rebalance
from wearlab.dynamics.period_map import over_period
from wearlab.dynamics.registers import copy


@jit
def march_periods(
    kernel: Any,
    tables: Any,
    period: float,
    columns: Any,
    width: Any,
    start: Any,
    keep: int,
    states: Any,
    orbit: Any,
    strobe: Any,
    s: Any,
    touch: int,
) -> int:
    """March ``len(strobe) − 1`` mesh periods from ``start`` (2n,), which it moves; count changes of contact.

    Parameters
    ----------
    columns : 1 (uint64): advance the trajectory, not its tangents
    width : a tuple as long as a state has columns
    keep : the last periods to keep in full
    states : (n_steps + 1, 2n, width) flat, memory
    orbit : (keep · n_steps + 1, 2n) flat
    strobe : (count + 1, 2n) states at the start of every period
    touch : how contact is taken, see `over_period`
    """
    rows, steps, w, count = len(start), len(tables.width), len(width), len(strobe) - 1
    first = count * 0  # a variable, not a literal, which is a type of its own and would compile the map again
    copy(start, np.uint64(0), strobe[0], np.uint64(0), rows)
    changes = 0
    for k in range(count):
        states[: rows * w] = 0.0
        for row in range(rows):
            states[row * w] = start[row]
        changes += over_period(kernel, tables, period, columns, width, states, first, s, touch)
        for row in range(rows):
            start[row] = states[(steps * rows + row) * w]
        rebalance(kernel.balance, strobe[k], start, period)
        copy(start, np.uint64(0), strobe[k + 1], np.uint64(0), rows)
        slot = k - (count - keep)
        if slot >= 0:
            for x in range((steps + 1) * rows):
                orbit[slot * steps * rows + x] = states[x * w]
    return changes

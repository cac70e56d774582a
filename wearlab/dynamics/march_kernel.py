"""Marching over mesh periods with the trajectory alone."""

from typing import Any

import numpy as np

from wearlab.compiled import jit
from wearlab.dynamics.period_map import over_period

ONE_COLUMN = (0,)


@jit
def march_periods(
    kernel: Any, tables: Any, period: float, start: Any, count: int, keep: int, orbit: Any, strobe: Any, s: Any
) -> None:
    """March ``count`` mesh periods from ``start`` (2n,), which it moves.

    Parameters
    ----------
    keep : the last periods to keep in full
    orbit : (keep · n_steps + 1, 2n) flat
    strobe : (count + 1, 2n) states at the start of every period
    """
    rows, steps = len(start), len(tables.width)
    size = steps * rows
    orbit[:rows] = start
    strobe[0] = start
    for k in range(count):
        slot = max(0, k - (count - keep))
        if k > 0 and slot == 0:
            orbit[:rows] = strobe[k]
        over_period(kernel, tables, period, np.uint64(1), ONE_COLUMN, orbit, slot * steps, s, False)
        strobe[k + 1] = orbit[(slot + 1) * size : (slot + 1) * size + rows]
    start[:] = strobe[count]

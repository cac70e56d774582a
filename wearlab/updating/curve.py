"""A quantity over the cycles of a stored run, at any cycle and for any level."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array

TABLE = 20_000  # places of a table of crossings
BITS = 53  # bisections to round-off


def cubic(t: Array, y0: Array, y1: Array, d0: Array, d1: Array) -> Array:
    """Return the cubic over t from 0 to 1 that has values y and slopes d at both ends (Hermite)."""
    return y0 + t * (d0 + t * (3.0 * (y1 - y0) - 2.0 * d0 - d1 + t * (2.0 * (y0 - y1) + d0 + d1)))


@dataclass(frozen=True)
class RunCurve:
    """Quantities over the cycles of a stored run, cubic between its states, straight beyond them.

    Parameters
    ----------
    cycle : (states,) rising
    value, slope : (states, columns) and their derivative by the cycle
    """

    cycle: Array
    value: Array
    slope: Array

    def at(self, cycle: Array, column: NDArray[np.intp] | int = 0) -> Array:
        """Return values at cycles, each of its column; the shapes are broadcast."""
        i = np.clip(np.searchsorted(self.cycle, cycle, side="right") - 1, 0, len(self.cycle) - 2)
        left, right = self.cycle[i], self.cycle[i + 1]
        width = right - left
        t = np.clip((cycle - left) / width, 0.0, 1.0)
        y0, y1 = self.value[i, column], self.value[i + 1, column]
        d0, d1 = self.slope[i, column] * width, self.slope[i + 1, column] * width
        beyond = np.maximum(cycle - self.cycle[-1], 0.0)
        return np.asarray(cubic(t, y0, y1, d0, d1) + beyond * self.slope[-1, column])

    def first_above(self, level: Array) -> Array:
        """Return the cycles at which column 0 first reaches levels; by its end slope beyond the run, ∞ never.

        The crossing within a piece is the root of its cubic, found by bisection to round-off.
        """
        level = np.asarray(level, float)
        highest = np.maximum.accumulate(self.value[:, 0])
        i = np.searchsorted(highest, level, side="left")
        inside = (i > 0) & (i < len(highest))
        piece = np.clip(i, 1, len(highest) - 1)
        left, width = self.cycle[piece - 1], self.cycle[piece] - self.cycle[piece - 1]
        y0, rise = self.value[piece - 1, 0] - level, self.value[piece, 0] - self.value[piece - 1, 0]
        d0, d1 = self.slope[piece - 1, 0] * width, self.slope[piece, 0] * width
        second, third = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
        low, high = np.zeros(level.shape), np.ones(level.shape)
        for _ in range(BITS):
            t = 0.5 * (low + high)
            above = y0 + t * (d0 + t * (second + t * third)) >= 0.0
            low, high = np.where(above, low, t), np.where(above, t, high)
        crossing = left + high * width
        rate = self.slope[-1, 0]
        ahead = (level - self.value[-1, 0]) / rate if rate > 0.0 else np.full(level.shape, math.inf)
        return np.asarray(np.where(inside, crossing, np.where(i == 0, self.cycle[0], self.cycle[-1] + ahead)))

    def reached(self, level: Array) -> Array:
        """Return what `first_above` does for very many levels, by a table of it between start and end."""
        table, cycle = self._table
        rate = self.slope[-1, 0]
        ahead = (level - table[-1]) / rate if rate > 0.0 else np.full(level.shape, math.inf)
        return np.asarray(np.interp(level, table, cycle) + np.where(level > table[-1], ahead, 0.0))

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        cycle = np.linspace(self.cycle[0], self.cycle[-1], TABLE)
        return np.maximum.accumulate(self.at(cycle)), cycle

"""A tabulated curve: smooth between its points, with jumps where an abscissa stands twice."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wearlab.arrays import Array, Index


@dataclass(frozen=True)
class PiecewiseCurve:
    """A piecewise smooth function through given points.

    Between jumps the shape-preserving cubic of Fritsch and Carlson (1980) is used: it never overshoots.
    Beyond its ends the curve keeps its end values.

    Parameters
    ----------
    x : (n,) abscissae, not descending; an abscissa that stands twice marks a jump
    y : (n,) ordinates
    """

    x: Array
    y: Array
    _pieces: tuple[Any, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import PchipInterpolator

        if np.any(np.diff(self.x) < 0):
            raise ValueError("the abscissae of a table must not descend")
        pieces = []
        for x, y in zip(np.split(self.x, self._cuts), np.split(self.y, self._cuts), strict=True):
            pieces.append(PchipInterpolator(x, y) if len(x) > 1 else _Constant(float(y[0])))
        object.__setattr__(self, "_pieces", tuple(pieces))

    @property
    def _cuts(self) -> Index:
        return np.flatnonzero(np.diff(self.x) == 0) + 1

    @property
    def jumps(self) -> tuple[float, ...]:
        """Abscissae at which the curve jumps."""
        return tuple(float(x) for x in self.x[self._cuts])

    def value(self, x: Array, side: Array) -> Array:
        """Return the curve at ``x``, on the side of a jump on which the point ``side`` lies."""
        x, side = np.broadcast_arrays(np.asarray(x, float), np.asarray(side, float))
        inside = np.clip(x, self.x[0], self.x[-1])
        piece = np.searchsorted(np.array(self.jumps), side, side="right")
        result = np.empty(x.shape)
        for index, curve in enumerate(self._pieces):
            here = piece == index
            result[here] = curve(inside[here])
        return result


@dataclass(frozen=True)
class _Constant:
    value: float

    def __call__(self, x: Array) -> Array:
        return np.full(np.shape(x), self.value)


def constant(value: float) -> PiecewiseCurve:
    """Return the curve that has one value everywhere."""
    return PiecewiseCurve(np.array([0.0]), np.array([value]))

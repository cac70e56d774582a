"""What turns a planetary set into itself: its planets, equally spaced, do the same one after another.

Turned by one planet's angle the set is the same, its meshes ``s = z_s / N`` mesh periods later. Where these
lags cut the mesh period into m equal sections, a motion that is alone of its kind is in every section what it
was in the one before, turned: ``q(t + T/m) = R q(t)``. The map over a section then gives that over the
period, ``P = Rᵐ (R⁻¹ P_section)ᵐ``. Of one section, m = 1, are sets whose planets do the same at the same
instant, ``q = R q``: see `wearlab.dynamics.folding`.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index

SAME = 1e-9
"""Difference of two values, over the largest, that is rounding."""


class Symmetry(NamedTuple):
    """How a set is turned into itself over a section of the mesh period.

    Parameters
    ----------
    sections : m, equal parts of the mesh period [1]
    turn : (n, n) R, orthogonal: ``q(t + T/m) = R q(t)`` [1]
    mesh : (n_mesh,) which mesh does a section later what this one does
    """

    sections: int
    turn: Array
    mesh: Index


def turned_back(symmetry: Symmetry | None, sections: int, rows: int) -> Array:
    """Return R⁻¹ for positions and speeds, (2n, 2n); of one section, which is the period, 1."""
    if sections == 1 or symmetry is None:
        return np.eye(rows)
    return np.asarray(np.kron(np.eye(2), symmetry.turn.T), np.float64)

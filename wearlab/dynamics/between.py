"""What the mesh is between the stages of its tables: what they were taken of, or parabolas through them."""

from typing import NamedTuple, Protocol

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh.stages import StageTables


class TablesWithin(Protocol):
    """What tables were taken of; (n,) steps and fractions of them, values (n, n_mesh[, n_pairs])."""

    def errors(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return prescribed errors and their rates by phase [m]."""
        ...

    def springs(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return stiffness [N/m] and gap [m] of all pairs, stiffness 0 out of the path."""
        ...


def parabola(table: Array, step: Index, fraction: Array) -> Array:
    """Return three stage values (n_steps, 3, …) at fractions of steps (n,), by the parabola through them."""
    x, y = fraction, 1.0 - fraction
    return np.einsum("in,ni...->n...", np.array([y * (y - x), 4.0 * x * y, x * (x - y)]), table[step])


class Parabolas(NamedTuple):
    """Values between the stages of tables that are all that is known of a mesh: parabolas through them."""

    tables: StageTables

    def errors(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return prescribed errors and their rates by phase [m]."""
        return self._both(self.tables.error, self.tables.error_rate, step, fraction)

    def springs(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return stiffness [N/m] and gap [m] of all pairs, stiffness 0 out of the path."""
        return self._both(self.tables.stiffness, self.tables.gap, step, fraction)

    def _both(self, first: Array, second: Array, step: Index, fraction: Array) -> tuple[Array, Array]:
        return parabola(first, step, fraction), parabola(second, step, fraction)

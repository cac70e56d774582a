"""What the mesh is between the stages of its tables: what they were taken of, or parabolas through them."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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


def errors_within(
    tables: StageTables, between: TablesWithin | None, step: Index, fraction: Array
) -> tuple[Array, Array]:
    """Return prescribed errors and their rates by phase at fractions of steps, (n, n_mesh) each [m]."""
    if between is not None:
        return between.errors(step, fraction)
    return parabola(tables.error, step, fraction), parabola(tables.error_rate, step, fraction)


def springs_within(
    tables: StageTables, between: TablesWithin | None, step: Index, fraction: Array
) -> tuple[Array, Array]:
    """Return stiffness [N/m] and gap [m] of all pairs at fractions of steps, (n, n_mesh, n_pairs) each."""
    if between is not None:
        return between.springs(step, fraction)
    return parabola(tables.stiffness, step, fraction), parabola(tables.gap, step, fraction)

"""How long a transient lasts: what marching methods are told for free."""

import numpy as np
from numpy.typing import NDArray

from wearlab.accuracy.reference import Reference
from wearlab.accuracy.steady import Steady
from wearlab.dynamics.integrators.kernel import kernel_of
from wearlab.dynamics.steady.integrate import OnTables
from wearlab.dynamics.steady.periodic import Periodic

Array = NDArray[np.float64]

MAX_PERIODS = 2000
SMALLEST = 1e-11
STEPS_SHARE = 4


def transient(problem: Steady, reference: Reference, start: Array) -> Array:
    """Return the relative error of the mesh force that is left after 0, 1, 2 … mesh
    periods, (n,) [1].

    What is left is told from where the same march ends up.

    Parameters
    ----------
    problem, reference : the scene and its answer
    start : (2n,) state at phase 0 from which is marched
    """
    steps = max(64, len(reference.response.tables.width) // STEPS_SHARE)
    vibration = problem.with_steps(steps, Periodic())
    orbit = problem.solve(vibration)
    decay = min(reference.multiplier, 1.0 - 1e-9) or 0.5
    settled = int(
        min(MAX_PERIODS, np.ceil(np.log(SMALLEST) / np.log(decay)) + 30 * orbit.period)
    )
    count = -(-settled // orbit.period) * orbit.period
    marcher = OnTables(kernel_of(vibration.system, orbit.tables, orbit.mesh_period))
    _, path = marcher.integrate(start.copy(), count, count)
    path = path[..., : len(start) // 2] @ vibration.system.direction.T
    apart = np.abs(
        path.reshape(-1, orbit.period, *path.shape[1:]) - path[-orbit.period :]
    )
    stiffest = orbit.tables.stiffness.sum(axis=3).max()
    left = (
        apart.reshape(path.shape).max(axis=(1, 2))
        * stiffest
        / np.abs(reference.force).max()
    )
    return np.maximum.accumulate(left[::-1])[::-1]


def periods_to(left: Array, error: float) -> int:
    """Return the mesh periods until no more than ``error`` of a
    transient is left, at least one.
    """
    enough = np.flatnonzero(left <= error)
    return max(1, int(enough[0])) if len(enough) else len(left)

"""Orbits that are not alone: where I − P is singular, the nearest member of the family is taken.

Zero torque is the case: without contact the relative rotation floats, and every position of it is an orbit.
"""

from collections.abc import Callable

import numpy as np

from wearlab.arrays import Array

PeriodMap = Callable[[Array], tuple[Array, Array]]


def nearest_orbit(period_map: PeriodMap, state: Array, rate: float, most: int = 25) -> Array | None:
    """Return a state that the period map returns to itself, by least-squares Newton steps, or None.

    Parameters
    ----------
    period_map : state (2n,) -> its image (2n,) and the derivative P (2n, 2n)
    state : (2n,) where to start
    rate : unit of velocity against position [1/s]
    most : iterations allowed
    """
    n = len(state) // 2
    scale = np.r_[np.ones(n), np.full(n, rate)]
    for _ in range(most):
        image, derivative = period_map(state)
        residual = (image - state) / scale
        size = max(np.abs(state / scale).max(), np.abs(image / scale).max())
        if not np.isfinite(residual).all():
            return None
        if np.abs(residual).max() <= 1e-9 * size:
            return state
        matrix = np.eye(2 * n) - derivative * scale / scale[:, None]
        state = state + scale * np.linalg.lstsq(matrix, residual, rcond=1e-10)[0]
    return None

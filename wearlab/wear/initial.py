"""Flanks that are worn before the first cycle, by a given shape (by the law itself: life/worn.py)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def uniform(position: ArrayLike, depth: float) -> Array:
    """Return the same depth at every node, (n,) [m]; ``position`` (n,), ``depth`` ≥ 0 [m]."""
    return np.full(np.shape(position), _checked(depth))


def quadratic(position: ArrayLike, depth: float) -> Array:
    """Return ``depth (s/s_far)²``: zero at the pitch point, ``depth`` at the far end of the path, (n,) [m].

    Parameters
    ----------
    position : (n,) path coordinate of the nodes, 0 at the pitch point [m]; the whole active path
    depth : at s_far, the end of the path farther from the pitch point, ≥ 0 [m]
    """
    s = np.asarray(position, float)
    return np.asarray(_checked(depth) * (s / np.abs(s).max()) ** 2)


def _checked(depth: float) -> float:
    if not (np.isfinite(depth) and depth >= 0.0):
        raise ValueError(f"initial wear depth {depth:g} m must be finite and not negative")
    return depth

"""The loaded patch: a half ellipse of pressure, as under two touching cylinders."""

import math

import numpy as np

from wearlab.arrays import Array


def patch_rule(points: int = 24) -> tuple[Array, Array]:
    """Return positions x/w and weights of a unit half ellipse (Gauss–Chebyshev, second kind).

    Parameters
    ----------
    points : n

    Returns
    -------
    each (n,) [1]; the weights add up to 1

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.40.
    """
    angle = np.arange(1, points + 1) * math.pi / (points + 1)
    return np.cos(angle), 2.0 / (points + 1) * np.sin(angle) ** 2

"""The half thickness of a tooth at a height, by bisection on its outline."""

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import involute_point, load_angle, root_curve


def half_thickness(gear: Gear, height: ArrayLike) -> Array:
    """Return the half thickness of the tooth at heights on its centre line, found by
    bisection.

    Parameters
    ----------
    gear : the gear
    height : (n,) x between the foot of the root curve and the tip edge [m]

    Returns
    -------
    (n,) y [m]

    References
    ----------
    ISO 21771: tooth thickness at a diameter; below the involute Litvin & Fuentes.
    """
    x = np.asarray(height, dtype=float)
    low_angle = load_angle(gear, gear.form_radius)
    high_angle = load_angle(gear, gear.tip_radius)
    low = np.zeros_like(x)
    high = np.ones_like(x)
    rise = -1.0 if gear.internal else 1.0
    above = rise * x >= rise * involute_point(gear, low_angle)[0]
    for _ in range(60):
        middle = 0.5 * (low + high)
        reached = np.where(
            above,
            involute_point(gear, low_angle + (high_angle - low_angle) * middle)[0],
            root_curve(gear, middle)[0],
        )
        low = np.where(rise * reached < rise * x, middle, low)
        high = np.where(rise * reached < rise * x, high, middle)
    middle = 0.5 * (low + high)
    involute_y = involute_point(gear, low_angle + (high_angle - low_angle) * middle)[1]
    return np.where(above, involute_y, root_curve(gear, middle)[1])

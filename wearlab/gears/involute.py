"""The involute function and its inverse."""

import math

from wearlab.gears.errors import GearError


def involute(angle: float) -> float:
    """Return the involute function, inv α = tan α − α.

    Parameters
    ----------
    angle : pressure angle α [rad]

    Returns
    -------
    inv α [rad]

    References
    ----------
    ISO 21771:2007, clause 4.
    """
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Return the pressure angle of an involute function, solved by Newton's rule on a convex branch.

    Parameters
    ----------
    value : inv α ≥ 0 [rad]

    Returns
    -------
    pressure angle α in [0, π/2) [rad]

    Raises
    ------
    GearError : a negative value, which no involute has

    References
    ----------
    ISO 21771:2007, clause 4, for the function.
    """
    if not value >= 0.0:
        raise GearError(f"the involute function cannot be {value:.6g}: the profile shifts are too negative")
    if value == 0.0:
        return 0.0
    # with t = tan α: t − atan t = value, convex in t > 0, so Newton from the right is monotone
    t = (3.0 * value) ** (1.0 / 3.0) + value + 0.5 * math.pi * min(1.0, value)
    for _ in range(60):
        step = (t - math.atan(t) - value) * (1.0 + t * t) / (t * t)
        t -= step
        if abs(step) <= 1e-15 * t:
            break
    return math.atan(t)

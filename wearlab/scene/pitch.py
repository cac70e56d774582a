"""Diametral pitches of drawings in inches, as modules."""

import math
from collections.abc import Mapping
from typing import Any

from wearlab import options, units

NORMAL = "diametral_pitch"
TRANSVERSE = "transverse_diametral_pitch"
SIZES = ("module", NORMAL, TRANSVERSE)
"""Keys of which a gear set has one."""


def module_of_pitch(pitch: float, helix_angle: float = 0.0) -> float:
    """Return the normal module of a diametral pitch, ``m_n = 25.4 mm cos β / P``.

    Parameters
    ----------
    pitch : teeth per inch of diameter; in the normal section without ``helix_angle``
    helix_angle : β where the pitch is that of the transverse section [rad]

    Returns
    -------
    m_n [m]

    References
    ----------
    ISO 21771:2007, 4.1, for the modules; an inch is 25.4 mm.

    Examples
    --------
    >>> round(1e3 * module_of_pitch(20.0), 6)
    1.27
    """
    return units.INCH * math.cos(helix_angle) / pitch


def with_module(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a gear set with the module of their diametral pitch.

    Parameters
    ----------
    table : as written

    Raises
    ------
    ValueError : two of module and diametral pitches are given
    """
    given = [key for key in SIZES if table.get(key) is not None]
    if len(given) > 1:
        raise ValueError(f"give one of {' and '.join(map(repr, given))}, not both")
    if not given or given == ["module"]:
        return dict(table)

    pitch = table[given[0]]
    if not units.is_number(pitch) or not 0.0 < pitch < math.inf:
        # the option itself says what is wrong with it
        return {**table, "module": options.Stored(1e-3)}
    helix_angle = _helix_angle(table) if given == [TRANSVERSE] else 0.0
    module = options.Stored(module_of_pitch(pitch, helix_angle))
    return {**table, given[0]: None, "module": module}


def _helix_angle(table: Mapping[str, Any]) -> float:
    """Return the helix angle of a table [rad], 0 where it has none that can be read."""
    angle = table.get("helix_angle")
    if isinstance(angle, options.Stored):
        return float(angle)
    try:
        return units.quantity(angle, "angle") if angle is not None else 0.0
    except units.UnitError:
        return 0.0

"""Deviations that an ISO 1328 class allows a gear: the formulas of ISO 1328-1:1995.

The edition of 1995 is taken since that of 2013 has no formula for the tangential composite deviations.
"""

import math
from bisect import bisect_right
from typing import NamedTuple

from wearlab.gears.specification import GearError

CLASSES = range(13)
REFERENCE_CLASS = 5
MODULES = (0.5, 2.0, 3.5, 6.0, 10.0, 16.0, 25.0, 40.0, 70.0)  # mm, ends of ranges
DIAMETERS = (5.0, 20.0, 50.0, 125.0, 280.0, 560.0, 1000.0, 1600.0, 2500.0, 4000.0, 6000.0, 8000.0, 10000.0)
MICRO = 1e-6


class Allowed(NamedTuple):
    """What a class allows [m].

    Parameters
    ----------
    single_pitch : f_pt
    total_pitch : F_p
    profile : F_α
    tooth_composite : f_i′, tooth-to-tooth tangential composite deviation
    total_composite : F_i′, total tangential composite deviation
    """

    single_pitch: float
    total_pitch: float
    profile: float
    tooth_composite: float
    total_composite: float


def allowed(grade: int, module: float, diameter: float, contact_ratio: float) -> Allowed:
    """Return the deviations that an accuracy class allows.

    ``f_pt = 0.3 (m + 0.4 √d) + 4``, ``F_p = 0.3 m + 1.25 √d + 7``, ``F_α = 3.2 √m + 0.22 √d + 0.7``,
    ``f_i′ = K (4.3 + f_pt + F_α)``, ``K = 0.2 (ε + 4)/ε`` below ε = 4 and 0.4 from there,
    ``F_i′ = F_p + f_i′``, in µm for class 5; times ``2^((Q − 5)/2)`` for class Q. Module and diameter are the
    geometric means of the ranges that they fall in; values are rounded as the standard's tables are.

    Parameters
    ----------
    grade : Q, 0 to 12
    module : normal module [m]
    diameter : reference diameter [m]
    contact_ratio : ε of the mesh [1]

    Raises
    ------
    GearError : a class, module or diameter that the standard does not have

    Source: ISO 1328-1:1995, 6.1 to 6.4 and Annex A.
    """
    if grade not in CLASSES:
        raise GearError(f"ISO 1328 has the classes 0 to 12, not {grade}")
    m = _middle(1e3 * module, MODULES, "module")
    d = _middle(1e3 * diameter, DIAMETERS, "reference diameter")
    pitch = 0.3 * (m + 0.4 * math.sqrt(d)) + 4.0
    total = 0.3 * m + 1.25 * math.sqrt(d) + 7.0
    profile = 3.2 * math.sqrt(m) + 0.22 * math.sqrt(d) + 0.7
    k = 0.2 * (contact_ratio + 4.0) / contact_ratio if contact_ratio < 4.0 else 0.4
    tooth = k * (4.3 + pitch + profile)
    step = 2.0 ** ((grade - REFERENCE_CLASS) / 2.0)
    return Allowed(*(MICRO * _rounded(step * x) for x in (pitch, total, profile, tooth, total + tooth)))


def _middle(value: float, ends: tuple[float, ...], name: str) -> float:
    """Return the geometric mean of the range that holds a value [mm]."""
    if not ends[0] <= value <= ends[-1]:
        raise GearError(f"ISO 1328-1 covers a {name} of {ends[0]:g} to {ends[-1]:g} mm, not {value:g} mm")
    high = next((i for i, end in enumerate(ends) if value <= end and i > 0), bisect_right(ends, value))
    return math.sqrt(ends[high - 1] * ends[high])


def _rounded(micrometres: float) -> float:
    """Round to whole micrometres above 10, to halves above 5, to tenths below (ISO 1328-1:1995, 5.2)."""
    if micrometres > 10.0:
        return float(round(micrometres))
    return round(2.0 * micrometres) / 2.0 if micrometres > 5.0 else round(micrometres, 1)

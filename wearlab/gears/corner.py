"""The corner of a tip on its way through the tooth space of an undercut mate.

Below the involute of an undercut gear nothing touches the flank of its mate, but the
tip still goes there. It is free where its corner keeps clear of the root curve.
"""

import math

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import root_curve

ROOT_POINTS = 2001
PLACES = 4001
"""Points of the root curve, and places of the corner, that are compared."""


def corner_clearance(gear: Gear, mate: Gear, centre_distance: float) -> float:
    """Return how far the corner of a tip stays away from the root curve of a gear [m].

    With the flanks in contact at the pitch point the corner lies at ``ψ_a − ψ_w`` from
    there, as its centre sees it; while the gears turn by θ and ``θ z_1/z_2`` it moves
    on an epitrochoid of the gear. Compared are angles about the gear's centre at equal
    radii, times the radius.

    Parameters
    ----------
    gear : whose root it is, external
    mate : whose tip it is, a ring or not
    centre_distance : a [m]

    Returns
    -------
    negative where the corner would cut into the tooth; inf where it stays above the
    root curve

    References
    ----------
    Litvin & Fuentes, Gear Geometry and Applied Theory, 2nd ed., 6.4, for the root
    curve; Colbourne, The Geometry of Involute Gears, chapter 9, for interference.
    """
    radius, angle = _corner_seen(gear, mate, centre_distance)
    x, y, _ = root_curve(gear, np.linspace(0.0, 1.0, ROOT_POINTS))
    root_radius = np.hypot(x, y)
    root_angle = np.arctan2(y, x)

    is_below = radius < gear.form_radius
    if not is_below.any():
        return math.inf
    radius = radius[is_below]
    beside = angle[is_below] - np.interp(radius, root_radius, root_angle)
    return float((beside * radius).min())


def _corner_seen(gear: Gear, mate: Gear, centre_distance: float) -> tuple[Array, Array]:
    """Return radius [m] and angle from the tooth's centre line [rad] of the corner.

    Each (n,), for all turns in which the corner is near the root of the gear.
    """
    a = centre_distance
    tip = mate.active_tip_radius
    alpha_w = math.acos(
        abs(mate.outwards * mate.base_radius + gear.base_radius) / centre_distance
    )
    working_radius = gear.base_radius / math.cos(alpha_w)
    mate_working_radius = mate.base_radius / math.cos(alpha_w)
    corner = mate.half_angle(tip) - mate.half_angle(mate_working_radius)

    cosine = (a**2 + tip**2 - gear.form_radius**2) / (2.0 * a * tip)
    if cosine >= 1.0:
        return np.empty(0), np.empty(0)
    furthest = math.acos(max(cosine, -1.0))
    turned = corner + np.linspace(-furthest, furthest, PLACES)

    # seen from the mate's centre: an external mate lies beyond the pitch point
    direction = math.pi + corner - turned
    centre = a
    if mate.internal:
        direction = turned - corner
        centre = -a
    x = centre + tip * np.cos(direction)
    y = tip * np.sin(direction)
    turned_gear = turned * mate.teeth / gear.teeth
    angle = np.arctan2(y, x) - turned_gear + gear.half_angle(working_radius)
    return np.hypot(x, y), angle

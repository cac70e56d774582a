"""Separation of a tip corner beyond the path, against a search over
the mating flank.
"""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from tip_contact import tip_separation

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec

PAIR = gear_pair(
    GearSpec(name="pinion", teeth=23),
    GearSpec(name="gear", teeth=41),
    Basics(0.003, pressure_angle=math.radians(20), face_width=0.02),
)


def by_search(distance):
    """Turn both gears past E, and measure the corner's distance to the driven involute
    along its normal.
    """
    alpha = PAIR.working_pressure_angle
    r1 = PAIR.driving.base_radius
    r2 = PAIR.driven.base_radius
    a = PAIR.centre_distance
    along = np.array([math.sin(alpha), math.cos(alpha)])
    contact = np.array([r1 / math.cos(alpha), 0.0]) + PAIR.path.E * along
    turn1 = distance / r1
    turn2 = distance / r2

    def rotate(v, angle):
        c = math.cos(angle)
        s = math.sin(angle)
        return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])

    corner = rotate(contact, turn1)
    rho = r2 * math.tan(alpha) - PAIR.path.E
    normal = -along  # from the driven base circle towards the contact, before turning

    def flank(roll):
        """Driven involute, its contact point at roll 0, then turned
        back by the driven rotation.
        """
        foot = contact - np.array([a, 0.0]) - rho * normal
        turned = rotate(foot, -roll) + (rho + r2 * roll) * rotate(normal, -roll)
        return rotate(turned, -turn2) + np.array([a, 0.0])

    found = minimize_scalar(
        lambda roll: np.hypot(*(flank(roll) - corner)),
        bounds=(-0.2, 0.2),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return found.fun


@pytest.mark.parametrize("distance", [2e-4, 5e-4, 1e-3])
def test_separation_is_the_distance_to_the_mating_involute(distance):
    assert tip_separation(PAIR, "E", distance) == pytest.approx(
        by_search(distance), rel=1e-4
    )


def test_separation_starts_quadratically():
    ratio = tip_separation(PAIR, "A", 2e-4) / tip_separation(PAIR, "A", 1e-4)
    assert ratio == pytest.approx(4.0, rel=0.02)

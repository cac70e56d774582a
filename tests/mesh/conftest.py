"""The L16 pair, as gears only."""

import math

import pytest

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec


def l16(**changes):
    common = {
        "teeth": 50,
        "tip_diameter": 0.156,
        "root_diameter": 0.140,
        "bore_diameter": 0.040,
    }
    return gear_pair(
        GearSpec(name="pinion", **{**common, **changes}),
        GearSpec(name="gear", **common),
        Basics(0.003, pressure_angle=math.radians(20), face_width=0.02),
    )


@pytest.fixture(scope="session")
def pair():
    return l16()

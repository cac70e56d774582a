"""Pairs of every kind, and worn flanks of them."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.exact.gaps import WornFlanks
from wearlab.mesh.profile import profile_grid


def external(driving="pinion"):
    return gear_pair(
        GearSpec(name="pinion", teeth=23),
        GearSpec(name="gear", teeth=41),
        Basics(0.003, pressure_angle=math.radians(20), face_width=0.02),
        driving=driving,
    )


def internal(driving="pinion"):
    return gear_pair(
        GearSpec(name="pinion", teeth=40, fillet_radius_coefficient=0.3),
        GearSpec(name="ring", teeth=100, tip_alteration="wang-2023", rim_diameter=0.7),
        Basics(0.006, face_width=0.05),
        driving=driving,
        internal=True,
    )


PAIRS = {
    "external": external(),
    "external, wheel drives": external("gear"),
    "internal": internal(),
    "internal, ring drives": internal("ring"),
}


def flanks_of(pair, points=201):
    grid = profile_grid(pair, points)
    return WornFlanks(pair, grid, np.zeros((2, len(grid.position))))


def smooth_wear(flanks, depth):
    """Wear as it forms: none at the pitch point, most at the ends,
    more on the driving flank.
    """
    s = flanks.grid.position
    share = (s / np.abs(s).max()) ** 2
    return depth * np.stack([share, 0.6 * share * (1.0 + 20.0 * s)])


@pytest.fixture(scope="session", params=list(PAIRS))
def flanks(request):
    return flanks_of(PAIRS[request.param])


@pytest.fixture(scope="session")
def make():
    return SimpleNamespace(flanks_of=flanks_of, smooth_wear=smooth_wear, pairs=PAIRS)

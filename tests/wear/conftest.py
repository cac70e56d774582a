"""The path of contact of L16's pair (50/50, module 3 mm, 20°, 20 mm
wide), from first principles.
"""

import numpy as np
import pytest
from made_path import path_of

from wearlab.wear.path import contact_modulus

STEEL = contact_modulus([206e9, 206e9], [0.3, 0.3])


def involute_path(z1=50, z2=50, n=201, speed=100.0, reference=0):
    m = 3e-3
    alpha = np.radians(20.0)
    width = 20e-3
    r1 = m * z1 / 2
    r2 = m * z2 / 2
    rb1 = r1 * np.cos(alpha)
    rb2 = r2 * np.cos(alpha)
    end = np.sqrt((r1 + m) ** 2 - rb1**2) - rb1 * np.tan(alpha)
    start = rb2 * np.tan(alpha) - np.sqrt((r2 + m) ** 2 - rb2**2)
    s = np.linspace(start, end, n)
    rho = np.stack([rb1 * np.tan(alpha) + s, rb2 * np.tan(alpha) - s])
    path = path_of(
        rho,
        base_radius=[rb1, rb2],
        teeth=[z1, z2],
        speed=speed,
        face_width=width,
        modulus=STEEL,
        passes=[(z1, z2)[reference] / z1, (z1, z2)[reference] / z2],
    )
    return s, path


@pytest.fixture(scope="session")
def make_path():
    return involute_path


@pytest.fixture(scope="session")
def l16():
    return involute_path()

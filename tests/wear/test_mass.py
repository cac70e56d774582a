import numpy as np
import pytest

from wearlab.wear.initials.quadratic import quadratic
from wearlab.wear.path import worn_area, worn_mass


def test_uniform_depth_wears_depth_times_arc(make_path):
    s, path = make_path(25, 40)
    depth = np.stack([np.full_like(s, 1e-5), np.full_like(s, 2e-5)])
    area = worn_area(depth, path)
    base_radius = np.array([25, 40]) * 1.5e-3 * np.cos(np.radians(20.0))
    arc = np.abs(path.curvature[:, -1] ** 2 - path.curvature[:, 0] ** 2) / (
        2 * base_radius
    )
    assert area == pytest.approx(np.array([1e-5, 2e-5]) * arc, rel=1e-12, abs=0.0)
    mass = worn_mass(
        np.stack([depth, 3 * depth]), path, density=[7830.0, 7800.0], teeth=[25, 40]
    )
    assert mass[0] == pytest.approx(
        np.array([7830.0 * 25, 7800.0 * 40]) * 20e-3 * area, rel=1e-12, abs=0.0
    )
    assert mass[1] == pytest.approx(3 * mass[0], rel=1e-6, abs=0.0)


def test_quadratic_shape(make_path):
    s, _ = make_path(25, 40)
    h = quadratic(s, 4e-5)
    far = np.argmax(np.abs(s))
    assert h[far] == 4e-5 == h.max()
    assert h == pytest.approx(4e-5 * (s / s[far]) ** 2, rel=1e-6, abs=0.0)

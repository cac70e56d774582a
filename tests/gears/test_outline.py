import math

import numpy as np
import pytest
from half_thickness import half_thickness

from wearlab.gears.outline import (
    contact_depth,
    involute_point,
    involute_rise,
    load_angle,
    root_curve,
    root_half_angle,
)

TROCHOIDS = [
    {"teeth": 50},
    {"teeth": 20, "profile_shift_coefficient": 0.35},
    {"teeth": 80, "profile_shift_coefficient": -0.4},
    {"teeth": 25, "fillet_radius_coefficient": 0.2, "dedendum_coefficient": 1.4},
]


@pytest.mark.parametrize("spec", TROCHOIDS)
def test_trochoid_meets_the_involute_in_a_common_tangent(pair_of, spec):
    gear = pair_of(spec).driving
    assert gear.root_profile == "trochoid"
    angle = load_angle(gear, gear.form_radius)
    x, y, _ = root_curve(gear, np.array([1.0 - 1e-6, 1.0]))
    assert (x[1], y[1]) == pytest.approx(
        tuple(float(v) for v in involute_point(gear, angle)), rel=1e-12
    )
    assert np.hypot(x[1], y[1]) == pytest.approx(gear.form_radius, rel=1e-12)
    # the chord deviates from the tangent by curvature times the step; the involute's is
    # dy/dx = −tanλ
    assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(-math.tan(angle), abs=1e-5)


@pytest.mark.parametrize("spec", TROCHOIDS)
def test_trochoid_runs_out_along_the_root_circle(pair_of, spec):
    gear = pair_of(spec).driving
    x, y, rise = root_curve(gear, np.array([0.0, 1e-6]))
    assert np.hypot(x, y) == pytest.approx(gear.root_radius, rel=1e-9)
    assert math.atan2(y[0], x[0]) == pytest.approx(root_half_angle(gear), rel=1e-12)
    assert (x[1] - x[0]) / 1e-6 == pytest.approx(rise[0], rel=1e-4)
    assert root_half_angle(gear) < math.pi / gear.teeth


def test_trochoid_keeps_clear_of_the_rounding(pair_of):
    """The rack's rounding never cuts into the outline it generates: an envelope, not
    just a curve.
    """
    gear = pair_of().driving
    r = gear.reference_radius
    rho = gear.fillet_radius
    x, y, _ = root_curve(gear, np.linspace(0, 1, 101))
    depth = r - gear.root_radius - rho
    offset = root_half_angle(gear) * r
    nearest = np.full_like(x, np.inf)
    for phi in np.linspace(-0.02, 0.18, 4001):
        across = offset - r * phi
        centre_x = (r - depth) * math.cos(phi) - across * math.sin(phi)
        centre_y = (r - depth) * math.sin(phi) + across * math.cos(phi)
        nearest = np.minimum(nearest, np.hypot(x - centre_x, y - centre_y))
    assert nearest == pytest.approx(rho, rel=1e-5)


def test_root_curve_rate(pair_of):
    gear = pair_of().driving
    t = np.linspace(0.1, 0.9, 5)
    step = 1e-6
    slope = (root_curve(gear, t + step)[0] - root_curve(gear, t - step)[0]) / (2 * step)
    assert root_curve(gear, t)[2] == pytest.approx(slope, rel=1e-6)


def test_radial_root_is_a_radius(pair_of):
    gear = pair_of({"root_diameter": 0.140}).driving
    x, y, _ = root_curve(gear, np.linspace(0, 1, 5))
    assert np.arctan2(y, x) == pytest.approx(gear.base_half_angle, rel=1e-12)
    assert np.hypot(x, y)[[0, -1]] == pytest.approx([0.070, gear.base_radius])


def test_radial_root_above_the_base_circle_is_a_point(pair_of):
    gear = pair_of({"teeth": 80, "root_profile": "radial"}).driving
    assert gear.root_radius > gear.base_radius
    assert gear.form_radius == gear.root_radius
    assert np.all(root_curve(gear, np.linspace(0, 1, 3))[2] == 0.0)


def test_involute_lies_on_its_circle_at_its_thickness(pair_of):
    gear = pair_of({"profile_shift_coefficient": 0.3}).driving
    radius = np.linspace(gear.form_radius, gear.tip_radius, 7)
    x, y = involute_point(gear, load_angle(gear, radius))
    assert np.hypot(x, y) == pytest.approx(radius, rel=1e-13)
    assert np.arctan2(y, x) == pytest.approx(
        [gear.half_angle(r) for r in radius], rel=1e-11
    )
    r = gear.reference_radius
    assert 2 * r * gear.half_angle(r) == pytest.approx(
        gear.module * (math.pi / 2 + 2 * 0.3 * math.tan(gear.pressure_angle)), rel=1e-12
    )


def test_line_of_action_is_tangent_to_the_base_circle(pair_of):
    gear = pair_of().driving
    angle = load_angle(gear, np.linspace(gear.form_radius, gear.tip_radius, 5))
    x, y = involute_point(gear, angle)
    assert x * np.cos(angle) - y * np.sin(angle) == pytest.approx(
        gear.base_radius, rel=1e-13
    )
    step = 1e-6
    slope = (
        involute_point(gear, angle + step)[0] - involute_point(gear, angle - step)[0]
    ) / (2 * step)
    assert involute_rise(gear, angle) == pytest.approx(slope, rel=1e-7)


def test_half_thickness_and_depth(pair_of):
    gear = pair_of().driving
    t = np.linspace(0.05, 1.0, 5)
    x, y, _ = root_curve(gear, t)
    assert half_thickness(gear, x) == pytest.approx(y, rel=1e-9)
    radius = np.linspace(gear.form_radius, gear.tip_radius, 5)
    x, y = involute_point(gear, load_angle(gear, radius))
    assert half_thickness(gear, x) == pytest.approx(y, rel=1e-9)
    assert contact_depth(gear, radius) == pytest.approx(
        y / np.cos(load_angle(gear, radius)), rel=1e-13
    )

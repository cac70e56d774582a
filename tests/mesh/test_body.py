import math

import numpy as np
import pytest
from bodies import foundation_compliance

from wearlab.gears.outline import involute_point, load_angle, root_half_angle
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.body import (
    foundation_validity,
    sainsot_coefficients,
)


def gear_of(**changes):
    first = GearSpec(name="pinion", **{"teeth": 50, **changes})
    return gear_pair(
        first, GearSpec(name="gear", teeth=50), Basics(0.003, face_width=0.02)
    ).driving


def test_polynomials_of_sainsot():
    """Each coefficient of the published table, evaluated by hand at h = 3, θ = 0.05."""
    h, t = 3.0, 0.05
    L = (
        -5.574e-5 / t**2
        - 1.9986e-3 * h**2
        - 2.3015e-4 * h / t
        + 4.7702e-3 / t
        + 0.0271 * h
        + 6.8045
    )
    M = (
        60.111e-5 / t**2
        + 28.100e-3 * h**2
        - 83.431e-4 * h / t
        - 9.9256e-3 / t
        + 0.1624 * h
        + 0.9086
    )
    P = (
        -50.952e-5 / t**2
        + 185.50e-3 * h**2
        + 0.0538e-4 * h / t
        + 53.300e-3 / t
        + 0.2895 * h
        + 0.9236
    )
    Q = (
        -6.2042e-5 / t**2
        + 9.0889e-3 * h**2
        - 4.0964e-4 * h / t
        + 7.8297e-3 / t
        - 0.1472 * h
        + 0.6904
    )
    assert sainsot_coefficients(h, t) == pytest.approx((L, M, P, Q), rel=1e-13, abs=0)


def test_compliance_at_one_point():
    gear = gear_of(bore_diameter=0.040)
    radius = 0.076
    lam = float(load_angle(gear, radius))
    x, y = (float(v) for v in involute_point(gear, lam))
    L, M, P, Q = sainsot_coefficients(gear.root_radius / 0.020, root_half_angle(gear))
    ratio = (x - y * math.tan(lam) - gear.root_radius) / (
        2 * gear.root_radius * root_half_angle(gear)
    )
    shape = L * ratio**2 + M * ratio + P * (1 + Q * math.tan(lam) ** 2)
    expected = math.cos(lam) ** 2 * shape / (206e9 * 0.02)
    assert foundation_compliance(gear, radius) == pytest.approx(
        expected, rel=1e-12, abs=0
    )


def test_grows_towards_the_tip_and_falls_with_the_width():
    gear = gear_of()
    radius = np.linspace(0.073, 0.078, 6)
    compliance = foundation_compliance(gear, radius)
    assert np.all(np.diff(compliance) > 0)
    wide = gear._replace(face_width=0.04)
    assert foundation_compliance(wide, radius) == pytest.approx(
        0.5 * compliance, rel=1e-14, abs=0
    )


def test_range_of_validity():
    assert foundation_validity(gear_of()) == ()
    (thin,) = foundation_validity(gear_of(bore_diameter=0.110))
    assert "h_f = r_f/r_bore = 1.295, fitted for 1.4 to 7" in thin
    (few,) = foundation_validity(gear_of(teeth=20))
    assert few.startswith(
        "pinion: sainsot foundation outside its range: theta_f = 0.15"
    )


def test_the_height_keeps_its_sign_where_the_line_crosses_within_the_ring_s_body():
    """Near E of a 40/100 ring u is negative: the cross term M u/S is too, and the curve
    has no kink.
    """
    pair = gear_pair(
        GearSpec(name="pinion", teeth=40, fillet_radius_coefficient=0.3),
        GearSpec(name="ring", teeth=100, tip_alteration="wang-2023", rim_diameter=0.7),
        Basics(0.006, face_width=0.05),
        internal=True,
    )
    ring = pair.driven
    radius = pair.radius(1, np.linspace(pair.path.A, pair.path.E, 201))
    lam = load_angle(ring, radius)
    theta = root_half_angle(ring)
    height = ring.root_radius - ring.base_radius / np.cos(lam)
    assert height.min() < 0.0 < height.max()
    L, M, P, Q = sainsot_coefficients(ring.bore_radius / ring.root_radius, theta)
    ratio = height / (2.0 * ring.root_radius * theta)
    shape = L * ratio**2 + M * ratio + P * (1.0 + Q * np.tan(lam) ** 2)
    found = foundation_compliance(ring, radius)
    np.testing.assert_allclose(
        found, np.cos(lam) ** 2 * shape / (206e9 * 0.05), rtol=1e-12
    )
    slope = np.diff(found) / np.diff(radius)
    assert np.abs(np.diff(slope)).max() < 0.02 * np.abs(slope).max()

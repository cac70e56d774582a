"""The running sums against SciPy's quadrature of the same energies,
section by section.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from bodies import foundation_compliance
from half_thickness import half_thickness
from scipy.integrate import quad

from wearlab.gears.outline import involute_point, load_angle, root_half_angle
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.stiffness import yang_sun
from wearlab.mesh.tooth import ToothFlexibility, tooth_compliance, tooth_flexibility

RADIAL = {"root_diameter": 0.140, "bore_diameter": 0.040}


def build(pinion=None, gear=None):
    first = GearSpec(name="pinion", **{"teeth": 50, **(pinion or {})})
    second = GearSpec(name="gear", **{"teeth": 50, **(gear or {})})
    return gear_pair(first, second, Basics(0.003, face_width=0.02))


def evaluate(flexibility: ToothFlexibility, wear):
    tooth = tooth_compliance(flexibility, wear)
    assert not np.isnan(tooth).any()
    return tooth, flexibility.foundation


def at_angle(gear, height):
    """Load angle of the involute at a height, by bisection of its own equation."""
    low, high = 0.0, 2.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        below = involute_point(gear, middle)[0] < height
        low, high = (middle, high) if below else (low, middle)
    return middle


def by_quadrature(
    gear, radius, wear_at, lowest, shear_factor=1.2, back_at=lambda r: 0.0
):
    """Integrate each energy with quad: M about the worn centroid, N
    and V in the worn section.
    """
    lam = float(load_angle(gear, radius))
    x_A, y_A = (float(v) for v in involute_point(gear, lam))
    h_A = wear_at(radius)
    x_A = x_A - h_A * math.sin(lam)
    y_A = y_A - h_A * math.cos(lam)
    E = gear.material.youngs_modulus
    G = gear.material.shear_modulus
    B = gear.face_width
    start = gear.root_radius * math.cos(root_half_angle(gear))
    lowest_x = float(involute_point(gear, load_angle(gear, lowest))[0])
    form_x = float(involute_point(gear, load_angle(gear, gear.form_radius))[0])

    def energy(x):
        y = float(half_thickness(gear, x))
        h_y = 0.0
        back = 0.0
        if x > lowest_x:
            angle = at_angle(gear, x)
            r = math.hypot(*involute_point(gear, angle))
            h_y = wear_at(r) / math.cos(angle)
            back = back_at(r) / math.cos(angle)
        t = 2 * y - h_y - back
        centroid = 0.5 * (back - h_y)
        moment = math.cos(lam) * (x_A - x) - math.sin(lam) * (y_A - centroid)
        bending = moment**2 / (E * B * t**3 / 12)
        shear = shear_factor * math.cos(lam) ** 2 / (G * B * t)
        return bending + shear + math.sin(lam) ** 2 / (E * B * t)

    edges = [
        start,
        start + 0.15 * (form_x - start),
        min(form_x, x_A),
        min(lowest_x, x_A),
        x_A,
    ]
    pieces = pairwise(edges)
    return sum(
        quad(energy, a, b, epsabs=0, epsrel=1e-8, limit=80)[0]
        for a, b in pieces
        if b > a
    )


@pytest.mark.parametrize(
    ("pinion", "side"),
    [
        ({}, 0),
        (RADIAL, 0),
        ({"teeth": 25, "profile_shift_coefficient": 0.3}, 0),
        ({}, 1),
    ],
)
def test_healthy_tooth_against_quadrature(pinion, side):
    pair = build(pinion)
    gear = pair.gears[side]
    s = np.linspace(pair.path.A, pair.path.E, 41)
    radius = pair.radius(side, s)
    tooth, _ = evaluate(tooth_flexibility(gear, radius), np.zeros(41))
    for i in (0, 7, 20, 40):
        expected = by_quadrature(gear, radius[i], lambda r: 0.0, radius.min())
        assert tooth[i] == pytest.approx(expected, rel=3e-6, abs=0)


@pytest.mark.parametrize("side", [0, 1])
def test_worn_tooth_against_quadrature(side):
    pair = build(RADIAL)
    gear = pair.gears[side]
    s = np.linspace(pair.path.A, pair.path.E, 201)
    radius = pair.radius(side, s)

    def wear_at(r):
        position = math.sqrt(r**2 - gear.base_radius**2) - gear.base_radius * math.tan(
            pair.working_pressure_angle
        )
        return 120e-6 * (position / pair.path.E) ** 2 + 20e-6

    wear = np.array([wear_at(r) for r in radius])
    flexibility = tooth_flexibility(gear, radius)
    worn, _ = evaluate(flexibility, wear)
    healthy, _ = evaluate(flexibility, np.zeros(201))
    for i in (20, 60, 150, 180):
        expected = by_quadrature(gear, radius[i], wear_at, radius.min())
        assert worn[i] - healthy[i] == pytest.approx(
            expected - by_quadrature(gear, radius[i], lambda r: 0.0, radius.min()),
            rel=2e-3,
            abs=2e-16,
        )
        assert worn[i] == pytest.approx(expected, rel=1e-5, abs=0)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_a_tooth_worn_on_both_sides_against_quadrature(share):
    """Y23's Fig. 10: the section is thinner by both depths, and its
    centroid where they leave it.
    """
    pair = build(RADIAL)
    gear = pair.driving
    s = np.linspace(pair.path.A, pair.path.E, 201)
    radius = pair.radius(0, s)

    def wear_at(r):
        position = math.sqrt(r**2 - gear.base_radius**2) - gear.base_radius * math.tan(
            pair.working_pressure_angle
        )
        return 120e-6 * (position / pair.path.E) ** 2 + 20e-6

    wear = np.array([wear_at(r) for r in radius])
    flexibility = tooth_flexibility(gear, radius)
    worn, _ = evaluate(flexibility._replace(back=share * wear), wear)
    drive, _ = evaluate(flexibility, wear)
    for i in (60, 150, 180):
        expected = by_quadrature(
            gear, radius[i], wear_at, radius.min(), back_at=lambda r: share * wear_at(r)
        )
        before = by_quadrature(gear, radius[i], wear_at, radius.min())
        assert worn[i] == pytest.approx(expected, rel=1e-5, abs=0)
        assert worn[i] - drive[i] == pytest.approx(
            expected - before, rel=2e-3, abs=2e-16
        )


def test_shear_factor_enters_the_shear_alone():
    pair = build()
    s = np.linspace(pair.path.A, pair.path.E, 41)
    radius = pair.radius(0, s)
    low, _ = evaluate(
        tooth_flexibility(pair.driving, radius, shear_factor=1.2), np.zeros(41)
    )
    high, _ = evaluate(
        tooth_flexibility(pair.driving, radius, shear_factor=1.5), np.zeros(41)
    )
    expected = by_quadrature(
        pair.driving, radius[30], lambda r: 0.0, radius[0], shear_factor=1.5
    )
    assert high[30] == pytest.approx(expected, rel=3e-6, abs=0)
    assert np.all(high > low)


def test_fourth_order_in_the_node_distance():
    pair = build()
    fine = _pitch_compliance(pair, 1025)
    errors = [abs(_pitch_compliance(pair, n) - fine) for n in (9, 17, 33)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.7)
    assert errors[-1] / fine < 1e-6


def _pitch_compliance(pair, n):
    radius = pair.radius(0, np.linspace(pair.path.A, pair.path.E, n))
    return evaluate(tooth_flexibility(pair.driving, radius), np.zeros(n))[0][-1]


def test_wear_tends_to_the_healthy_tooth_linearly_and_exactly():
    pair = build()
    s = np.linspace(pair.path.A, pair.path.E, 101)
    flexibility = tooth_flexibility(pair.driving, pair.radius(0, s))
    shape = 1e-6 * (s / pair.path.E) ** 2
    healthy, foundation = evaluate(flexibility, 0.0 * shape)
    again, _ = evaluate(flexibility, 0.0 * shape)
    assert np.array_equal(healthy, again)
    once, worn_foundation = evaluate(flexibility, shape)
    tenth, _ = evaluate(flexibility, 0.1 * shape)
    assert (once - healthy)[80] == pytest.approx(
        10 * (tenth - healthy)[80], rel=1e-2, abs=0
    )
    assert np.array_equal(foundation, worn_foundation)
    # wear of 1e-30 m changes nothing at all: no cancelling terms
    nothing, _ = evaluate(flexibility, 1e-24 * shape)
    assert np.array_equal(nothing, healthy)


def test_micrometres_of_wear_hardly_matter():
    pair = build(RADIAL, RADIAL)
    s = np.linspace(pair.path.A, pair.path.E, 201)
    flexibility = tooth_flexibility(pair.driving, pair.radius(0, s))
    healthy, _ = evaluate(flexibility, np.zeros(201))
    worn, _ = evaluate(flexibility, np.full(201, 3e-6))
    assert np.all(np.abs(worn / healthy - 1) < 3e-3)


def test_equal_gears_are_mirror_images():
    pair = build(RADIAL, RADIAL)
    s = np.linspace(pair.path.A, pair.path.E, 41)
    wear = 50e-6 * (s / pair.path.E) ** 2 * (1 + 0.3 * s / pair.path.E)
    first, body1 = evaluate(tooth_flexibility(pair.driving, pair.radius(0, s)), wear)
    second, body2 = evaluate(
        tooth_flexibility(pair.driven, pair.radius(1, s)), wear[::-1].copy()
    )
    assert first == pytest.approx(second[::-1], rel=1e-11, abs=0)
    assert body1 == pytest.approx(body2[::-1], rel=1e-12, abs=0)


def test_doubled_nodes_hold_both_sides_of_a_jump():
    pair = build()
    s = np.linspace(pair.path.A, pair.path.E, 41)
    doubled = np.insert(s, 20, s[20])
    plain = tooth_flexibility(pair.driving, pair.radius(0, s))
    split = tooth_flexibility(pair.driving, pair.radius(0, doubled))
    wear = np.full(41, 30e-6)
    a, _ = evaluate(plain, wear)
    b, _ = evaluate(split, np.insert(wear, 20, wear[20]))
    assert np.delete(b, 20) == pytest.approx(a, rel=1e-13, abs=0)
    stepped = np.insert(wear, 20, wear[20])
    stepped[21:] = 0.0
    c, _ = evaluate(split, stepped)
    assert c[:21] == pytest.approx(b[:21], rel=1e-13, abs=0)
    assert c[21] > c[20]  # the unworn side carries the load higher up


def test_a_vanished_section_is_reported():
    pair = build()
    s = np.linspace(pair.path.A, pair.path.E, 41)
    flexibility = tooth_flexibility(pair.driving, pair.radius(0, s))
    assert np.isnan(tooth_compliance(flexibility, np.full(41, 3e-3))).any()
    wear = np.zeros(41)
    wear[-1] = 2.5e-3
    assert np.isnan(tooth_compliance(flexibility, wear)).any()


def test_a_section_vanishes_before_its_contact_point_does():
    """Across the tooth wear counts h/cosλ.

    The worn contact point itself still has 2y − h cosλ under it.
    """
    pair = build()
    s = np.linspace(pair.path.A, pair.path.E, 401)
    flexibility = tooth_flexibility(pair.driving, pair.radius(0, s))
    wear = np.zeros(401)
    limit = 2 * flexibility.half_thickness[-1] * np.cos(flexibility.angle[-1])
    wear[-4:] = 0.9 * limit
    assert not np.isnan(tooth_compliance(flexibility, wear)).any()
    wear[-4:] = 1.04 * limit
    assert np.isnan(tooth_compliance(flexibility, wear)).any()


def test_compliance_scales_with_the_face_width_and_not_with_the_module():
    def compliance(module, width):
        pair = gear_pair(
            GearSpec(name="a", teeth=30),
            GearSpec(name="b", teeth=40),
            Basics(module, face_width=width),
        )
        radius = pair.radius(0, np.linspace(pair.path.A, pair.path.E, 21))
        return evaluate(tooth_flexibility(pair.driving, radius), np.zeros(21))[0]

    reference = compliance(0.003, 0.02)
    assert compliance(0.003, 0.002) == pytest.approx(10 * reference, rel=1e-12, abs=0)
    assert compliance(0.03, 0.02) == pytest.approx(reference, rel=1e-11, abs=0)


def test_radii_off_the_involute_are_refused():
    pair = build()
    with pytest.raises(ValueError, match="monotone"):
        tooth_flexibility(pair.driving, [0.074, 0.076, 0.075, 0.077])
    with pytest.raises(ValueError, match="leave the involute"):
        tooth_flexibility(pair.driving, [0.0712, 0.074])


@pytest.mark.parametrize("bore", [0.3, 0.4, 0.5])
def test_single_stiffness_is_near_iso_6336(bore):
    """ISO 6336-1:2006 method B, Eqs. 82–84 and 87: c' = 0.8 / q' for
    standard solid steel gears.
    """
    z = 50
    q = 0.04723 + 0.15551 / z + 0.25791 / z
    single = 0.8 / q * 1e9
    body = {"bore_diameter": bore * 0.1425}
    pair = build(body, body)
    compliance = yang_sun(pair.driving.material, pair.driven.material, pair.face_width)
    for side in (0, 1):
        radius = pair.radius(side, np.linspace(pair.path.A, pair.path.E, 21))
        tooth, foundation = evaluate(
            tooth_flexibility(pair.gears[side], radius), np.zeros(21)
        )
        assert foundation == pytest.approx(
            foundation_compliance(pair.gears[side], radius), rel=1e-14, abs=0
        )
        compliance += tooth[10] + foundation[10]
    assert 14.0e9 < single < 14.5e9
    assert 1.0 / (compliance * pair.face_width) == pytest.approx(
        single, rel=0.18, abs=0
    )

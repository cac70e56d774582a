"""Teeth, body and contact of a ring: against quadrature, Navier's equations, a rack,
and an external twin.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from bodies import body_compliance, foundation_compliance
from scipy.integrate import quad, solve_ivp

from wearlab.gears.outline import (
    contact_depth,
    involute_point,
    involute_rise,
    load_angle,
    root_curve,
)
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import STEEL, Basics, GearSpec
from wearlab.mesh.body import (
    annulus_along,
    arc_tractions,
    arc_work,
    body_coupling,
    foundation_validity,
    line_of_action,
    mode_compliance,
    sainsot_coefficients,
)
from wearlab.mesh.stiffness import WeberContact, yang_sun
from wearlab.mesh.tooth import tooth_compliance, tooth_flexibility


def y23(driving="pinion", **ring):
    return gear_pair(
        GearSpec(name="pinion", teeth=40, bore_diameter=0.112),
        GearSpec(
            **{
                "name": "ring",
                "teeth": 100,
                "tip_alteration": "wang-2023",
                "rim_diameter": 0.7,
                **ring,
            }
        ),
        Basics(0.006, face_width=0.05),
        driving=driving,
        internal=True,
    )


def evaluate(gear, radius, wear=None):
    flexibility = tooth_flexibility(gear, radius)
    tooth = tooth_compliance(
        flexibility, np.zeros(len(radius)) if wear is None else wear
    )
    assert not np.isnan(tooth).any()
    return tooth, flexibility.foundation


def by_quadrature(ring, radius, wear_at=lambda r: 0.0, deepest=None):
    """Integrate M²/EI, κV²/GA and N²/EA over the outline, from the root circle inwards
    to the contact.

    The force (sinλ, −cosλ) acts on the flank at +y of the tooth's centre line; wear
    takes that flank alone.
    """
    lam = float(load_angle(ring, radius))
    h_A = wear_at(radius)
    x_A, y_A = (float(v) for v in involute_point(ring, lam))
    x_A = x_A + h_A * math.sin(lam)
    y_A = y_A - h_A * math.cos(lam)
    E = ring.material.youngs_modulus
    G = ring.material.shear_modulus
    B = ring.face_width

    def energy(x, y, h_y):
        t = 2 * y - h_y
        moment = (x_A - x) * -math.cos(lam) - (y_A + 0.5 * h_y) * math.sin(lam)
        shear = 1.2 * math.cos(lam) ** 2 / (G * B * t)
        return (
            moment**2 / (E * B * t**3 / 12) + shear + math.sin(lam) ** 2 / (E * B * t)
        )

    def on_root(fraction):
        x, y, rise = root_curve(ring, fraction)
        return energy(float(x), float(y), 0.0) * -float(rise)

    def on_flank(angle):
        x, y = (float(v) for v in involute_point(ring, angle))
        r = math.hypot(x, y)
        h_y = (
            wear_at(r) / math.cos(angle)
            if deepest is not None and r <= deepest
            else 0.0
        )
        return energy(x, y, h_y) * float(involute_rise(ring, angle))

    # worn: the last section is where the worn flank's contact lies, x_A deeper than the
    # healthy flank's
    low, high = 0.0, 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if involute_point(ring, middle)[0] < x_A else (low, middle)
        )
    start = float(load_angle(ring, ring.form_radius))
    edges = [start, high]
    if deepest is not None:
        edges = sorted(
            {*edges, max(high, float(load_angle(ring, deepest)))}, reverse=True
        )
    total = quad(on_root, 0, 1, epsabs=0, epsrel=1e-10)[0]
    for above, below in pairwise(edges):
        total += quad(on_flank, below, above, epsabs=0, epsrel=1e-10)[0]
    return total


@pytest.mark.parametrize("root", ["fillet", "radial"])
@pytest.mark.parametrize("driving", ["pinion", "ring"])
def test_healthy_ring_tooth_against_quadrature(driving, root):
    pair = y23(driving, root_profile=root)
    side = [gear.name for gear in pair.gears].index("ring")
    radius = pair.radius(side, np.linspace(pair.path.A, pair.path.E, 41))
    tooth, _ = evaluate(pair.gears[side], radius)
    for i in (0, 13, 40):
        assert tooth[i] == pytest.approx(
            by_quadrature(pair.gears[side], radius[i]), rel=2e-7
        )


def test_worn_ring_tooth_against_quadrature():
    pair = y23()
    ring = pair.driven
    radius = pair.radius(1, np.linspace(pair.path.A, pair.path.E, 401))

    def wear_at(r):
        return 100e-6 + 150e-6 * ((r - 0.3) / 0.006) ** 2

    worn, _ = evaluate(ring, radius, np.array([wear_at(r) for r in radius]))
    healthy, _ = evaluate(ring, radius)
    for i in (20, 150, 300):
        expected = by_quadrature(ring, radius[i], wear_at, radius.max())
        change = expected - by_quadrature(ring, radius[i])
        assert worn[i] - healthy[i] == pytest.approx(change, rel=2e-3)
        assert worn[i] == pytest.approx(expected, rel=1e-5)


def test_order_of_the_path_does_not_matter():
    pair = y23()
    radius = pair.radius(1, np.linspace(pair.path.A, pair.path.E, 21))
    wear = np.linspace(0, 50e-6, 21)
    forth, _ = evaluate(pair.driven, radius, wear)
    back, _ = evaluate(pair.driven, radius[::-1], wear[::-1])
    assert forth == pytest.approx(back[::-1], rel=1e-12)


def rack_of(profile, external):
    """Tooth of 30,000 teeth, as good as a rack, with contacts at four
    heights above its reference line.
    """
    teeth, m = 30_000, 0.004
    reference = 0.5 * m * teeth
    height = m * np.array([-0.8, -0.3, 0.2, 0.7])
    mate = {"teeth": 60, "root_profile": "radial"}
    if external:
        wheel = GearSpec(
            name="wheel",
            teeth=teeth,
            root_profile=None if profile == "fillet" else "radial",
        )
        pair = gear_pair(
            GearSpec(name="pinion", **mate), wheel, Basics(m, face_width=0.03)
        )
        return pair.driven, reference + height
    ring = GearSpec(
        name="ring",
        teeth=teeth,
        rim_diameter=2.2 * reference,
        root_profile=profile,
        tip_alteration_coefficient=-0.1,
    )
    pair = gear_pair(
        GearSpec(name="pinion", **mate), ring, Basics(m, face_width=0.03), internal=True
    )
    return pair.driven, reference - height


@pytest.mark.parametrize("profile", ["fillet", "radial"])
def test_ring_and_wheel_of_very_many_teeth_are_one_rack(profile):
    """Both become straight-sided.

    The rack's rounding leaves a fillet of its own radius on either.
    """
    found = []
    depth = []
    for external in (False, True):
        gear, radius = rack_of(profile, external)
        tooth, _ = evaluate(gear, radius)
        found.append(tooth)
        depth.append(contact_depth(gear, radius))
    assert found[0] == pytest.approx(found[1], rel=2e-3)
    assert depth[0] == pytest.approx(depth[1], rel=2e-3)
    assert found[0][-1] > 2.5 * found[0][0]


def test_ring_tooth_is_stiffer_than_the_same_wheels():
    """A ring's tooth widens towards its root faster than an external
    one of the same numbers.
    """
    ring = y23().driven
    wheel = gear_pair(
        GearSpec(name="pinion", teeth=40),
        GearSpec(name="wheel", teeth=100),
        Basics(0.006, face_width=0.05),
    ).driven
    heights = np.array([-0.004, 0.0, 0.004])
    assert np.all(
        evaluate(ring, 0.3 - heights)[0] < 0.96 * evaluate(wheel, 0.3 + heights)[0]
    )


def test_foundation_of_a_ring():
    ring = y23().driven
    radius = np.array([0.297, 0.303])
    lam = load_angle(ring, radius)
    theta = math.atan2(*[float(v) for v in root_curve(ring, 0.0)[1::-1]])
    L, M, P, Q = sainsot_coefficients(0.35 / 0.3075, theta)
    # where the line of action crosses the centre line, seen from the root circle
    x, y = involute_point(ring, lam)
    u = 0.3075 - (x + y * np.tan(lam))
    S = 2 * 0.3075 * theta
    shape = L * (u / S) ** 2 + M * u / S + P * (1 + Q * np.tan(lam) ** 2)
    expected = np.cos(lam) ** 2 * shape / (STEEL.youngs_modulus * 0.05)
    assert foundation_compliance(ring, radius) == pytest.approx(expected, rel=1e-12)
    assert np.all(u > 0) and u[0] > u[1]
    assert any("h_f = r_rim/r_f = 1.138" in flag for flag in foundation_validity(ring))


def test_mean_stiffness_is_of_the_order_of_iso_6336():
    """c' of ISO 6336-1 method B is 12 to 14.5 N/(mm µm).

    A ring's q is smaller, its c' somewhat larger.
    """
    pair = y23()
    s = np.linspace(pair.path.A, pair.path.E, 101)
    compliance = np.full(101, yang_sun(STEEL, STEEL, 0.05))
    for side, gear in enumerate(pair.gears):
        tooth, foundation = evaluate(gear, pair.radius(side, s))
        compliance += tooth + foundation
    per_width = 1 / compliance / 0.05 * 1e-9
    assert 10.0 < per_width.max() < 25.0
    assert 0.6 < per_width.min() / per_width.max() < 1.0


INNER, OUTER = 0.3075, 0.35


def shooting(n):
    """Inner displacements of mode n under tractions there, from the
    clamped outside inwards (Navier).
    """
    nu = STEEL.poisson_ratio
    mu = STEEL.shear_modulus

    def rates(r, state):
        u, v, s, t = state
        hoop = (u + n * v) / r
        u_rate = s * (1 - nu**2) / STEEL.youngs_modulus - nu * hoop
        sigma_t = STEEL.youngs_modulus * hoop + nu * s
        v_rate = t / mu + (n * u + v) / r
        return [u_rate, v_rate, -(s - sigma_t + n * t) / r, -(2 * t - n * sigma_t) / r]

    ends = [
        solve_ivp(
            rates, (OUTER, INNER), start, method="DOP853", rtol=1e-11, atol=1e-30
        ).y[:, -1]
        for start in ([0, 0, 1e6, 0], [0, 0, 0, 1e6])
    ]
    moved = np.array([e[:2] for e in ends]).T
    stress = np.array([e[2:] for e in ends]).T
    return moved @ np.linalg.inv(-stress)  # the surface faces inwards


def test_modes_of_a_rim_against_navier_equations():
    response = mode_compliance(OUTER, INNER, STEEL, 41)
    for n in (0, 1, 2, 7, 40):
        expected = shooting(n)
        scale = np.abs(expected).max()
        assert response.normal[n] == pytest.approx(expected[0, 0], rel=1e-6)
        assert response.shear[n] == pytest.approx(expected[1, 1], rel=1e-6)
        for mixed in (expected[0, 1], expected[1, 0]):
            assert response.mixed[n] == pytest.approx(mixed, abs=1e-6 * scale)
        assert response.normal[n] > 0 and response.shear[n] > 0


def test_tractions_balance_the_load_of_a_ring():
    ring = y23().driven
    s0, s1, t0 = arc_tractions(ring, line_of_action(ring, np.array([0.299])))[:, 0]
    lam = float(load_angle(ring, 0.299))
    theta = math.atan2(*[float(v) for v in root_curve(ring, 0.0)[1::-1]])
    r = ring.root_radius

    def total(part):
        return quad(
            lambda a: r * part(a, s0 + s1 * a / theta), -theta, theta, epsrel=1e-12
        )[0]

    assert total(lambda a, s: s * math.cos(a) - t0 * math.sin(a)) == pytest.approx(
        math.sin(lam), rel=1e-10
    )
    assert total(lambda a, s: s * math.sin(a) + t0 * math.cos(a)) == pytest.approx(
        -math.cos(lam), rel=1e-10
    )
    assert total(lambda a, s: r * t0) == pytest.approx(-ring.base_radius, rel=1e-10)


def test_body_of_a_ring_is_symmetric_positive_and_softer_when_held_farther_away():
    ring = y23().driven
    own = arc_work(ring, 0 * 2 * math.pi / ring.teeth)
    ahead = arc_work(ring, 1 * 2 * math.pi / ring.teeth)
    assert own == pytest.approx(own.T, abs=1e-12 * own.max())
    assert np.linalg.eigvalsh(np.block([[own, ahead.T], [ahead, own]])).min() > 0
    radius = np.array([0.297, 0.303])
    thick = y23(rim_diameter=0.9).driven
    assert np.all(body_compliance(thick, radius) > body_compliance(ring, radius))
    # the same order as a wheel's body of the same tooth
    assert np.all(
        body_compliance(ring, radius) < 3 * foundation_compliance(ring, radius)
    )


@pytest.mark.parametrize("driving", ["pinion", "ring"])
def test_coupling_of_a_ring(driving):
    pair = y23(driving)
    side = [gear.name for gear in pair.gears].index("ring")
    s = np.array([pair.path.A, pair.path.A + pair.base_pitch])
    first, second = pair.radius(side, s)
    ring = pair.gears[side]
    forth = body_coupling(ring, first, second)
    back = body_coupling(ring, second, first)
    assert forth == pytest.approx(back, rel=1e-13)
    assert 0.0 < forth < 0.6
    # by hand: tractions of both teeth, the neighbour's one pitch towards its loaded
    # flank of a ring the smaller radius is on that side
    low = max(first, second)
    high = min(first, second)
    p = arc_tractions(ring, line_of_action(ring, low))
    q = arc_tractions(ring, line_of_action(ring, high))
    shared = q @ arc_work(ring, 2 * math.pi / ring.teeth) @ p
    own = [t @ arc_work(ring, 0.0) @ t for t in (p, q)]
    assert forth == pytest.approx(shared / math.sqrt(own[0] * own[1]), rel=1e-12)


def test_smaller_radius_of_a_ring_is_on_the_loaded_side():
    """Both teeth on one line of action: place the contacts and look
    which tooth stands where.
    """
    pair = y23()
    ring = pair.driven
    near, far = (
        float(pair.radius(1, s)) for s in (pair.path.A, pair.path.A + pair.base_pitch)
    )
    assert near < far
    # tangent point at angle 0; a tooth's centre line stands λ before it, its loaded
    # flank after the centre
    centres = [-float(load_angle(ring, r)) for r in (near, far)]
    assert centres[0] - centres[1] == pytest.approx(2 * math.pi / ring.teeth, rel=1e-12)


def test_rim_and_wheel_bodies_of_infinite_size_are_one_half_plane():
    """Held equally far from the root line, a ring's and a wheel's
    bodies end in the same strip.
    """
    compliances = []
    for external in (True, False):
        gear, radius = rack_of("radial", external)
        held = gear.root_radius + (-0.02 if external else 0.02)
        compliances.append(
            body_compliance(gear._replace(bore_radius=held), radius[1:2])
        )
    assert compliances[0] == pytest.approx(compliances[1], rel=5e-3)


def test_weber_contact_of_a_ring_flank():
    """Depth along the line of action to the tooth's centre line.

    A concave flank is stiffer.
    """
    pair = y23()
    radius = float(pair.radius(1, 0.0))
    depth = float(contact_depth(pair.driven, radius))
    lam = float(load_angle(pair.driven, radius))
    y = float(involute_point(pair.driven, lam)[1])
    assert depth == pytest.approx(math.hypot(y, y * math.tan(lam)))
    rho = float(pair.equivalent_curvature(0.0))
    depths = np.array([depth, depth])
    concave = WeberContact(rho, depths, (STEEL, STEEL), 0.05).compliance(1e4)
    convex = WeberContact(0.5 * rho, depths, (STEEL, STEEL), 0.05).compliance(1e4)
    assert concave < convex


def test_body_of_choice():
    """The tooth carries whichever body compliance it is given.

    The annulus is the stiffer for a thin rim.
    """
    ring = y23().driven
    radius = np.linspace(0.296, 0.305, 5)
    flexibility = tooth_flexibility(ring, radius, foundation=annulus_along)
    assert flexibility.foundation == pytest.approx(
        body_compliance(ring, radius), rel=1e-15
    )
    assert np.all(flexibility.foundation < 0.8 * foundation_compliance(ring, radius))

import math

import numpy as np
import pytest
from bodies import body_compliance, foundation_compliance
from scipy.integrate import quad, solve_ivp

from wearlab.gears.outline import load_angle, root_half_angle
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import STEEL, Basics, GearSpec
from wearlab.mesh.body import (
    arc_tractions,
    arc_work,
    body_coupling,
    line_of_action,
    mode_compliance,
)

INNER, OUTER = 0.020, 0.070


def pair_of(teeth=50, bore=0.5):
    body = {"bore_diameter": bore * 0.003 * (teeth - 2.5)}
    return gear_pair(
        GearSpec(name="pinion", teeth=teeth, **body),
        GearSpec(name="gear", teeth=teeth, **body),
        Basics(0.003, face_width=0.02),
    )


def shooting(n):
    """Rim displacements of mode n by integrating Navier's equations
    outwards from the clamped bore.
    """
    nu = STEEL.poisson_ratio
    mu = STEEL.shear_modulus
    stiff = STEEL.youngs_modulus / (1 - nu**2)

    def outwards(r, state):
        u, v, s, t = state  # u_r cos, u_θ sin, σ_r cos, τ sin
        hoop = (u + n * v) / r
        u_rate = s / stiff - nu * hoop
        sigma_t = STEEL.youngs_modulus * hoop + nu * s
        v_rate = t / mu + (n * u + v) / r
        s_rate = -(s - sigma_t + n * t) / r
        t_rate = -(2 * t - n * sigma_t) / r
        return [u_rate, v_rate, s_rate, t_rate]

    ends = [
        solve_ivp(
            outwards, (INNER, OUTER), start, method="DOP853", rtol=1e-11, atol=1e-30
        ).y[:, -1]
        for start in ([0, 0, 1e6, 0], [0, 0, 0, 1e6])
    ]
    moved = np.array([e[:2] for e in ends]).T
    loaded = np.array([e[2:] for e in ends]).T
    return moved @ np.linalg.inv(loaded)


def test_modes_against_navier_equations():
    response = mode_compliance(INNER, OUTER, STEEL, 9)
    for n in (0, 1, 2, 3, 8):
        expected = shooting(n)
        scale = np.abs(expected).max()
        assert response.normal[n] == pytest.approx(expected[0, 0], rel=1e-6, abs=0)
        assert response.shear[n] == pytest.approx(expected[1, 1], rel=1e-6, abs=0)
        for mixed in (expected[0, 1], expected[1, 0]):  # Betti: both are the same
            assert response.mixed[n] == pytest.approx(mixed, abs=1e-6 * scale)


def test_short_waves_see_a_half_plane():
    """Flamant: a pressure cos kx sinks 2/(E k) cos kx into a half plane."""
    response = mode_compliance(INNER, OUTER, STEEL, 3001)
    half_plane = 2 * OUTER / (STEEL.youngs_modulus * 3000)
    assert response.normal[3000] == pytest.approx(half_plane, rel=1e-3, abs=0)
    assert response.shear[3000] == pytest.approx(half_plane, rel=1e-3, abs=0)


def test_tractions_balance_the_load():
    gear = pair_of().driving
    radius = 0.0765
    s0, s1, t0 = arc_tractions(gear, line_of_action(gear, np.array([radius])))[:, 0]
    theta = root_half_angle(gear)
    r = gear.root_radius
    lam = float(load_angle(gear, radius))

    def total(part):
        return quad(
            lambda a: r * part(a, s0 + s1 * a / theta), -theta, theta, epsrel=1e-12
        )[0]

    assert total(lambda a, s: s * math.cos(a) - t0 * math.sin(a)) == pytest.approx(
        -math.sin(lam), rel=1e-10, abs=0
    )
    assert total(lambda a, s: s * math.sin(a) + t0 * math.cos(a)) == pytest.approx(
        -math.cos(lam), rel=1e-10, abs=0
    )
    assert total(lambda a, s: r * t0) == pytest.approx(
        -gear.base_radius, rel=1e-10, abs=0
    )


def test_work_of_the_arcs_against_a_plain_fourier_sum():
    """Sum the waves of displacement over the neighbouring arc, then
    integrate traction times displacement.
    """
    gear = pair_of().driving
    theta = root_half_angle(gear)
    r = gear.root_radius
    separation = 2 * math.pi / gear.teeth
    count = 1100
    response = mode_compliance(gear.bore_radius, r, gear.material, count)
    shapes = (lambda a: (1.0, 0.0), lambda a: (a / theta, 0.0), lambda a: (0.0, 1.0))
    nodes, weights = np.polynomial.legendre.leggauss(120)
    angle = theta * nodes
    n = np.arange(1, count)
    expected = np.zeros((3, 3))
    fine, fine_weights = np.polynomial.legendre.leggauss(200)
    for b, shape in enumerate(shapes):
        normal, shear = (
            np.array([shape(a) for a in theta * fine]).T * theta * fine_weights
        )
        turned = np.exp(-1j * np.outer(n, theta * fine)) / math.pi
        s_hat = turned @ normal
        t_hat = turned @ shear
        u_hat = response.normal[1:] * s_hat + 1j * response.mixed[1:] * t_hat
        v_hat = -1j * response.mixed[1:] * s_hat + response.shear[1:] * t_hat
        waves = np.exp(1j * np.outer(angle + separation, n))
        u = (waves @ u_hat).real + response.normal[0] * normal.sum() / (2 * math.pi)
        v = (waves @ v_hat).real + response.shear[0] * shear.sum() / (2 * math.pi)
        for a, observer in enumerate(shapes):
            s, t = np.array([observer(x) for x in angle]).T
            expected[a, b] = np.sum(weights * theta * r * (s * u + t * v))
    assert arc_work(gear, separation) == pytest.approx(
        expected, abs=2e-6 * np.abs(expected).max()
    )


def test_betti_and_positive_energy():
    gear = pair_of().driving
    own, ahead, behind = (
        arc_work(gear, d * 2 * math.pi / gear.teeth) for d in (0, 1, -1)
    )
    assert own == pytest.approx(own.T, abs=1e-12 * own.max())
    assert ahead == pytest.approx(behind.T, abs=1e-12 * own.max())
    assert np.linalg.eigvalsh(np.block([[own, behind], [ahead, own]])).min() > 0


@pytest.mark.parametrize("teeth", [20, 50, 100])
@pytest.mark.parametrize("bore", [0.3, 0.5])
def test_own_compliance_is_near_sainsot(teeth, bore):
    shift = 0.35 if teeth == 20 else 0.0
    pair = gear_pair(
        GearSpec(
            name="a",
            teeth=teeth,
            profile_shift_coefficient=shift,
            bore_diameter=bore * 0.003 * (teeth - 2.5 + 2 * shift),
        ),
        GearSpec(name="b", teeth=60),
        Basics(0.003, face_width=0.02),
    )
    radius = pair.radius(0, np.linspace(pair.path.A, pair.path.E, 5))
    ratio = body_compliance(pair.driving, radius) / foundation_compliance(
        pair.driving, radius
    )
    assert np.all((ratio > 0.90) & (ratio < 1.08))


def test_coupling_is_symmetric_and_one_with_itself():
    pair = pair_of()
    radius = pair.radius(0, np.array([pair.path.A, pair.path.A + pair.base_pitch]))
    forth = body_coupling(pair.driving, radius[0], radius[1])
    back = body_coupling(pair.driving, radius[1], radius[0])
    assert forth == pytest.approx(back, rel=1e-13, abs=0)
    assert 0.3 < forth < 0.6
    assert body_coupling(pair.driving, radius, radius, teeth_apart=0) == pytest.approx(
        1.0, rel=1e-12, abs=0
    )


def test_coupling_of_equal_gears_is_a_mirror_image():
    pair = pair_of()
    s = np.linspace(pair.path.A, pair.path.B, 4)
    first = body_coupling(
        pair.driving, pair.radius(0, s), pair.radius(0, s + pair.base_pitch)
    )
    second = body_coupling(
        pair.driven, pair.radius(1, -s), pair.radius(1, -s - pair.base_pitch)
    )
    assert first == pytest.approx(second, rel=1e-12, abs=0)


def test_coupling_fades_with_distance_and_with_a_large_bore():
    pair = pair_of()
    a, b = pair.radius(0, np.array([pair.path.A, pair.path.A + pair.base_pitch]))
    near = body_coupling(pair.driving, a, b, teeth_apart=1)
    far = body_coupling(pair.driving, a, b, teeth_apart=2)
    assert near > far > 0
    ring = pair_of(bore=0.8)
    assert body_coupling(ring.driving, a, b) < 0.7 * near


def test_three_neighbours_share_a_positive_definite_body():
    pair = pair_of(bore=0.15)
    radius = np.array([0.0725, 0.0745, 0.0775])
    matrix = np.eye(3)
    for i in range(3):
        for j in range(i):
            ratio = body_coupling(pair.driving, radius[j], radius[i], teeth_apart=i - j)
            matrix[i, j] = matrix[j, i] = float(ratio)
    assert np.linalg.eigvalsh(matrix).min() > 0

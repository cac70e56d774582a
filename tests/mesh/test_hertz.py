import math

import numpy as np
import pytest
from scipy.integrate import quad

from wearlab.gears.specification import STEEL, Material
from wearlab.mesh.stiffness import WeberContact, yang_sun

E = STEEL.youngs_modulus
NU = STEEL.poisson_ratio
WEBER = WeberContact(6e-3, np.array([2.4e-3, 2.2e-3]), (STEEL, STEEL), 0.02)


def test_yang_sun_of_equal_materials():
    assert 1 / yang_sun(STEEL, STEEL, 0.02) == pytest.approx(
        math.pi * E * 0.02 / (4 * (1 - NU**2)), rel=1e-14, abs=0
    )


def test_yang_sun_against_a_rigid_mate_is_half():
    rigid = Material(1e30, 0.3, 1.0)
    assert yang_sun(STEEL, rigid, 0.02) == pytest.approx(
        0.5 * yang_sun(STEEL, STEEL, 0.02), rel=1e-12, abs=0
    )
    assert yang_sun(rigid, STEEL, 0.02) == yang_sun(STEEL, rigid, 0.02)


def test_weber_against_the_strain_under_a_hertzian_pressure():
    """Integrate the plane strain on the axis below a Hertzian
    pressure (Johnson 1985, Eqs. 4.46).
    """
    F, rho, t1, t2, B = 1500.0, 6e-3, 2.4e-3, 2.2e-3, 0.02
    a = math.sqrt(8 * F * rho * (1 - NU**2) / (math.pi * B * E))
    p0 = 2 * F / (math.pi * a * B)

    def strain(z):
        across = -p0 / a * ((a * a + 2 * z * z) / math.hypot(a, z) - 2 * z)
        along = -p0 * a / math.hypot(a, z)
        return -((1 - NU**2) * along - NU * (1 + NU) * across) / E

    expected = sum(
        quad(strain, 0, t, epsrel=1e-10, points=[a, 10 * a])[0] for t in (t1, t2)
    )
    assert F * WEBER.compliance(F) == pytest.approx(expected, rel=2e-3, abs=0)


def test_weber_is_about_three_times_softer_than_yang_sun():
    ratio = WEBER.compliance(1500.0) / yang_sun(STEEL, STEEL, 0.02)
    assert 2.5 < ratio < 5.0


def test_weber_falls_with_the_logarithm_of_load_and_stays_finite():
    soft = WEBER.compliance(100.0)
    stiff = WEBER.compliance(10000.0)
    slope = 2 / (math.pi * 0.02) * 2 * (1 - NU**2) / E * 0.5 * math.log(100.0)
    assert soft - stiff == pytest.approx(slope, rel=1e-12, abs=0)
    assert np.isfinite(WEBER.compliance(0.0))
    assert WEBER.compliance(1e12) >= 0.0


def test_weber_keeps_the_share_of_each_material():
    soft = Material(1e11, 0.2, 1.0)
    one = WeberContact(
        6e-3, np.array([2.4e-3, 2.2e-3]), (STEEL, soft), 0.02
    ).compliance(1000.0)
    other = WeberContact(
        6e-3, np.array([2.2e-3, 2.4e-3]), (soft, STEEL), 0.02
    ).compliance(1000.0)
    assert one == pytest.approx(other, rel=1e-14, abs=0)


def test_weber_over_the_nodes():
    force = np.array([10.0, 1000.0])
    radius = np.array([5e-3, 6e-3])
    depth = np.array([[2e-3, 2.4e-3], [3e-3, 2.2e-3]])
    found = WeberContact(radius, depth, (STEEL, STEEL), 0.02).compliance(force)
    for i in range(2):
        assert found[i] == WeberContact(
            radius[i], depth[:, i], (STEEL, STEEL), 0.02
        ).compliance(force[i])

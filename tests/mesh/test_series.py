"""Harmonics, modulation, tables and prescribed errors against closed
forms and NumPy.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from wearlab.mesh.harmonics import MemberError, Modulation, fit, harmonics, mesh_error
from wearlab.mesh.profile import profile_grid
from wearlab.mesh.stiffness import PiecewiseCurve, constant


def test_harmonics_of_a_jump_are_those_of_its_integral(pair):
    grid = profile_grid(pair, 201)
    phase, weight = grid.phase_nodes
    epsilon = pair.contact_ratio - 1
    double = np.repeat([True, False, False], grid.intervals + 1)
    found = harmonics(phase, weight, np.where(double, 5.0, 2.0), 6)
    orders = np.arange(1, 7)
    assert found.mean == pytest.approx(5 * epsilon + 2 * (1 - epsilon), rel=1e-12)
    np.testing.assert_allclose(
        found.amplitude,
        2 * 3 * np.abs(np.sin(np.pi * orders * epsilon)) / (np.pi * orders),
        rtol=1e-4,
    )
    assert found.rms == pytest.approx(3 * np.sqrt(epsilon * (1 - epsilon)), rel=1e-12)


def test_harmonic_series_and_its_rate():
    phase = np.arange(64) / 64
    value = 3 + 2 * np.cos(2 * np.pi * phase + 0.4) - 0.7 * np.sin(6 * np.pi * phase)
    found = harmonics(phase, np.full(64, 1 / 64), value, 4)
    np.testing.assert_allclose(found.value(phase), value, atol=1e-13)
    step = 1e-6
    slope = (found.value(phase + step) - found.value(phase - step)) / (2 * step)
    np.testing.assert_allclose(found.rate(phase), slope, atol=1e-7)


def test_modulation_fit_recovers_its_own_parameters():
    phase = np.arange(128) / 128
    weight = np.full(128, 1 / 128)
    given = Modulation(3e8, 6e7, 0.6, 0.25, -0.8, 0.3, 1.1)
    found = fit(phase, weight, given.value(phase))
    np.testing.assert_allclose(found.value(phase), given.value(phase), rtol=1e-8)
    assert found.am == pytest.approx(0.25, abs=1e-4)
    assert found.fm == pytest.approx(0.3, abs=1e-4)
    step = 1e-6
    slope = (given.value(phase + step) - given.value(phase - step)) / (2 * step)
    np.testing.assert_allclose(given.rate(phase), slope, rtol=1e-6, atol=1e1)


def test_modulating_at_the_mesh_frequency_moves_the_mean():
    given = Modulation(10.0, 2.0, 0.3, 0.5, 0.3, 0.0, 0.0)
    mean, _ = quad(lambda x: float(given.value(x)), 0, 1)
    assert mean == pytest.approx(10.0 + 0.5 * 2.0 * 0.5)


def test_constant_curve_fits_without_modulation():
    phase = np.arange(32) / 32
    weight = np.full(32, 1 / 32)
    assert fit(phase, weight, np.full(32, 7.0)) == Modulation(7.0, 0, 0, 0, 0, 0, 0)


def test_table_jumps_where_an_abscissa_stands_twice():
    curve = PiecewiseCurve(
        np.array([0.0, 0.5, 0.5, 1.0]), np.array([1.0, 1.0, 4.0, 4.0])
    )
    assert curve.jumps == (0.5,)
    at = np.array([0.5, 0.5])
    np.testing.assert_array_equal(curve.value(at, np.array([0.4, 0.6])), [1.0, 4.0])
    assert constant(3.0).value(np.array([0.2]), np.array([0.2]))[0] == 3.0
    with pytest.raises(ValueError, match="descend"):
        PiecewiseCurve(np.array([0.0, 1.0, 0.5]), np.zeros(3))


def test_prescribed_error_and_its_rate():
    error = mesh_error((), ((1, 3e-6, 0.2), (3, 1e-6, -1.0)))
    phase = np.linspace(0, 1, 11)
    expected = 3e-6 * np.sin(2 * np.pi * phase + 0.2) + 1e-6 * np.sin(
        6 * np.pi * phase - 1.0
    )
    np.testing.assert_allclose(error.value(phase), expected, atol=1e-20)
    step = 1e-6
    slope = (error.value(phase + step) - error.value(phase - step)) / (2 * step)
    np.testing.assert_allclose(error.rate(phase), slope, rtol=1e-6, atol=1e-12)


def test_member_errors_have_the_published_amplitudes_and_are_drawn_once():
    members = (MemberError(20, 31e-6, 13e-6, (5e-6,)), MemberError(29, 20e-6, 0.0))
    one = mesh_error(members, seed=4)
    same = mesh_error(members, seed=4)
    other = mesh_error(members, seed=5)
    np.testing.assert_allclose(one.amplitude, [6.5e-6])
    np.testing.assert_allclose(one.slow.amplitude, [9e-6, 5e-6, 10e-6])
    for a, b in ((one, same), (one.slow, same.slow)):
        for field in ("order", "amplitude", "phase"):
            assert np.array_equal(getattr(a, field), getattr(b, field))
    assert not np.array_equal(one.slow.phase, other.slow.phase)
    turned = np.array([0.0, 20.0, 7.3])
    assert one.slow.value(turned[:1])[0] != pytest.approx(one.slow.value(turned[2:])[0])
    step = 1e-5
    slope = (one.slow.value(turned + step) - one.slow.value(turned - step)) / (2 * step)
    np.testing.assert_allclose(one.slow.rate(turned), slope, rtol=1e-6)
    # ½ f_i′ sin(z θ): the mesh-order part of Eq. 28 with θ = 2π φ / z + θ0
    start = one.slow.phase[0]
    phase = np.linspace(0, 1, 7)
    np.testing.assert_allclose(
        one.value(phase),
        6.5e-6 * np.sin(20 * (2 * np.pi * phase / 20 + start)),
        atol=1e-18,
    )

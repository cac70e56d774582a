import numpy as np
import pytest
from scipy.integrate import quad

from wearlab.wear import law as wear_law
from wearlab.wear.law import FlankLaw, WearLaw, prepare, wear_rate
from wearlab.wear.path import contact_half_width, mean_pressure, peak_pressure
from wearlab.wear.pressures.peak import PeakPressure
from wearlab.wear.projections.normal import NormalProjection
from wearlab.wear.projections.over_cosine import OverCosine
from wearlab.wear.setting import PowerOfLoad


def constant(k, factor=1.0):
    return FlankLaw(PowerOfLoad(np.full(201, k), 0.0), factor)


def test_hertz_pressure_carries_the_load(l16):
    _, path = l16
    force = np.linspace(0.0, 5000.0, path.curvature.shape[1])
    a = contact_half_width(force, path)
    p0 = peak_pressure(force, path)
    i = 120
    carried = quad(lambda x: p0[i] * np.sqrt(1.0 - (x / a[i]) ** 2), -a[i], a[i])[0]
    assert carried == pytest.approx(force[i] / path.face_width, rel=1e-9, abs=0.0)
    assert mean_pressure(force, path) * 2.0 * a * path.face_width == pytest.approx(
        force, rel=1e-6, abs=0.0
    )
    assert peak_pressure(force, path)[1:] / mean_pressure(force, path)[
        1:
    ] == pytest.approx(4.0 / np.pi, rel=1e-6, abs=0.0)
    assert (a[0], p0[0], mean_pressure(force, path)[0]) == (0.0, 0.0, 0.0)


def test_hertz_by_hand(l16):
    """At the pitch point: ρ = 25.652 mm each, R' = 12.826 mm, w = 250
    N/mm, E* = 113.19 GPa.
    """
    _, path = l16
    i = 100
    w = 5000.0 / 20e-3
    assert path.equivalent_radius[i] == pytest.approx(
        0.5 * 0.075 * np.sin(np.radians(20.0)), rel=1e-12, abs=0.0
    )
    assert path.contact_modulus == pytest.approx(
        206e9 / (2 * (1 - 0.09)), rel=1e-12, abs=0.0
    )
    expected = np.sqrt(4 * w * path.equivalent_radius[i] / (np.pi * 113.1868e9))
    assert contact_half_width(np.full(201, 5000.0), path)[i] == pytest.approx(
        expected, rel=1e-6, abs=0.0
    )
    assert expected == pytest.approx(0.18992e-3, rel=1e-3, abs=0.0)


def test_one_pass_is_archard_integrated_over_the_passing_contact(l16):
    """∫ k p |v1 − v2| dt over the time 2a/v that the contact needs to pass."""
    _, path = l16
    force, k, i = 3000.0, 1e-18, 20
    a = contact_half_width(np.full(201, force), path)[i]
    p0 = peak_pressure(np.full(201, force), path)[i]
    for gear in (0, 1):
        v = path.surface_velocity[gear, i]
        other = path.surface_velocity[1 - gear, i]
        half_time = a / v
        worn = quad(
            lambda t, v=v, other=other: (
                k * p0 * np.sqrt(1 - (v * t / a) ** 2) * abs(v - other)
            ),
            -half_time,
            half_time,
            epsabs=0.0,
        )[0]
        rate = wear_rate(
            prepare(WearLaw((constant(k), constant(k))), path), np.full(201, force)
        )
        assert rate[gear, i] == pytest.approx(worn, rel=1e-8, abs=0.0)


def test_kernel_against_numpy_with_unequal_gears(make_path):
    _, path = make_path(25, 40)
    rng = np.random.default_rng(1)
    force = rng.uniform(0, 1e3, 201)
    k = rng.uniform(1e-19, 1e-18, (2, 201))
    found = wear_law.wear_per_cycle(
        force, k, path.slide_ratio, path.passes, path.face_width
    )
    expected = np.array([1.0, 25 / 40])[:, None] * k * force / 20e-3 * path.slide_ratio
    assert found == pytest.approx(expected, rel=1e-14, abs=0.0)


def test_static_wear_closed_form_and_its_symmetry(l16):
    """Equal gears under equal load: each flank is the mirror image of the other.

    H(A)/h(E) from ρ alone.
    """
    s, path = l16
    rate = wear_rate(
        prepare(WearLaw((constant(2e-18), constant(2e-18))), path), np.full(201, 1000.0)
    )
    rho = 0.075 * np.sin(np.radians(20.0))
    assert rate[0] == pytest.approx(
        2e-18 * (1000.0 / 20e-3) * np.abs(2 * s / (rho + s)), rel=1e-9, abs=0.0
    )
    assert rate[0] == pytest.approx(rate[1, ::-1], rel=1e-9, abs=0.0)
    assert rate[0, 100] == pytest.approx(0.0, abs=1e-25)


def test_options_are_their_factors(l16):
    _, path = l16
    force = np.full(201, 1000.0)
    parts = (constant(1e-18), constant(1e-18, factor=3.0))
    plain = wear_rate(prepare(WearLaw(parts), path), force)
    peak = wear_rate(
        prepare(WearLaw(parts, pressure_factor=PeakPressure.factor), path), force
    )
    cosine = wear_rate(prepare(WearLaw(parts, projection=OverCosine()), path), force)
    assert peak == pytest.approx(4 / np.pi * plain, rel=1e-6, abs=0.0)
    radius = np.hypot(path.curvature[0], 0.075 * np.cos(np.radians(20.0)))
    assert cosine[0] == pytest.approx(
        plain[0] * radius / (0.075 * np.cos(np.radians(20.0))), rel=1e-6, abs=0.0
    )
    assert np.array_equal(NormalProjection().factor(path), np.ones((2, 201)))
    assert plain[1] == pytest.approx(3.0 * plain[0, ::-1], rel=1e-6, abs=0.0)


def test_over_cosine_overstates_by_what_physics_says(make_path):
    """PHYSICS §1 for W23: 4 % at its pitch point, α_w = 23.534° there would be 9 %.

    At 20° it is 6 %.
    """
    _, path = make_path()
    assert OverCosine().factor(path)[0, 100] == pytest.approx(
        1.0 / np.cos(np.radians(20.0)), rel=1e-9, abs=0.0
    )

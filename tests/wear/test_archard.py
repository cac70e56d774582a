import numpy as np
import pytest
from scenes import CAMPAIGNS
from scipy.integrate import quad

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.wear import law as wear_law
from wearlab.wear.law import FlankLaw, WearLaw, prepare, wear_rate
from wearlab.wear.path import contact_half_width, mean_pressure, peak_pressure
from wearlab.wear.pressures.peak import PeakPressure
from wearlab.wear.projections.normal import NormalProjection
from wearlab.wear.projections.over_cosine import OverCosine
from wearlab.wear.setting import PowerOfLoad

PLANETARY_AS_PUBLISHED = (
    load(CAMPAIGNS / "planetary_excitation_as_published.toml").cases[0].scene
)


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
    assert np.array_equal(cosine, plain)  # the depth that is counted is the normal one
    assert np.array_equal(NormalProjection().factor(path), np.ones((2, 201)))
    assert plain[1] == pytest.approx(3.0 * plain[0, ::-1], rel=1e-6, abs=0.0)


def test_over_cosine_overstates_by_what_physics_says():
    """PHYSICS §1 for W23's sun as published: 4 % at the pitch point, 15 % at the tip.

    The load angle there is the pressure angle less half the tooth's angle.
    """
    sun = build(PLANETARY_AS_PUBLISHED).gears.gears["sun"]
    at_pitch_point = np.radians(20.0) - np.pi / 40
    radius = np.array([22.5e-3, sun.tip_radius])
    pitch, tip = OverCosine().felt(sun, radius)
    assert pitch == pytest.approx(1.0 / np.cos(at_pitch_point), rel=1e-9)
    assert (pitch, tip) == pytest.approx((1.038, 1.149), abs=5e-4)


def test_over_cosine_is_felt_by_the_mesh_and_not_counted():
    """Of two flanks worn alike the gap of one is the other's over the cosine."""
    scene = PLANETARY_AS_PUBLISHED
    normal = scene.replace("wear.projection", "normal")
    felt, plain = (build(one).kinds[0].analysis for one in (scene, normal))
    position = plain.grid.position
    depth = np.stack([np.full_like(position, 1e-5), np.zeros_like(position)])
    stretched, gap = (one.nodes(depth).gap for one in (felt, plain))
    at_c = np.argmin(np.abs(plain.grid.contact_position))
    assert stretched[at_c] / gap[at_c] == pytest.approx(
        1.0 / np.cos(np.radians(20.0) - np.pi / 40), rel=1e-6
    )

"""Every choice of a spur scene against a calculation of its own: closed forms, SciPy,
or another choice.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wearlab.schema import VARIABLES
from wearlab.simulation import simulate

K0 = 9.65e-19
TORQUE = 340.0
BASE_RADIUS = 0.5 * 0.150 * np.cos(np.radians(20))
FORCE = TORQUE / BASE_RADIUS
FACE_WIDTH = 0.020
E_STAR = 206e9 / (2 * (1 - 0.3**2))
TILT = BASE_RADIUS * np.tan(np.radians(20))


def sliding(s):
    """|1 − v_other/v_own| of pinion and gear, equal gears, (2, n)."""
    rho = np.stack([TILT + s, TILT - s])
    return np.abs(1.0 - rho[::-1] / rho)


def test_every_variable_is_declared_and_described(run):
    for label in ("base case", "quasi-static", "fourier", "tooth errors"):
        for name, values in run(label).variables.items():
            if name in VARIABLES:
                declared = VARIABLES[name].dims
                shared = declared[1:] if name == "characteristic_point" else declared
                assert values.dims == shared
                assert values.attrs["long_name"]
                if values.dtype.kind == "f":
                    assert values.attrs["units"] and values.attrs["display_units"]


def test_absent_parts_are_not_stored(run):
    names = set(run("quasi-static").variables)
    assert (
        not {"dynamic_mesh_force", "natural_frequency", "response_period", "pair_force"}
        & names
    )
    assert "bearing_force" not in run("torsional") and "bearing_force" in run(
        "base case"
    )
    assert "excitation_error" not in run("base case") and "excitation_error" in run(
        "fourier"
    )


@pytest.mark.parametrize(
    "label",
    [
        "base case",
        "quasi-static",
        "fourier",
        "shared bodies",
        "rk45 (as published, L16)",
    ],
)
def test_wear_rate_is_archards_for_the_force_on_the_tooth(run, label):
    data = run(label).isel(update=0)
    s = data.path_position.values[0]
    expected = K0 / FACE_WIDTH * data.tooth_force.values * sliding(s)
    np.testing.assert_allclose(data.wear_rate, expected, rtol=1e-10, atol=1e-24)


def test_static_wear_of_equal_pairs_has_a_closed_form(scene):
    static = scene("quasi-static").replace(
        "mesh.stiffness", {"model": "constant", "value": "2.4e8 N/m"}
    )
    data = simulate(
        static.replace("wear.until.cycles", 10.0).replace("wear.snapshots", None)
    )
    s = data.path_position.values[0]
    a = s[0]
    e = s[-1]
    single = (
        np.arange(len(s))
        > np.flatnonzero(np.isclose(s, e - 8.856394302280649e-3, atol=1e-12))[0]
    ) & (
        np.arange(len(s))
        < np.flatnonzero(np.isclose(s, a + 8.856394302280649e-3, atol=1e-12))[-1]
    )
    load = np.where(single, FORCE, FORCE / 2)
    expected = 10.0 * K0 * load / FACE_WIDTH * sliding(s)
    np.testing.assert_allclose(
        data.wear_depth.isel(update=-1), expected, rtol=1e-6, atol=1e-22
    )
    assert (
        data.wear_depth.isel(update=-1)
        .sel(flank="pinion")
        .values[data.characteristic_point == "C"]
        == 0.0
    )


def march(stiffness, error, rate, speed=1100.0):
    """Integrate L16's Eq. 1–6 by SciPy until steady.

    Return phases and elastic force over the last period.
    """
    period = 60.0 / (speed * 50)
    mass, k_y, c_y, c_m = 2.8, 1.15e9, 5360.0, 1000.0
    m_c = 7.3e-3 / (2 * BASE_RADIUS**2)

    def derivative(t, z):
        phase = (t / period) % 1.0
        y_p, y_g, x, v_p, v_g, v_x = z
        delta = x + y_p - y_g - error(phase)
        speed = v_x + v_p - v_g - rate(phase) / period
        elastic = stiffness(phase) * max(delta, 0.0)
        total = elastic + c_m * speed * (delta > 0.0)
        return [
            v_p,
            v_g,
            v_x,
            (-total - c_y * v_p - k_y * y_p) / mass,
            (total - c_y * v_g - k_y * y_g) / mass,
            (FORCE - total) / m_c,
        ]

    state = np.array([-FORCE / k_y, FORCE / k_y, 2.5e-5, 0.0, 0.0, 0.0])
    phases = np.arange(256) / 256
    edges = [0.0, 0.7546732846981, 1.0]
    for count in range(30):  # free motions die out as exp(-0.7 n)
        pieces = []
        for low, high in pairwise(edges):
            inside = phases[(phases >= low) & (phases < high)]
            solved = solve_ivp(
                derivative,
                (low * period * (1 + 1e-14), high * period * (1 - 1e-14)),
                state,
                method="DOP853",
                rtol=1e-8,
                atol=1e-13,
                t_eval=np.clip(inside, low + 1e-13, None) * period,
                dense_output=False,
            )
            last = solve_ivp(
                derivative,
                (solved.t[-1], high * period * (1 - 1e-14)),
                solved.y[:, -1],
                method="DOP853",
                rtol=1e-8,
                atol=1e-13,
            )
            state = last.y[:, -1]
            pieces.append(solved.y)
        if count == 29:
            y = np.concatenate(pieces, axis=1)
    delta = y[2] + y[0] - y[1] - np.array([error(p) for p in phases])
    return np.array([stiffness(p) for p in phases]) * np.maximum(delta, 0.0)


def test_dynamics_of_pairs_agree_with_scipy(run):
    """A different stiffness in double and single contact, jumps included, no wear:
    SciPy with its own law.
    """
    data = run("constant pair stiffness").isel(update=0, mesh=0, mesh_period=0)
    force = march(
        lambda p: 4.8e8 if p < 0.7546732846981 else 2.4e8, lambda p: 0.0, lambda p: 0.0
    )
    np.testing.assert_allclose(data.dynamic_mesh_force, force, atol=1e-3 * force.max())


def interpolated(samples):
    """Trigonometric interpolation of band-limited samples, and its derivative."""
    coefficient = np.fft.rfft(samples) / len(samples)
    orders = np.arange(len(coefficient))
    coefficient[1:] *= 2
    keep = np.abs(coefficient) > 1e-9 * np.abs(coefficient).max()
    c = coefficient[keep]
    n = orders[keep]
    return (
        lambda p: float(np.real(c @ np.exp(2j * np.pi * n * p))),
        lambda p: float(np.real((2j * np.pi * n * c) @ np.exp(2j * np.pi * n * p))),
    )


@pytest.mark.parametrize(
    "label", ["fourier", "modulated (as published, L16 Eqs. 10-13)"]
)
def test_dynamics_of_series_agree_with_scipy(run, label):
    data = run(label).isel(update=-1, mesh=0, mesh_period=0)
    stiffness, _ = interpolated(data.excitation_stiffness.values)
    error, rate = interpolated(data.excitation_error.values)
    force = march(stiffness, error, rate)
    np.testing.assert_allclose(data.dynamic_mesh_force, force, atol=2e-3 * force.max())
    assert np.abs(data.excitation_error.values).max() > 1e-7


@pytest.mark.parametrize(
    ("label", "closeness"),
    [("rk4", 1e-3), ("rk45 (as published, L16)", 1e-3), ("newmark", 1.5e-2)],
)
def test_methods_agree_with_shooting(run, label, closeness):
    one = run("base case")
    other = run(label)
    scale = float(one.dynamic_mesh_force.max())
    difference = np.abs(one.dynamic_mesh_force - other.dynamic_mesh_force).max()
    assert difference < closeness * scale
    np.testing.assert_allclose(
        other.max_wear_depth.isel(update=-1),
        one.max_wear_depth.isel(update=-1),
        rtol=closeness,
    )


def test_equivalent_load_is_miners_sum_of_the_stored_force(run):
    data = run("equivalent load (as published, L16 Eq. 25)").isel(mesh=0, mesh_period=0)
    force = data.pair_normal_force.sum("pair").values
    expected = np.mean(force**6.61, axis=1) ** (1 / 6.61) * BASE_RADIUS
    np.testing.assert_allclose(data.equivalent_load, expected, rtol=3e-3)
    assert np.all(data.equivalent_load > TORQUE)
    single = np.isclose(data.path_position[0], 5e-4, atol=4e-5)
    np.testing.assert_allclose(
        data.tooth_force.values[:, 0, single] * BASE_RADIUS,
        np.broadcast_to(data.equivalent_load.values[:, None], (3, single.sum())),
        rtol=1e-9,
    )


def test_static_load_wears_the_same_with_and_without_vibration(run):
    one = run("static load under vibration")
    other = run("quasi-static")
    np.testing.assert_array_equal(one.wear_depth, other.wear_depth)


def test_film_lowers_the_coefficient_by_lambda(scene):
    thick = (
        scene("quasi-static")
        .replace("lubricant.viscosity", "0.1 Pa*s")
        .replace("wear.snapshots", None)
    )
    thick = thick.replace("wear.until", None)
    data = simulate(thick).isel(update=0)
    s = data.path_position.values[0]
    omega = 1100 * 2 * np.pi / 60
    force = data.tooth_force.values[0]
    radius = (TILT + s) * (TILT - s) / (2 * TILT)
    E = 2 * E_STAR
    U = 0.1 * TILT * omega / (E * radius)
    film = (
        2.65
        * radius
        * U**0.70
        * (1.6e-8 * E) ** 0.54
        * (force / FACE_WIDTH / (E * radius)) ** -0.13
    )
    np.testing.assert_allclose(data.film_thickness[0], film, rtol=1e-9)
    ratio = film / (1.25 * 0.3e-6 * np.sqrt(2))
    np.testing.assert_allclose(data.lambda_ratio[0], ratio, rtol=1e-9)
    assert ratio.min() < 4.0 and ratio.max() > 0.6
    np.testing.assert_allclose(
        data.effective_wear_coefficient[1],
        K0 * np.clip(2 / 7 * (4 - ratio), 0, 1),
        rtol=1e-9,
        atol=1e-40,
    )


def test_coefficients(run):
    assert np.all(run("no film").effective_wear_coefficient == K0)
    np.testing.assert_allclose(
        run("hardness").effective_wear_coefficient, 1e-9 / 2e9, rtol=1e-12
    )
    data = run("regression").isel(update=0)
    s = data.path_position.values[0]
    force = data.tooth_force.values[0]
    R = (TILT + s) * (TILT - s) / (2 * TILT)
    L = force / FACE_WIDTH / (E_STAR * R)
    G = 1.6e-8 * E_STAR
    S = 0.3e-6 * np.sqrt(2) / R
    k = 3.981e29 / E_STAR * L**1.219 * G**-7.377 * S**1.589
    film = np.clip(2 / 7 * (4 - data.lambda_ratio.values[0]), 0, 1)
    np.testing.assert_allclose(data.effective_wear_coefficient[0], k * film, rtol=1e-9)


def test_pressure_projection_and_width(run):
    base = run("base case").isel(update=0)
    peak = run("peak pressure").isel(update=0)
    np.testing.assert_allclose(peak.wear_rate, 4 / np.pi * base.wear_rate, rtol=1e-12)
    np.testing.assert_allclose(
        peak.contact_pressure, 4 / np.pi * base.contact_pressure, rtol=1e-12
    )
    hertz = (
        np.sqrt(base.tooth_force[0] / FACE_WIDTH * E_STAR / np.pi / _equivalent(base))
        * np.pi
        / 4
    )
    np.testing.assert_allclose(base.contact_pressure[0], hertz, rtol=1e-9)
    of_line = (
        4 * base.tooth_force[0] * _equivalent(base) / (np.pi * E_STAR * FACE_WIDTH)
    )
    np.testing.assert_allclose(base.contact_half_width[0], np.sqrt(of_line), rtol=1e-9)
    published = run("over-cosine (as published, W23 Eq. 33)").isel(update=0)
    np.testing.assert_allclose(published.wear_rate, base.wear_rate, rtol=1e-12)
    averaged = run("averaged over the contact width")
    at_pitch_point = averaged.characteristic_point.values == "C"
    assert np.all(averaged.wear_rate.isel(update=0).values[:, at_pitch_point] > 0)
    assert np.all(base.wear_rate.values[:, at_pitch_point] == 0)


def _equivalent(data):
    s = data.path_position.values[0]
    return (TILT + s) * (TILT - s) / (2 * TILT)


def test_worn_before_keeps_the_law_s_profile(run):
    data = run("worn before")
    start = data.wear_depth.isel(update=0)
    assert float(start.sel(flank="pinion").max()) == pytest.approx(
        3e-6, rel=1e-9, abs=0
    )
    assert float(start.sel(flank="gear").max()) == 0.0
    assert (
        float(start.sel(flank="pinion")[data.characteristic_point.values == "C"][0])
        == 0.0
    )


def test_euler_is_first_order_and_adaptive_beats_it(run):
    base = float(run("base case").max_wear_depth[-1, 0])
    euler = run("Euler steps (as published, L16 Eq. 22)")
    assert 1e-4 < abs(float(euler.max_wear_depth[-1, 0]) / base - 1) < 2e-2


def test_reliefs_are_what_a_measuring_machine_prints(run):
    data = run("tip relief").isel(update=0)
    s = data.path_position.values[0]
    tip = np.clip((s - s[-1]) / 3e-3 + 1, 0, None)
    np.testing.assert_allclose(
        data.flank_deviation.sel(flank="pinion"), -12e-6 * tip, atol=1e-12
    )
    own_tip = np.clip((s[0] - s) / 3e-3 + 1, 0, None)
    np.testing.assert_allclose(
        data.flank_deviation.sel(flank="gear"), -12e-6 * own_tip**2, atol=1e-12
    )
    assert float(data.dynamic_factor[0]) < float(run("base case").dynamic_factor[0, 0])


def test_driving_from_the_other_side_swaps_the_flanks(run):
    base = run("base case")
    other = run("driven by the gear, left flanks")
    np.testing.assert_allclose(
        other.wear_depth.sel(flank="pinion"),
        base.wear_depth.sel(flank="gear"),
        rtol=1e-6,
        atol=1e-14,
    )
    assert list(other.flank_side.values) == ["left", "left"]
    assert list(base.flank_side.values) == ["right", "right"]


def test_softer_and_stiffer_meshes(run, scene):
    mean = {
        label: float(run(label).stiffness_mean[0, 0])
        for label in (
            "base case",
            "load-dependent contact",
            "shared bodies",
            "rigid bodies",
            "trochoid root",
        )
    }
    assert mean["load-dependent contact"] < mean["base case"] < mean["rigid bodies"]
    assert mean["shared bodies"] < mean["base case"]
    standard = (
        scene("trochoid root")
        .replace("wear.snapshots", None)
        .replace("wear.until", None)
    )
    for gear in ("pinion", "gear"):
        standard = standard.replace(f"gears.{gear}.root_profile", "radial")
    involute_to_the_root = float(simulate(standard).stiffness_mean[0, 0])
    assert mean["base case"] / involute_to_the_root == pytest.approx(
        0.78, abs=0.03
    )  # PHYSICS §2: −22 %
    assert involute_to_the_root < mean["trochoid root"]


def test_errors_fluctuation_and_hunting(run):
    errors = run("tooth errors")
    weight = errors.error_weight.values
    slow = errors.slow_error.values[0]
    assert weight.sum() == pytest.approx(1.0)
    assert np.sqrt(weight @ slow**2) == pytest.approx(
        7e-6 / np.sqrt(2), rel=1e-9, abs=0
    )
    base = run("base case")
    mesh_part = (
        errors.unloaded_transmission_error[0, 0]
        - base.unloaded_transmission_error[0, 0]
    )
    assert float(np.ptp(mesh_part.values)) == pytest.approx(6e-6, rel=1e-3, abs=0)
    hunting = run("hunting errors")
    assert (
        list(hunting.response_period.values) == [50, 50, 50]
        and hunting.sizes["mesh_period"] == 50
    )
    rotating = np.ptp(hunting.dynamic_transmission_error[0, 0].mean("phase").values)
    assert rotating == pytest.approx(14e-6, rel=0.05, abs=0)
    fluctuating = run("fluctuating torque")
    assert (
        float(np.abs(fluctuating.dynamic_mesh_force - base.dynamic_mesh_force).max())
        > 50.0
    )


def test_torsional_pair_has_its_natural_frequency(run):
    data = run("torsional")
    m_c = 7.3e-3 / (2 * BASE_RADIUS**2)
    expected = np.sqrt(float(data.stiffness_mean[0, 0]) / m_c) / (2 * np.pi)
    assert float(data.natural_frequency[0]) == pytest.approx(expected, rel=1e-9)
    assert float(data.critical_speed[0]) == pytest.approx(
        2 * np.pi * expected / 50, rel=1e-9
    )


def test_invariants_close_in_every_run(run, scene):
    for label in (
        "base case",
        "fourier",
        "shared bodies",
        "torsional",
        "damping always (as published)",
        "tip relief",
    ):
        data = run(label)
        assert float(np.abs(data.residual_mean_force).max()) < 1e-4
        assert float(data.residual_load_share.max()) < 1e-12
        assert np.all(np.diff(data.wear_depth, axis=0) >= 0)


def test_supports_push_back_and_one_branch_is_one_attractor(run):
    data = run("base case")
    held = data.bearing_force.sel(axis="y").mean("phase").isel(update=0, mesh_period=0)
    np.testing.assert_allclose(
        held, [FORCE, -FORCE], rtol=1e-3
    )  # the driving gear pushes the driven along +y
    assert np.all(data.bearing_force.sel(axis="x") == 0.0)
    assert list(data.attractor.values) == [1.0, 1.0, 1.0]

"""The planetary model with translations: published matrices, an inertial frame, and
what may not float.
"""

from typing import Any

import numpy as np
import pytest
from planetary_arguments import rigid_set, translating
from scipy.integrate import solve_ivp

from wearlab.dynamics.modes import mode_kinds, modes, natural_frequencies
from wearlab.dynamics.rigid import balanced_torques
from wearlab.dynamics.system import System

ALPHA = np.deg2rad(24.6)
RADIUS = {"sun": 38.71e-3, "ring": 137.515e-3, "planet": 50.175e-3}
PIN = 88.4e-3
EQUIVALENT = {"sun": 0.39, "ring": 3.0, "carrier": 6.29, "planet": 0.61}
"""I/r² [kg]; with the other values a set of the size that Lin & Parker (1999) look
at."""
MESH = {"sun_planet": 5e8, "planet_ring": 5e8}


def lin_parker(angles: Any = 3, **changes: Any) -> System:
    if isinstance(angles, int):
        angles = 2 * np.pi * np.arange(angles) / angles
    radius = RADIUS | {"carrier": PIN}
    mass = {"sun": 0.4, "ring": 2.35, "carrier": 5.43, "planet": 0.66}
    inertia = {
        member: value * radius[member] ** 2 for member, value in EQUIVALENT.items()
    }
    alpha = changes.pop("pressure_angle", {"sun_planet": ALPHA, "planet_ring": ALPHA})
    given: dict[str, Any] = {
        "rigid": rigid_set(mass, inertia, RADIUS, PIN, alpha, angles),
        "radial_stiffness": dict.fromkeys(("sun", "ring", "carrier", "planet"), 1e8),
        "tangential_stiffness": {"ring": 1e9},
    }
    return translating(**(given | changes))


def lin_parker_matrices(
    angles: np.ndarray, alpha: dict[str, float], mesh: dict[str, float]
) -> Any:
    """M and K as Lin & Parker (1999) print them, block by block.

    Order carrier, ring, sun, planets; a planet moves along ζ (outwards) and η
    (tangentially) of its own place, so that neither coordinates nor blocks are those of
    the code under test.
    """
    a_s = alpha["sun_planet"]
    a_r = alpha["planet_ring"]
    k_s = mesh["sun_planet"]
    k_r = mesh["planet_ring"]
    k_p = 1e8
    n = 3 * (len(angles) + 3)
    stiffness = np.zeros((n, n))
    stiffness[:9, :9] += np.diag([1e8, 1e8, 0.0, 1e8, 1e8, 1e9, 1e8, 1e8, 0.0])
    s = np.sin
    c = np.cos
    for number, psi in enumerate(angles):
        p_s = psi - a_s
        p_r = psi + a_r
        at = slice(9 + 3 * number, 12 + 3 * number)
        c1 = k_p * np.array([[1, 0, -s(psi)], [0, 1, c(psi)], [-s(psi), c(psi), 1]])
        c2 = k_p * np.array([[-c(psi), s(psi), 0], [-s(psi), -c(psi), 0], [0, -1, 0]])
        r1 = k_r * np.array(
            [
                [s(p_r) ** 2, -s(p_r) * c(p_r), -s(p_r)],
                [-s(p_r) * c(p_r), c(p_r) ** 2, c(p_r)],
                [-s(p_r), c(p_r), 1],
            ]
        )
        r2 = k_r * np.array(
            [
                [-s(p_r) * s(a_r), s(p_r) * c(a_r), s(p_r)],
                [c(p_r) * s(a_r), -c(p_r) * c(a_r), -c(p_r)],
                [s(a_r), -c(a_r), -1],
            ]
        )
        r3 = k_r * np.array(
            [
                [s(a_r) ** 2, -s(a_r) * c(a_r), -s(a_r)],
                [-s(a_r) * c(a_r), c(a_r) ** 2, c(a_r)],
                [-s(a_r), c(a_r), 1],
            ]
        )
        s1 = k_s * np.array(
            [
                [s(p_s) ** 2, -s(p_s) * c(p_s), -s(p_s)],
                [-s(p_s) * c(p_s), c(p_s) ** 2, c(p_s)],
                [-s(p_s), c(p_s), 1],
            ]
        )
        s2 = k_s * np.array(
            [
                [s(p_s) * s(a_s), s(p_s) * c(a_s), -s(p_s)],
                [-c(p_s) * s(a_s), -c(p_s) * c(a_s), c(p_s)],
                [-s(a_s), -c(a_s), 1],
            ]
        )
        s3 = k_s * np.array(
            [
                [s(a_s) ** 2, s(a_s) * c(a_s), -s(a_s)],
                [s(a_s) * c(a_s), c(a_s) ** 2, -c(a_s)],
                [-s(a_s), -c(a_s), 1],
            ]
        )
        for member, (own, cross) in enumerate(((c1, c2), (r1, r2), (s1, s2))):
            central = slice(3 * member, 3 * member + 3)
            stiffness[central, central] += own
            stiffness[central, at] += cross
            stiffness[at, central] += cross.T
        stiffness[at, at] += np.diag([k_p, k_p, 0.0]) + r3 + s3
    masses = [
        5.43,
        5.43,
        6.29,
        2.35,
        2.35,
        3.0,
        0.4,
        0.4,
        0.39,
        *[0.66, 0.66, 0.61] * len(angles),
    ]
    return np.diag(masses), stiffness


@pytest.mark.parametrize(
    "angles",
    [
        [0, 120, 240],
        [0, 90, 180, 270],
        [0, 72, 144, 216, 288],
        [10, 110, 225],
        [0, 100, 180, 280],
    ],
)
def test_natural_frequencies_of_the_matrices_of_lin_and_parker(
    angles: list[float],
) -> None:
    alpha = {"sun_planet": 0.43, "planet_ring": 0.36}
    mesh = {"sun_planet": 5e8, "planet_ring": 7e8}
    mass, stiffness = lin_parker_matrices(np.deg2rad(angles), alpha, mesh)
    square = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    expected = np.sqrt(np.maximum(square, 0.0)) / (2 * np.pi)
    system = lin_parker(np.deg2rad(angles), pressure_angle=alpha)
    found = natural_frequencies(system, mesh)
    assert found[0] == 0.0 and expected[0] < 0.1  # the free rotation
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-9)
    assert mode_kinds(system, modes(system, mesh)).count("rigid-body") == 1


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
def test_kinds_count_as_the_symmetry_says(planets: int) -> None:
    system = lin_parker(planets)
    kinds = mode_kinds(system, modes(system, MESH))
    assert (kinds.count("rotational"), kinds.count("translational")) == (5, 12)
    assert kinds.count("planet") == 3 * (planets - 3)


def test_kinds_do_not_depend_on_the_basis_of_equal_modes() -> None:
    system = lin_parker(5)
    found = modes(system, MESH)
    shape = found.shape.copy()
    frequency = found.frequency.copy()
    kinds = mode_kinds(system, found)
    one = kinds.index("rotational")
    two = kinds.index("translational")
    frequency[one] = frequency[two]  # an accidental degeneracy, and its shapes mixed
    order = np.argsort(frequency, kind="stable")
    mixed = (
        (shape[one] + shape[two]) / np.sqrt(2),
        (shape[one] - shape[two]) / np.sqrt(2),
    )
    shape[one], shape[two] = mixed
    again = mode_kinds(
        system, found._replace(frequency=frequency[order], shape=shape[order])
    )
    assert sorted(again) == sorted(kinds)


def test_unequal_spacing_mixes_modes() -> None:
    system = lin_parker(np.deg2rad([0.0, 100.0, 215.0]))
    assert "mixed" in mode_kinds(system, modes(system, MESH))


def test_stiffness_by_kind_value_and_array_are_the_same() -> None:
    system = lin_parker(3)
    each = np.repeat([4e8, 6e8], 3)
    np.testing.assert_array_equal(
        natural_frequencies(system, {"sun_planet": 4e8, "planet_ring": 6e8}),
        natural_frequencies(system, each),
    )
    with pytest.raises(ValueError, match="sun_planet, planet_ring"):
        natural_frequencies(system, {"sun": 1e8})


def inertial_accelerations(
    system: System, angles: np.ndarray, omega: float, masses: np.ndarray
) -> Any:
    """Newton's law in the inertial frame: planets on springs between points, pins that
    turn with the carrier.

    Meshes push along the turning axes of the carrier frame. The planets run on the
    circle PIN.
    """
    members = len(masses)
    around = np.stack([np.cos(angles), np.sin(angles)], 1)
    home = np.zeros((members, 2))
    home[3:] = PIN * around
    pins = PIN * (1.0 - 0.66 * omega**2 / 1e8) * around
    inertia = system.mass.diagonal()[2::3]
    sun = [1e8, 1e8, 0.0]
    ring = [1e8, 1e8, 1e9]
    carrier = [1e8, 1e8, 0.0]
    held = np.diag([*sun, *ring, *carrier, *[0.0] * (3 * members - 9)])
    d = system.direction
    stiffness = held + 5e8 * d.T @ d

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        turn = rotation(omega * time)
        position = y[: 2 * members].reshape(-1, 2)
        u = y[2 * members : 3 * members]
        q = np.zeros(3 * members)
        in_frame = position @ turn - home
        q[0::3] = in_frame[:, 0]
        q[1::3] = in_frame[:, 1]
        q[2::3] = u
        force = -stiffness @ q
        planar = np.stack([force[0::3], force[1::3]], 1) @ turn.T
        arm = pins @ rotation(omega * time + u[2] / PIN).T
        pull = 1e8 * (position[3:] - position[2] - arm)
        planar[3:] -= pull
        planar[2] += pull.sum(axis=0)
        moments = force[2::3].copy()
        moments[2] += (arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]).sum() / PIN
        return np.r_[
            y[3 * members :], (planar / masses[:, None]).ravel(), moments / inertia
        ]

    return home, rate


def rotation(angle: float) -> np.ndarray:
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([[c, -s], [s, c]])


def test_gyroscopic_and_centripetal_terms_are_those_of_an_inertial_frame() -> None:
    omega = 1500.0
    angles = 2 * np.pi * np.arange(3) / 3
    system = lin_parker(3, carrier_speed=omega, torque={"sun": 0.0})
    masses = system.mass.diagonal()[0::3]
    home, rate = inertial_accelerations(system, angles, omega, masses)
    rng = np.random.default_rng(2)
    q = 1e-7 * rng.normal(size=18)
    v = 5e-4 * rng.normal(size=18)
    position = home + np.stack([q[0::3], q[1::3]], 1)
    velocity = np.stack([v[0::3], v[1::3]], 1) + omega * np.stack(
        [-position[:, 1], position[:, 0]], 1
    )
    start = np.r_[position.ravel(), q[2::3], velocity.ravel(), v[2::3]]
    end = 4e-3
    # Displacements of 1e-7 m are differences of places 0.1 m away: any finer, steps
    # chase their rounding.
    finest = np.repeat([1e-14, 1e-9], 18)
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": finest}
    inertial = solve_ivp(rate, (0.0, end), start, **options).y[:, -1]
    d = system.direction
    stiffness = system.total_stiffness + 5e8 * d.T @ d

    def in_carrier_frame(_: float, y: np.ndarray) -> np.ndarray:
        force = system.load - stiffness @ y[:18] - system.total_damping @ y[18:]
        return np.r_[y[18:], force / system.mass.diagonal()]

    ours = solve_ivp(in_carrier_frame, (0.0, end), np.r_[q, v], **options).y[:18, -1]
    found = inertial[:12].reshape(-1, 2) @ rotation(omega * end) - home
    size = np.abs(ours).max()
    np.testing.assert_allclose(
        found, np.stack([ours[0::3], ours[1::3]], 1), atol=1e-5 * size
    )
    np.testing.assert_allclose(inertial[12:18], ours[2::3], atol=1e-5 * size)


def test_the_rotation_of_the_set_is_neutral_in_the_ratio_of_its_gears() -> None:
    """Neither supports nor meshes take anything from it, however fast: else a set makes
    power of nothing.
    """
    system = lin_parker(3, carrier_speed=1500.0, radial_damping={"planet": 300.0})
    turning = np.zeros(18)
    reduction = 2.0 * np.cos(ALPHA)
    turning[[2, 8]] = reduction, 1.0
    for n, angle in enumerate(2 * np.pi * np.arange(3) / 3):
        at = 3 * (n + 3)
        turning[at : at + 3] = -np.sin(angle), np.cos(angle), -0.5 * reduction
    np.testing.assert_allclose(system.direction @ turning, 0.0, atol=1e-12)
    for matrix in (system.total_stiffness, system.damping):
        np.testing.assert_allclose(
            matrix @ turning, 0.0, atol=1e-10 * np.abs(matrix).max()
        )


def test_gyroscopic_forces_do_no_work() -> None:
    gyroscopic = lin_parker(4, carrier_speed=100.0).gyroscopic
    assert gyroscopic is not None and gyroscopic.any()
    np.testing.assert_array_equal(gyroscopic, -gyroscopic.T)


def test_a_turning_carrier_splits_translational_pairs_only() -> None:
    still = lin_parker(3)
    turning = lin_parker(3, carrier_speed=100.0)
    kinds = np.array(mode_kinds(still, modes(still, MESH)))
    slow = natural_frequencies(still, MESH)
    fast = natural_frequencies(turning, MESH)
    shift = np.abs(fast - slow)
    assert fast[0] == 0.0
    assert (
        shift[kinds == "translational"].max() > 5.0
        and shift[kinds == "rotational"].max() < 1.0
    )


def test_balanced_torques_do_no_work_on_the_free_rotation() -> None:
    alpha = {"sun_planet": ALPHA, "planet_ring": 0.3}
    one = dict.fromkeys(EQUIVALENT, 1.0)
    torque = balanced_torques(rigid_set(one, one, RADIUS, PIN, alpha, [0.0]), 90.0)
    system = lin_parker(3, pressure_angle=alpha, torque=torque, tangential_stiffness={})
    assert system.load.any()
    with pytest.raises(ValueError, match="not in balance"):
        lin_parker(3, torque={"sun": 90.0})


def test_what_floats_is_refused_with_its_name() -> None:
    with pytest.raises(ValueError, match=r"carrier, ring, sun float"):
        lin_parker(3, radial_stiffness={"planet": 1e8})
    with pytest.raises(ValueError, match=r"carrier, ring, sun float"):  # turning or not
        lin_parker(3, radial_stiffness={}, tangential_stiffness={}, carrier_speed=30.0)
    with pytest.raises(ValueError, match=r"planet-1.*float"):
        lin_parker(
            3,
            radial_stiffness=dict.fromkeys(("sun", "ring", "carrier"), 1e8),
            carrier_speed=30.0,
        )
    with pytest.raises(ValueError, match=r"planet-1.*float"):
        lin_parker([0.0], radial_stiffness={"sun": 1e8, "ring": 1e8, "carrier": 1e8})
    with pytest.raises(ValueError, match=r"indefinite.*planet"):
        lin_parker(3, carrier_speed=5e4)
    with pytest.raises(ValueError, match=r"indefinite.*carrier"):
        lin_parker(3, carrier_speed=6e3)
    with pytest.raises(ValueError, match=r"unknown member 'planets'"):
        lin_parker(3, radial_stiffness={"planets": 1e8})
    lin_parker(
        3, radial_stiffness={"carrier": 1e8, "ring": 1e8, "planet": 1e8}
    )  # a floating sun is usual


def test_one_planet_on_rigid_bearings_is_a_pair() -> None:
    """Everything held but the rotations: two meshes in series on one
    planet, as three free discs.
    """
    stiff = dict.fromkeys(("sun", "ring", "carrier", "planet"), 1e16)
    system = lin_parker(
        [0.7],
        radial_stiffness=stiff,
        tangential_stiffness={"ring": 1e16, "carrier": 1e16},
    )
    frequency = natural_frequencies(system, {"sun_planet": 3e8, "planet_ring": 5e8})[:2]
    mass = np.diag([0.39, 0.61])
    stiffness = np.array([[3e8, 3e8], [3e8, 8e8]])
    expected = np.sqrt(np.linalg.eigvals(np.linalg.inv(mass) @ stiffness)) / (2 * np.pi)
    np.testing.assert_allclose(frequency, np.sort(expected), rtol=1e-6)

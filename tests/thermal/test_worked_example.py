"""Steel on plastic as an independent script computes it: every row of its table."""

import numpy as np
import pytest
from warm_pair import warm_pair

from wearlab import assembly
from wearlab.simulation import simulate

CELSIUS = 273.15
ROWS = """
    0   5.217071 0.166065 23.9868 48.0634 2800.33 0.5      0.5      0       0       0
    1e6 5.099875 0.162334 23.8972 47.4330 2802.57 0.455794 0.414428 2.6122  4.6691  1.8327
    5e6 4.823130 0.153525 23.6857 45.9444 2807.86 0.335855 0.236520 10.9977 17.1545 8.7390
    2e7 4.616925 0.146961 23.5282 44.8352 2811.80 0.210471 0.148701 30.8306 42.1467 32.7167
    5e7 4.602917 0.146515 23.5175 44.7598 2812.06 0.196348 0.147142 62.1224 85.4971 79.6770
"""  # noqa: E501
"""Cycles, friction [W], H_V, root and flank [°C], E of the root [MPa], share of the
load at A and E, depth at A and E, and its mean along the flank [µm]."""


@pytest.fixture(scope="module")
def scene():
    return warm_pair(numerics={"tolerance": 1e-4})


@pytest.fixture(scope="module")
def life(scene):
    return simulate(scene)


def mean_depth(scene, run):
    """Mean depth along the wheel's flank [m]."""
    weight = assembly.build(scene).kinds[0].path.arc_weight[1]
    depth = run["wear_depth"].sel(flank="gear").values
    return depth @ weight / weight.sum()


def test_every_row(scene, life):
    rows = np.array(
        [[float(x) for x in line.split()] for line in ROWS.split("\n")[1:6]]
    )
    degrees = life["tooth_temperature"].sel(member="gear") - CELSIUS
    modulus = life["elastic_modulus"].sel(member="gear", place="root")
    force = life["tooth_force"].sel(flank="gear").values
    depth = 1e6 * life["wear_depth"].sel(flank="gear").values
    load = life["static_mesh_force"].values[0]
    assert load == pytest.approx(79.81333, rel=1e-7)

    found = np.column_stack(
        [
            life["cycle"],
            life["friction_power"].sel(mesh="pinion-gear"),
            life["loss_factor"].sel(mesh="pinion-gear"),
            degrees.sel(place="root"),
            degrees.sel(place="flank"),
            1e-6 * modulus,
            force[:, 0] / load,
            force[:, -1] / load,
            depth[:, 0],
            depth[:, -1],
            1e6 * mean_depth(scene, life),
        ]
    )
    assert found == pytest.approx(rows, rel=1e-4)


def test_a_metal_stays_as_cold_as_the_surroundings(life):
    pinion = life["tooth_temperature"].sel(member="pinion")
    assert np.all(pinion == CELSIUS + 20.0)
    assert np.all(life["load_beyond_path"] == 0.0)


def test_pressure_velocity_is_pressure_times_velocity(life):
    product = life["contact_pressure"] * np.abs(life["sliding_velocity"])
    assert life["pressure_velocity"].values == pytest.approx(product.values, rel=1e-12)


def test_the_pressure_is_that_of_the_warm_flank(scene, life):
    """Hertz's mean pressure by hand, with E of the flank."""
    cold = assembly.build(scene).kinds[0].path
    nu = np.array([0.3, 0.35])
    last = life.isel(update=-1)
    flank = last["elastic_modulus"].sel(place="flank").values
    modulus = 1.0 / np.sum((1.0 - nu**2) / flank)
    force = last["tooth_force"].sel(flank="gear").values
    half_width = np.sqrt(
        4.0 * force / 0.01 * cold.equivalent_radius / (np.pi * modulus)
    )
    pressure = force / 0.01 / (2.0 * half_width)
    stored = last["contact_pressure"].sel(flank="gear").values
    assert stored == pytest.approx(pressure, rel=1e-9)


@pytest.mark.parametrize(
    ("without", "mean"),
    [
        ("temperature", 49.3413),
        ("softening", 79.6329),
        ("growth of k", 49.3727),
        ("feedback", 83.2707),
    ],
)
def test_what_the_mean_wear_would_be_without(without, mean):
    """No temperature, E held, k held, temperature held at that of new flanks."""
    cold = {
        "youngs_modulus": "2.9 GPa",
        "poisson_ratio": 0.35,
        "density": "1410 kg/m^3",
    }
    constant = {"model": "constant", "value": "1e-6 mm^3/Nm"}
    at_first = {"model": "constant", "value": "1.70158594e-6 mm^3/Nm"}
    of_case = {
        "temperature": {
            "thermal": None,
            "gears__gear__material": cold,
            "wear__coefficient__gear": constant,
        },
        "softening": {"gears__gear__material": cold},
        "growth of k": {"wear__coefficient__gear": constant},
        "feedback": {
            "thermal": None,
            "gears__gear__material": {**cold, "youngs_modulus": "2.80033025 GPa"},
            "wear__coefficient__gear": at_first,
        },
    }
    changed = warm_pair(**of_case[without], numerics={"tolerance": 1e-4})
    run = simulate(changed)
    assert 1e6 * mean_depth(changed, run)[-1] == pytest.approx(mean, rel=1e-4)


def test_worn_in_the_loss_no_longer_changes():
    worn_in = warm_pair(wear__until={"cycles": 4e8}, wear__snapshots={"cycles": [2e8]})
    run = simulate(worn_in)
    assert run["loss_factor"].values[-1, 0] == pytest.approx(0.146512, rel=1e-5)

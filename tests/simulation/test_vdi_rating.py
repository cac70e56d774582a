"""The kst-E report whole, as a run rates the pair beside its life."""

import math

import pytest
from warm_pair import KST_E, warm_pair

from wearlab.scene import Scene
from wearlab.simulation import simulate

SPEED = 1848.706 / 7.85 * 30.0 / math.pi
"""Of the printed power [rpm]."""
RATED = {
    **KST_E,
    "operation": {"torque": "7.85 N*m", "speed": f"{SPEED} rpm"},
    "thermal": {
        "model": "vdi-2736",
        "ambient": "80 degC",
        "friction": 0.04,
        "housing": {"resistance": "0.060 K*m^2/W", "area": "0.010 m^2"},
        "heat_transfer": {"gear": {"flank": 0, "root": 0}},
    },
    "wear": {
        "coefficient": {
            "pinion": {"model": "constant", "value": "0 mm^3/Nm"},
            "gear": {"model": "constant", "value": "1e-6 mm^3/Nm"},
        },
        "contact_patch": "none",
    },
    "rating": {"load_cycles": 1.350e7, "root_form_factors": [4.21763, 4.21763]},
    "numerics": {"profile_points": 101},
}


@pytest.fixture(scope="module")
def report():
    return simulate(Scene.from_mapping(RATED))


def test_printed_numbers(report):
    gear = report.sel(member="gear")
    assert report["vdi_loss_factor"].item() == pytest.approx(0.0626, abs=5e-5)
    for place in ("root", "flank"):
        degrees = gear["vdi_tooth_temperature"].sel(place=place).item() - 273.15
        assert degrees == pytest.approx(107.767, abs=1e-3)
    assert 1e3 * report["vdi_tooth_displacement"].item() == pytest.approx(
        0.0378, abs=5e-5
    )
    # printed 79.893: with F_t 307.7 N 79.895, with 7.85 N m 79.913
    assert 1e-6 * report["vdi_contact_stress"].item() == pytest.approx(79.913, abs=1e-3)
    assert 1e-6 * gear["vdi_root_stress"].item() == pytest.approx(77.896, abs=1e-3)
    # printed 40.151 with a torque of 8.00 N m; exact 40.1704
    exact = 40.1704 * (1.350e7 * 51.0 / 52.0) / 1.324e7
    assert 1e6 * gear["vdi_mean_wear"].item() == pytest.approx(exact, rel=3e-6)
    assert report["vdi_mean_wear"].sel(member="pinion").item() == 0.0


def test_the_life_has_the_guidelines_temperature(report):
    """By model = "vdi-2736" the wear state is as warm as the rating says."""
    stated = report["vdi_tooth_temperature"].sel(member="gear").values
    computed = report["tooth_temperature"].sel(member="gear").values[0]
    assert computed == pytest.approx(stated, rel=1e-12)
    assert report["loss_factor"].values.ravel() == pytest.approx(
        report["vdi_loss_factor"].values
    )
    assert "VDI 2736-2 second-hand" in report["validity"].item()


def test_strengths_of_known_plastics_only(report):
    assert "vdi_root_safety" not in report
    pom = {"teeth": 40, "material": {"name": "POM", "youngs_modulus": "2.8 GPa"}}
    rated = warm_pair(gears__gear=pom, rating={"root_form_factors": [4.0, 4.0]})
    run = simulate(rated)
    root = run["vdi_tooth_temperature"].sel(member="gear", place="root").item() - 273.15
    strength = 26.0 - 0.0025 * root**2 + 400.0 * 2.5e7**-0.2
    stress = 1e-6 * run["vdi_root_stress"].sel(member="gear").item()
    safety = run["vdi_root_safety"].sel(member="gear").item()
    assert safety == pytest.approx(2.0 * strength / stress, rel=1e-9)
    wear = 1e6 * run["vdi_mean_wear"].sel(member="gear").item()
    assert wear == pytest.approx(93.16, rel=1e-3)


def test_without_thermal_or_rating_there_is_none():
    plain = {key: value for key, value in RATED.items() if key != "thermal"}
    assert not [name for name in simulate(Scene.from_mapping(plain)) if "vdi" in name]
    unrated = {key: value for key, value in RATED.items() if key != "rating"}
    assert not [name for name in simulate(Scene.from_mapping(unrated)) if "vdi" in name]


def test_no_steady_temperature_is_told_of_a_run_that_works():
    """One row alone is too warm for the guideline, all rows together are not."""
    duty = [
        {"torque": "6 N*m", "speed": "1000 rpm", "share": 0.1},
        {"torque": "1 N*m", "speed": "1000 rpm", "share": 0.9},
    ]
    run = simulate(
        warm_pair(
            operation={"duty": duty},
            rating={},
            wear__until=None,
            wear__snapshots=None,
        )
    )
    told = run["validity"].item()
    assert "rating: VDI 2736: no steady temperature: the " in told
    assert "not computed" not in told
    factor = run["vdi_loss_factor"].values.ravel()
    assert factor == pytest.approx([factor[0], factor[0]]) and factor[0] > 0.0
    warm = run["vdi_tooth_temperature"].isel(duty=0).values
    assert math.isnan(warm.max())

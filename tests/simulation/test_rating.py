"""ISO 6336-1 beside a run: a helical pair whose stiffness others have printed."""

import math

import numpy as np
import pytest
from reference_pairs import ISO, both, reference
from scenes import external_pair, planetary_set

from wearlab.gears.iso import face_load_factor
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate


def scene(**changes):
    given = reference(ISO)
    teeth = both(given["teeth"])
    shifts = both(given["shift_1/shift_2"])
    tips = both(given["tip_diameter"])
    gears = [
        {
            "teeth": int(z),
            "profile_shift_coefficient": x,
            "tip_diameter": f"{tip} mm",
            "dedendum_coefficient": float(given["tool_dedendum"]),
        }
        for z, x, tip in zip(teeth, shifts, tips, strict=True)
    ]
    table = {
        "gears": external_pair(
            gears[0],
            gears[1],
            module=f"{given['normal_module']} mm",
            face_width=f"{given['face_width']} mm",
            helix_angle=f"{given['helix_angle']} deg",
            centre_distance=f"{given['centre_distance']} mm",
        ),
        "operation": {
            "torque": f"{given['pinion_torque']} N*m",
            "speed": f"{given['pinion_speed']} rpm",
        },
        "mesh": {"face_points": 11, "stiffness": {"model": "potential-energy"}},
        "numerics": {"profile_points": 41},
        "rating": {},
    }
    return Scene.from_mapping(table).replace(
        {key.replace("__", "."): v for key, v in changes.items()}
    )


def test_the_printed_stiffness_but_for_the_rounded_shift():
    run = simulate(scene(mesh__misalignment="20 um"))
    given = reference(ISO)
    for name, printed in (
        ("iso_theoretical_stiffness", "theoretical_single_stiffness"),
        ("iso_single_stiffness", "single_stiffness"),
        ("iso_mesh_stiffness_alpha", "mesh_stiffness_alpha"),
        ("iso_mesh_stiffness_beta", "mesh_stiffness_beta"),
    ):
        assert run[name].values.item() / 1e9 == pytest.approx(
            float(given[printed]), rel=1e-4
        ), name
    load = float(given["tangential_load_reference_circle"]) / 0.1
    wanted = face_load_factor(
        0.85 * 20e-6, load, run["iso_mesh_stiffness_beta"].values.item()
    )
    assert run["iso_face_load_factor"].values.item() == pytest.approx(wanted, rel=1e-5)
    assert 1.0 < run["iso_root_load_factor"].values.item() < wanted
    assert "second-hand" in str(run["validity"].values)


def test_without_a_misalignment_there_is_no_face_load_factor():
    run = simulate(scene())
    assert "iso_single_stiffness" in run and "iso_face_load_factor" not in run


def pitting(**changes):
    """The safety against pitting asked for as the printed example has it."""
    given = reference(ISO)
    asked = {
        "gears__pinion__roughness_ra": f"{given['roughness_ra']} um",
        "gears__gear__roughness_ra": f"{given['roughness_ra']} um",
        "rating__allowable_contact_stress": f"{given['allowable_contact_stress']} MPa",
        "rating__viscosity_40": f"{given['viscosity_40']} mm^2/s",
        "rating__hours": f"{given['hours']} h",
        "rating__equivalent_misalignment": "20 um",
    }
    kept = {
        key: value for key, value in {**asked, **changes}.items() if value is not None
    }
    return scene(**kept)


def test_the_printed_safety_against_pitting():
    run = simulate(pitting())
    given = reference(ISO)
    assert run["iso_nominal_contact_stress"].item() == pytest.approx(
        1e6 * float(given["nominal_contact_stress"]), rel=1e-4
    )
    stress = run["iso_contact_stress"].values
    wanted = (
        run["iso_nominal_contact_stress"].item()
        * run["iso_face_load_factor"].item() ** 0.5
    )
    assert stress == pytest.approx(wanted, rel=1e-12)
    held = run["iso_pitting_safety"].values * stress
    assert held / 1e6 == pytest.approx(
        both(given["permissible_contact_stress"]), rel=1e-5
    )
    assert "ISO 6336-2:2006, second-hand" in str(run["validity"].values)


@pytest.mark.parametrize(
    "missing",
    [
        "rating__viscosity_40",
        "rating__hours",
        "gears__gear__roughness_ra",
        "mesh.misalignment",
    ],
)
def test_what_the_safety_against_pitting_lacks_is_named(missing):
    key = (
        "rating__equivalent_misalignment" if missing == "mesh.misalignment" else missing
    )
    with pytest.raises(
        SceneError, match=rf"rating\.\w+: .* also takes {missing.replace('__', '.')}"
    ):
        pitting(**{key: None})


def test_a_rating_is_of_a_pair():
    with pytest.raises(SceneError, match="rating: is of a pair"):
        Scene.from_mapping(
            {
                "gears": planetary_set(
                    20, 28, {"teeth": 76, "rim_diameter": "190 mm"}, module="2 mm"
                ),
                "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
                "rating": {},
            }
        )


HEAVY = {"torque": "525 N*m", "speed": "360 rpm", "share": 0.02}
LIGHT = {"torque": "70 N*m", "speed": "360 rpm", "share": 0.98}


def spectrum(*bins, **changes):
    asked = {"operation__torque": None, "operation__speed": None, **changes}
    return pitting(operation__duty=list(bins), **asked)


def safety(scene):
    return simulate(scene)["iso_pitting_safety"].values


def test_the_rating_of_a_spectrum_is_of_all_its_bins_in_any_order():
    run = simulate(spectrum(HEAVY, LIGHT))
    turned = simulate(spectrum(LIGHT, HEAVY))
    assert run["iso_pitting_safety"].values == pytest.approx(
        turned["iso_pitting_safety"].values, rel=1e-9
    )
    assert run["iso_contact_stress"].dims == ("duty", "flank")
    assert run["iso_face_load_factor"].dims == ("duty", "mesh")
    alone = [
        simulate(pitting(operation__torque=one["torque"], operation__speed="360 rpm"))
        for one in (HEAVY, LIGHT)
    ]
    for row, single in zip(range(2), alone, strict=True):
        for name in ("iso_contact_stress", "iso_face_load_factor"):
            assert run[name].values[row] == pytest.approx(single[name].values), name
    heavy, light = (single["iso_pitting_safety"].values for single in alone)
    assert (heavy < run["iso_pitting_safety"].values).all()
    assert (run["iso_pitting_safety"].values < light).all()
    assert "Palmgren-Miner" in str(run["validity"].values)


def test_bins_alike_are_rated_as_one_condition():
    half = {"torque": "300 N*m", "speed": "360 rpm", "share": 0.5}
    run = simulate(spectrum(half, half))
    single = pitting(operation__torque="300 N*m", operation__speed="360 rpm")
    assert run["iso_pitting_safety"].values == pytest.approx(safety(single), rel=1e-9)
    assert run["iso_equivalent_torque"].values == pytest.approx(300.0, rel=1e-9)


def test_the_equivalent_torque_is_that_of_the_slope_of_the_life_factor():
    """On one branch of Z_NT, with K_Hβ = 1: T_eq = (Σ n T^p/Σ n)^(1/p)."""
    slope = math.log(1e10 / 5e7) / math.log(1.0 / 0.85) / 2.0
    torque = np.array([300.0, 310.0])
    share = np.array([0.4, 0.6])
    bins = [
        {"torque": f"{t} N*m", "speed": "360 rpm", "share": u}
        for t, u in zip(torque, share, strict=True)
    ]
    run = simulate(spectrum(*bins, rating__equivalent_misalignment="0 um"))
    wanted = (share @ torque**slope) ** (1.0 / slope)
    assert run["iso_equivalent_torque"].values == pytest.approx(wanted, rel=1e-9)


def stages(last):
    asked = {"operation__torque": None, "operation__speed": None}
    wear = {"model": "constant", "value": "1e-18 m^2/N"}
    steps = [
        {"torque": "70 N*m", "speed": "360 rpm", "cycles": 98},
        {"torque": "525 N*m", "speed": "360 rpm", "cycles": last},
    ]
    return pitting(
        operation__stage=[
            {key: value for key, value in step.items() if value} for step in steps
        ],
        wear__coefficient=wear,
        wear__until={"cycles": 100},
        **asked,
    )


def test_stages_are_rated_by_their_cycles_or_all_in_the_worst():
    """Cycles of stages are shares of the hours; without the last one's, the worst."""
    assert safety(stages(2)) == pytest.approx(safety(spectrum(HEAVY, LIGHT)), rel=1e-9)
    unknown = simulate(stages(None))
    heavy = pitting(operation__torque="525 N*m", operation__speed="360 rpm")
    assert unknown["iso_pitting_safety"].values == pytest.approx(safety(heavy))
    assert "all hours in the worst" in str(unknown["validity"].values)

"""What [thermal] refuses, each with its remedy; and what leaves identities alone."""

import pickle

import numpy as np
import pytest
from thermal_refusals import CALIBRATED
from warm_pair import TABLE, warm_pair, warm_table

from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused

POM = {"teeth": 40, "material": "POM"}
HELD = {"teeth": 40, "material": {"name": "POM", "youngs_modulus": "2.8 GPa"}}
NOT_WARM = {"thermal": None, "wear": None, "mesh": {}}
CONSTANT = {"model": "constant", "value": "1e8 N/m"}


def refusal(**changes):
    """The only problem of a scene."""
    with pytest.raises(SceneError) as told:
        warm_pair(**changes)
    (problem,) = told.value.problems
    return problem


def test_a_named_plastic_is_known_at_one_temperature():
    message = refusal(gears__gear=POM)
    assert message.startswith(
        "scene.gears.gear.material.youngs_modulus: POM: E is known at 23 °C only; give "
        "a table"
    )
    table = {"temperature": ["20 degC", "60 degC"], "value": ["2.9 GPa", "1.9 GPa"]}
    with_table = {"teeth": 40, "material": {"name": "POM", "youngs_modulus": table}}
    assert warm_pair(gears__gear=with_table).gears.gear.material.softens
    assert warm_pair(gears__gear=HELD).thermal is not None
    assert Scene.from_mapping(warm_table(gears__gear=POM, thermal=None, wear=None))


@pytest.mark.parametrize("material", [{"name": "POM"}, HELD["material"]])
@pytest.mark.parametrize("marked", [False, True])
def test_no_file_says_whose_modulus_it_is(material, marked):
    """The mark of a catalogue's modulus passed the refusal where a file took it off."""
    unnamed = {key: value for key, value in material.items() if key != "name"}
    constants = {"poisson_ratio": 0.35, "density": "1410 kg/m^3"}
    for of_file in (material, {"youngs_modulus": "3 GPa", **unnamed, **constants}):
        marking = {**of_file, "modulus_of_catalogue": marked}
        message = refusal(gears__gear={"teeth": 40, "material": marking})
        assert message.startswith(
            "scene.gears.gear.material.modulus_of_catalogue: unknown key"
        )


def test_one_value_is_held_and_flagged():
    scene = warm_pair(gears__gear=HELD, wear=None)
    run = simulate(scene)
    assert "held at one value" in run["validity"].item()
    assert set(run["elastic_modulus"].sel(member="gear").values.ravel()) == {2.8e9}


def test_a_table_needs_thermal():
    message = refusal(thermal=None, wear=None)
    assert (
        "gears.gear.material.youngs_modulus: a table over temperature needs" in message
    )


def test_a_coefficient_over_temperature_needs_thermal():
    message = refusal(thermal=None, gears__gear=HELD)
    assert message.startswith("scene.thermal: 'over-temperature' needs [thermal]")


def test_metals_only():
    assert "both gears are of metal" in refusal(gears__gear={"teeth": 40})
    stated = {"gear": {"flank": 6300, "root": 895}}
    assert warm_pair(gears__gear={"teeth": 40}, thermal__heat_transfer=stated)


def test_housings():
    assert "needs the area" in refusal(thermal__housing="closed")
    assert "give 'open'" in refusal(thermal__housing={"area": "0.01 m^2"})
    walls = {"resistance": "0.06 K*m^2/W", "area": "0.01 m^2"}
    assert warm_pair(thermal__housing=walls).thermal.housing.thermal_resistance == 6.0
    closed = {"model": "closed", "area": "100 cm^2"}
    of_closed = warm_pair(thermal__housing=closed).thermal.housing.thermal_resistance
    assert of_closed == pytest.approx(6.0)


def test_prescribed_stiffness_follows_when_it_is_told():
    assert "knows no temperature" in refusal(mesh__stiffness=CONSTANT)
    warm_pair(mesh__stiffness={**CONSTANT, "follows_modulus": True})
    warm_pair(mesh__stiffness=CONSTANT, gears__gear=HELD)


def test_pauses_count_once():
    duty = {"duty": [{"torque": "1 N*m", "speed": "900 rpm", "share": 1.0}]}
    message = refusal(operation=duty, thermal__relative_duty=0.5)
    assert message.startswith("scene.thermal.relative_duty: counts pauses")
    warm_pair(operation=duty)


def test_friction_agrees():
    moving = {"model": "torsional", "friction": {"coefficient": 0.05}}
    mesh = {"damping_ratio": 0.05}
    assert "dynamics.friction" in refusal(dynamics=moving, mesh=mesh)
    assert warm_pair(dynamics=moving, mesh=mesh, thermal__friction=0.05)


def test_where_it_is_not_known():
    assert "external pairs" in refusal(
        gears={
            "kind": "internal-pair",
            "module": "2 mm",
            "face_width": "10 mm",
            "pinion": TABLE["gears"]["pinion"],
            "ring": {
                "teeth": 60,
                "rim_diameter": "150 mm",
                "material": TABLE["gears"]["gear"]["material"],
            },
        },
        wear=None,
    )
    assert "spur gears" in refusal(mesh__face_points=5)


def test_calibration_needs_a_life_in_proportion():
    assert "'over-temperature'" in refusal(wear__coefficient=CALIBRATED)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"thermal__ambient": "10 degC"}, "10 °C is outside the table of gears.gear"),
        ({"thermal__friction": 0.8}, "the table gears.gear"),
        (
            {"gears__gear__material__service_temperature": "40 degC"},
            "would pass 40 °C, the service temperature of gears.gear.material: at that "
            "temperature friction makes 5.",
        ),
    ],
)
def test_refused_at_the_start_with_the_number(changes, words):
    with pytest.raises(Refused, match=words.replace(".", r"\.")):
        simulate(warm_pair(**changes, wear__until=None, wear__snapshots=None))


def test_a_life_ends_by_temperature():
    """Tip relief wears in: load goes to A and E, and teeth warm up to the limit."""
    relief = {"amount": "40 um", "length": "2.5 mm"}
    material = {
        **TABLE["gears"]["gear"]["material"],
        "service_temperature": "42 degC",
    }
    run = simulate(
        warm_pair(
            gears__pinion={"teeth": 20, "tip_relief": relief},
            gears__gear={"teeth": 40, "tip_relief": relief, "material": material},
        )
    )
    flank = run["tooth_temperature"].sel(member="gear", place="flank").values - 273.15
    assert run["end_reason"].item() == "temperature"
    assert np.all(np.diff(flank) > 0.0)
    assert 41.99 < flank[-1] <= 42.0
    assert 5e6 < run["cycle"].values[-1] < 2e7
    told = "the life ends by temperature: no steady temperature: the flank of gear "
    assert f"{told}would pass 42 °C, the service temp" in run["validity"].item()


def test_a_stage_that_is_too_warm_ends_a_life():
    stages = [
        {"torque": "1.5 N*m", "speed": "1000 rpm", "cycles": 1e5},
        {"torque": "9 N*m", "speed": "1000 rpm", "cycles": 1e5},
    ]
    run = simulate(
        warm_pair(operation={"stage": stages}, wear__until=None, wear__snapshots=None)
    )
    assert run["end_reason"].item() == "temperature"
    assert run["cycle"].values[-1] == pytest.approx(1e5)
    told = "the life ends by temperature: no steady temperature: the flank of gear "
    assert f"{told}would pass 120 °C, where the table" in run["validity"].item()


def test_identities_are_those_without_thermal():
    """A scene without the new keys has the id that it had."""
    table = warm_table(thermal=None, gears__gear={"teeth": 40, "material": "POM"})
    table["mesh"] = {}
    table["wear"] = {"coefficient": {"model": "constant", "value": "1e-6 mm^3/Nm"}}
    assert Scene.from_mapping(table).id == "ecfb5495e1756a7b6c38"


def test_a_stored_scene_is_read_again():
    scene = warm_pair(thermal__housing={"model": "closed", "area": "1 m^2"})
    again = Scene.from_canonical(scene.canonical())
    assert again == scene and again.id == scene.id


@pytest.mark.parametrize("gear", [POM, HELD])
def test_a_stored_plastic_is_read_again(gear):
    """Names are not stored: the written-out modulus is one that is stated."""
    scene = warm_pair(gears__gear=gear, **NOT_WARM)
    again = Scene.from_canonical(scene.canonical())
    assert again.id == scene.id and again.canonical() == scene.canonical()
    copied = pickle.loads(pickle.dumps(scene)).gears.gear.material
    assert copied == scene.gears.gear.material
    assert copied.modulus_of_catalogue is (gear is POM)

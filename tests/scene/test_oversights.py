"""What a scene says and hardly means: told with its remedy, before
anything runs and in the run.
"""

import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.scene import Scene, oversights

OIL = {"viscosity": "0.012 Pa*s", "pressure_viscosity": "1.6e-8 1/Pa"}
CONSTANT = {"model": "constant", "value": "1e-16 m^2/N"}
WITH_FILM = {**CONSTANT, "film": True}


def pair(
    material="steel", coefficient=WITH_FILM, rough=True, oil=OIL, damping_law=None
):
    own = {"roughness_ra": "0.3 um"} if rough else {}
    table = {
        "gears": external_pair(
            {"teeth": 25, "material": "42CrMo4", **own},
            {"teeth": 30, "material": material, **own},
        ),
        "operation": {"torque": "10 N*m", "speed": "1100 rpm"},
        "mesh": {"stiffness": "potential-energy"}
        | ({"damping_law": damping_law} if damping_law else {}),
        "wear": {"load": "static"},
    }
    if coefficient is not None:
        table["wear"] |= {"coefficient": coefficient, "until": {"depth": "1 um"}}
    return Scene.from_mapping(table | ({} if oil is None else {"lubricant": oil}))


def test_an_oil_that_no_coefficient_asks_changes_no_life():
    (told,) = oversights(pair(coefficient=CONSTANT))
    assert (
        told.startswith("the oil does not change this life") and "film = true" in told
    )
    (told,) = oversights(pair(coefficient=CONSTANT, rough=False))
    assert "gears.pinion.roughness_ra, gears.gear.roughness_ra" in told
    assert oversights(pair()) == []
    assert oversights(pair(coefficient={"model": "janakiraman"})) == []
    assert oversights(pair(coefficient={"pinion": CONSTANT, "gear": WITH_FILM})) == []


def test_an_oil_that_damps_the_mesh_changes_the_life():
    told = oversights(pair(coefficient=CONSTANT, damping_law={"model": "squeeze-film"}))
    assert not any("oil" in line for line in told)


def test_a_scene_without_oil_or_wear_is_not_told_of_it():
    assert oversights(pair(coefficient=CONSTANT, oil=None)) == []
    assert oversights(pair("POM", coefficient=None)) == []


def test_one_coefficient_for_steel_and_plastic_is_told():
    (told,) = oversights(pair("POM"))
    assert "pinion 42CrMo4, gear POM" in told and "pinion = {…}, gear = {…}" in told
    assert oversights(pair("18CrNiMo7-6")) == []
    each = {"pinion": WITH_FILM, "gear": {**WITH_FILM, "value": "3e-15 m^2/N"}}
    assert oversights(pair("POM", each)) == []
    by_hardness = {"model": "hardness", "k": 1e-8, "hardness": "7 GPa", "film": True}
    assert len(oversights(pair("POM", by_hardness))) == 1


@pytest.mark.parametrize("given", [{"material": "POM"}, {"coefficient": CONSTANT}])
def test_the_run_says_it_first(given):
    scene = pair(**given)
    assert build(scene).validity[0] == oversights(scene)[0]


def test_a_limit_that_leaves_little_of_a_tooth_is_told_with_the_module():
    """Was a life of 3 mm on teeth of module 1.25 mm, told to within
    78 % and without a word.
    """
    for depth, said in (("20 um", 0), ("0.89 mm", 0), ("0.91 mm", 1), ("3 mm", 1)):
        told = oversights(pair().replace("wear.until.depth", depth))
        assert (
            len([line for line in told if line.startswith("wear.until.depth = ")])
            == said
        ), depth

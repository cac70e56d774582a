"""Gears of drawings in inches: a diametral pitch instead of the module."""

import pytest
from scenes import external_pair

from wearlab.scene import Scene, SceneError
from wearlab.units import UnitError, quantity

PAIR = external_pair(24, 36, face_width="1 in")
LOAD = {"torque": "20 lbf*ft", "speed": "900 rpm"}


def _scene(**gears):
    pair = {key: value for key, value in PAIR.items() if key != "module"}
    return Scene.from_mapping({"gears": {**pair, **gears}, "operation": LOAD})


def test_a_pitch_of_20_is_a_module_of_1_27_mm():
    by_pitch = _scene(diametral_pitch=20)
    assert by_pitch.gears.module == pytest.approx(1.27e-3, rel=1e-15)
    assert by_pitch.id == _scene(module="1.27 mm").id


def test_the_pitch_of_a_helical_gear_is_that_of_the_normal_or_transverse_section():
    normal = _scene(diametral_pitch=12, helix_angle="15 deg")
    assert 1e3 * normal.gears.module == pytest.approx(2.11667, abs=5e-6)

    transverse = _scene(transverse_diametral_pitch=12, helix_angle="15 deg")
    # the transverse module of both gears is 25.4 mm / 12, so is the reference diameter
    assert 1e3 * transverse.gears.module == pytest.approx(2.11667 * 0.9659258, abs=5e-6)


@pytest.mark.parametrize(
    ("gears", "message"),
    [
        ({"diametral_pitch": 20, "module": "2 mm"}, "'module' and 'diametral_pitch'"),
        ({"diametral_pitch": 0}, "diametral_pitch"),
        ({"diametral_pitch": "20 1/in"}, "diametral_pitch"),
        ({"module": "20 1/in"}, "write diametral_pitch = 20 instead of module"),
        ({}, "module"),
    ],
)
def test_what_is_no_size_is_one_message(gears, message):
    with pytest.raises(SceneError) as caught:
        _scene(**gears)
    assert len(caught.value.problems) == 1
    assert message in caught.value.problems[0]


def test_the_remedy_of_a_module_per_inch_works():
    with pytest.raises(SceneError, match="write diametral_pitch = 20 instead"):
        _scene(module="20 1/in")
    assert _scene(diametral_pitch=20).gears.module == pytest.approx(1.27e-3)


def test_a_module_replaces_an_inherited_pitch():
    scene = _scene(diametral_pitch=20).replace("gears.module", "2 mm")
    assert scene.gears.module == pytest.approx(2e-3)
    back = scene.replace("gears.diametral_pitch", 10)
    assert back.gears.module == pytest.approx(2.54e-3)


def test_a_mil_is_a_thousandth_of_an_inch():
    assert quantity("5 mil", "length") == pytest.approx(127e-6)
    assert quantity("5 mil", "length") == quantity("5 thou", "length")
    with pytest.raises(UnitError, match="diametral pitch"):
        quantity("20 DP", "length")


def test_a_stored_scene_comes_back_without_its_pitch():
    scene = _scene(diametral_pitch=20)
    assert Scene.from_canonical(scene.canonical()).id == scene.id

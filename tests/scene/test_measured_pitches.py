"""Measured pitches of a scene: what is stored comes back, what is none is refused."""

import pytest
from scenes import external_pair, planetary_set

from wearlab.gears.specification import GearError
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused

PITCHES = [
    f"{micrometres} um" for micrometres in (1, 3, 4, 3, 1, -1, -2, -1, 1, 2, 1, 0)
]
DYNAMICS = {
    "mesh": {"damping_ratio": 0.07},
    "dynamics": {"model": "torsional"},
}


def pair(pitch):
    return {
        "gears": external_pair({"teeth": 12, "profile_shift_coefficient": 0.4}, 25),
        "operation": {"torque": "50 N*m", "speed": "1000 rpm"},
        "errors": {"slow": "hunting", "pinion": {"pitch": pitch}},
        **DYNAMICS,
    }


def test_a_stored_scene_comes_back():
    """Its canonical form holds all defaults, and none of them says anything."""
    scene = Scene.from_mapping(pair(PITCHES))
    assert Scene.from_canonical(scene.canonical()).id == scene.id


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("quantity", ["a"], "is not one of"),
        ("units", ["um"], "is no text: give units = 'um'"),
        ("units", 5, "is no text"),
    ],
)
def test_what_is_no_text_is_one_message(option, value, message, tmp_path):
    file = tmp_path / "pitches.csv"
    file.write_text("tooth,F_p [um]\n1,0\n")
    with pytest.raises(SceneError, match=message):
        Scene.from_mapping(pair({"file": str(file), option: value}))


def test_planets_that_wear_apart_refuse_them_by_name():
    """Their static sharing knows one wave a turn: building them ended in a KeyError."""
    table = {
        "gears": planetary_set(
            24,
            24,
            {"teeth": 72, "rim_diameter": "250 mm"},
            carrier={"mass": "3 kg", "inertia": "0.01 kg*m^2"},
        ),
        "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
        "errors": {
            "slow": "hunting",
            "planet": {"pitch": [f"{n % 5} um" for n in range(23)] + ["0 um"]},
        },
        "mesh": {"damping_ratio": 0.07},
        "dynamics": {"model": "planetary-torsional"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"cycles": 1e5},
        },
    }
    with pytest.raises((GearError, Refused, SceneError), match=r"errors.planet.pitch"):
        simulate(Scene.from_mapping(table))

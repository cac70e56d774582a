"""Sections of gears: pairs of every kind and planetary sets, as files write them."""

import math

import pytest

from wearlab.gears.errors import GearError
from wearlab.scene import Scene, SceneError
from wearlab.scene.build.gears import build_pair
from wearlab.scene.merge import merge, nested

INTERNAL = {
    "gears": {
        "kind": "internal-pair",
        "module": "6 mm",
        "face_width": "50 mm",
        "pinion": {"teeth": 40, "fillet_radius_coefficient": 0.35},
        "ring": {"teeth": 100, "tip_alteration": "wang-2023", "rim_diameter": "700 mm"},
    },
    "operation": {"torque": "1000 N*m", "speed": "1000 rpm"},
}
PLANETARY = {
    "gears": {
        "kind": "planetary",
        "module": "2.25 mm",
        "face_width": "25 mm",
        "centre_distance": "56.5 mm",
        "planets": 3,
        "sun": {"teeth": 20, "profile_shift_coefficient": 0.35, "eccentricity": "5 um"},
        "planet": {"teeth": 29, "face_width": "28 mm"},
        "ring": {"teeth": 79, "rim_diameter": "215 mm"},
        "carrier": {"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    },
    "operation": {"torque": "90 N*m", "speed": "1000 rpm"},
}


def changed(table, key, value):
    return Scene.from_mapping(merge(table, nested(key, value)))


def test_internal_pair_is_built():
    pair = build_pair(Scene.from_mapping(INTERNAL))
    assert pair.kind == "internal"
    assert [gear.name for gear in pair.gears] == ["pinion", "ring"]
    assert pair.driven.internal and pair.driven.bore_radius == pytest.approx(0.35)
    assert pair.contact_ratio == pytest.approx(1.84891, abs=5e-6)
    assert pair.driven.profile_shift == 0.0


def test_internal_pair_of_a_given_distance():
    scene = changed(INTERNAL, "gears.centre_distance", "180.5 mm")
    scene = scene.replace("gears.pinion.profile_shift_coefficient", 0.1)
    pair = build_pair(scene)
    assert pair.centre_distance == pytest.approx(0.1805)
    assert pair.driven.profile_shift > 0.1


@pytest.mark.parametrize(
    ("table", "key", "value", "said"),
    [
        (INTERNAL, "gears.ring", {"teeth": 100}, None),
        (INTERNAL, "gears.ring.bore_diameter", "10 mm", "gears.ring.bore_diameter: unknown key"),
        (INTERNAL, "gears.pinion.rim_diameter", "10 mm", "gears.pinion.rim_diameter: unknown key"),
        (INTERNAL, "gears.ring.root_profile", "trochoid", "is not one of 'fillet', 'radial'"),
        (INTERNAL, "gears.ring.tip_alteration", "wang", "'wang' is not 'wang-2023'"),
        (INTERNAL, "gears.planets", 3, "not an option of 'internal-pair', but of 'planetary'"),
        (INTERNAL, "gears.gear", {"teeth": 50}, "not an option of 'internal-pair', but of 'external-pair'"),
        (INTERNAL, "gears.ring.eccentricity", "5 um", "gears.ring.eccentricity"),
        (PLANETARY, "gears.planets", 1, "must be at least 2"),
        (PLANETARY, "gears.planet_angles", ["0 deg", "1 rad"], "planet_angles has 2 entries for 3 planets"),
        (PLANETARY, "gears.centre_distance", {"sun_planet": "55 mm"}, "distance.planet_ring: required"),
        (PLANETARY, "gears.centre_distance", "-1 mm", "must be greater than 0"),
    ],
)  # fmt: skip
def test_refusals_name_path_and_remedy(table, key, value, said):
    if said is None:
        table = {**table, "gears": {k: v for k, v in table["gears"].items() if k != "ring"}}
        said = "gears.ring.rim_diameter: required: outside diameter of the rim"
    with pytest.raises(SceneError) as caught:
        changed(table, key, value)
    assert any(said in line for line in caught.value.problems), caught.value.problems


def test_planetary_section():
    gears = Scene.from_mapping(PLANETARY).gears
    assert gears.members == ("sun", "planet", "ring", "carrier")
    assert list(gears.gears()) == ["sun", "planet", "ring"]
    assert gears.centre_distance.sun_planet == gears.centre_distance.planet_ring == 0.0565
    assert gears.sun.eccentricity == pytest.approx(5e-6)
    assert gears.ring.profile_shift_coefficient is None
    apart = changed(
        PLANETARY, "gears.centre_distance", {"sun_planet": "55.125 mm", "planet_ring": "56.25 mm"}
    )
    assert apart.gears.centre_distance.planet_ring == 0.05625
    assert Scene.from_canonical(apart.canonical()) == apart
    angles = changed(PLANETARY, "gears.planet_angles", ["0 deg", "120 deg", "240 deg"]).gears.planet_angles
    assert angles == pytest.approx([0.0, 2 * math.pi / 3, 4 * math.pi / 3])


def test_tip_alteration_replaces_the_coefficient():
    scene = changed(INTERNAL, "gears.ring.tip_diameter", "589 mm")
    assert scene.gears.ring.tip_alteration is None
    with pytest.raises(GearError, match="fillet interference: ring would touch pinion"):
        build_pair(changed(INTERNAL, "gears.ring.tip_alteration_coefficient", 0.0))

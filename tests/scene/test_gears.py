"""Sections of gears: pairs of every kind and planetary sets, as files write them."""

import math
import tomllib

import pytest
from scenes import CAMPAIGNS, internal_pair, planetary_set

from wearlab.assembly.sets import build_pair, build_planetary
from wearlab.gears.specification import GearError
from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge, nested

INTERNAL = {
    "gears": internal_pair(
        {"teeth": 40, "fillet_radius_coefficient": 0.35},
        {"teeth": 100, "tip_alteration": "wang-2023", "rim_diameter": "700 mm"},
        module="6 mm",
        face_width="50 mm",
    ),
    "operation": {"torque": "1000 N*m", "speed": "1000 rpm"},
}
PLANETARY = {
    "gears": planetary_set(
        {"teeth": 20, "profile_shift_coefficient": 0.35, "eccentricity": "5 um"},
        {"teeth": 29, "face_width": "28 mm"},
        {"teeth": 79, "rim_diameter": "215 mm"},
        module="2.25 mm",
        face_width="25 mm",
        centre_distance="56.5 mm",
        carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    ),
    "operation": {"torque": "90 N*m", "speed": "1000 rpm"},
}


def changed(table, key, value):
    return Scene.from_mapping(merge(table, nested(key, value)))


def test_internal_pair_is_built():
    pair = build_pair(Scene.from_mapping(INTERNAL))
    assert pair.internal
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
        (
            INTERNAL,
            "gears.ring.bore_diameter",
            "10 mm",
            "gears.ring.bore_diameter: unknown key",
        ),
        (
            INTERNAL,
            "gears.pinion.rim_diameter",
            "10 mm",
            "gears.pinion.rim_diameter: unknown key",
        ),
        (
            INTERNAL,
            "gears.ring.root_profile",
            "trochoid",
            "is not one of 'fillet', 'radial'",
        ),
        (INTERNAL, "gears.ring.tip_alteration", "wang", "'wang' is not 'wang-2023'"),
        (
            INTERNAL,
            "gears.planets",
            3,
            "not an option of 'internal-pair', but of 'planetary'",
        ),
        (
            INTERNAL,
            "gears.gear",
            {"teeth": 50},
            "not an option of 'internal-pair', but of 'external-pair'",
        ),
        (INTERNAL, "gears.ring.eccentricity", "5 um", "gears.ring.eccentricity"),
        (PLANETARY, "gears.planets", 1, "must be at least 2"),
        (
            PLANETARY,
            "gears.planet_angles",
            ["0 deg", "1 rad"],
            "planet_angles has 2 entries for 3 planets",
        ),
        (
            PLANETARY,
            "gears.centre_distance",
            {"sun_planet": "55 mm"},
            "distance.planet_ring: required",
        ),
        (PLANETARY, "gears.centre_distance", "-1 mm", "must be greater than 0"),
    ],
)
def test_refusals_name_path_and_remedy(table, key, value, said):
    if said is None:
        table = {
            **table,
            "gears": {k: v for k, v in table["gears"].items() if k != "ring"},
        }
        said = "gears.ring.rim_diameter: required: outside diameter of the rim"
    with pytest.raises(SceneError) as caught:
        changed(table, key, value)
    assert any(said in line for line in caught.value.problems), caught.value.problems


def test_planetary_section():
    gears = Scene.from_mapping(PLANETARY).gears
    assert gears.descriptor.members == ("sun", "planet", "ring", "carrier")
    assert list(gears.gears()) == ["sun", "planet", "ring"]
    assert (
        gears.centre_distance.sun_planet == gears.centre_distance.planet_ring == 0.0565
    )
    assert gears.sun.eccentricity == pytest.approx(5e-6)
    assert gears.ring.profile_shift_coefficient is None
    apart = changed(
        PLANETARY,
        "gears.centre_distance",
        {"sun_planet": "55.125 mm", "planet_ring": "56.25 mm"},
    )
    assert apart.gears.centre_distance.planet_ring == 0.05625
    assert Scene.from_canonical(apart.canonical()) == apart
    angles = changed(
        PLANETARY, "gears.planet_angles", ["0 deg", "120 deg", "240 deg"]
    ).gears.planet_angles
    assert angles == pytest.approx([0.0, 2 * math.pi / 3, 4 * math.pi / 3])


BASE = CAMPAIGNS / "base"


def base(name):
    table = tomllib.loads((BASE / name).read_text())
    return Scene.from_mapping(
        {k: v for k, v in table.items() if k not in ("title", "reference")}, BASE
    )


def test_base_file_of_wang_zhang_2023():
    gears = build_planetary(base("planetary_ngw11.toml"), sun_drives=True)
    angles = [
        math.degrees(pair.working_pressure_angle)
        for pair in (gears.sun_planet, gears.planet_ring)
    ]
    assert angles == pytest.approx([23.534, 20.685], abs=5e-4)
    assert [gear.mass for gear in (gears.sun, gears.planet, gears.ring)] == [
        0.53,
        0.35,
        1.85,
    ]
    assert (gears.carrier.mass, gears.carrier.inertia) == (4.5, pytest.approx(0.011178))
    # a solid steel ring of the chosen rim weighs and turns as the printed one
    rim = gears.ring.bore_radius
    reference = gears.ring.reference_radius
    width = gears.ring.face_width
    mass = 7830 * math.pi * width * (rim**2 - reference**2)
    assert mass == pytest.approx(1.85, rel=0.01)
    assert 0.5 * mass * (rim**2 + reference**2) == pytest.approx(0.01744, rel=0.01)
    ring_drives = build_planetary(base("planetary_ngw11.toml"), sun_drives=False)
    assert ring_drives.sun_planet.driving.name == "planet"


def test_base_file_of_bai_ning_2023():
    gears = build_planetary(base("planetary_friction.toml"), sun_drives=True)
    assert gears.sun_planet.centre_distance == pytest.approx(
        gears.planet_ring.centre_distance
    )
    assert gears.carrier.pin_circle_radius == pytest.approx(0.0765)
    mass = 7830 * math.pi * 0.0765**2 * 0.05
    assert gears.carrier.mass == pytest.approx(mass, rel=1e-4)
    assert gears.carrier.inertia == pytest.approx(0.5 * mass * 0.0765**2, rel=1e-4)


def test_base_file_of_wang_2023():
    pair = build_pair(base("internal_40_100.toml"))
    assert pair.contact_ratio == pytest.approx(1.84891, abs=5e-6)
    assert pair.driven.tip_radius == pytest.approx(0.294453, abs=5e-7)


def test_set_as_printed_needs_its_pin_circle():
    table = merge(
        PLANETARY,
        nested(
            "gears.centre_distance",
            {"sun_planet": "55.125 mm", "planet_ring": "56.25 mm"},
        ),
    )
    table = merge(table, nested("gears.sun.profile_shift_coefficient", 0))
    with pytest.raises(GearError, match="give pin_circle_diameter"):
        build_planetary(Scene.from_mapping(table), sun_drives=True)
    gears = build_planetary(
        changed(table, "gears.carrier.pin_circle_diameter", "113 mm"), sun_drives=True
    )
    assert (gears.sun_planet.centre_distance, gears.planet_ring.centre_distance) == (
        0.055125,
        0.05625,
    )


def test_tip_alteration_replaces_the_coefficient():
    scene = changed(INTERNAL, "gears.ring.tip_diameter", "589 mm")
    assert scene.gears.ring.tip_alteration is None
    with pytest.raises(GearError, match="fillet interference: ring would touch pinion"):
        build_pair(changed(INTERNAL, "gears.ring.tip_alteration_coefficient", 0.0))

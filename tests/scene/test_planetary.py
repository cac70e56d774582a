"""Planetary and internal scenes: what belongs to which set, and which
scenes are the same.
"""

import copy

import pytest
from scenes import internal_pair, planetary_set

from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge, nested, without

HELD = {"radial_stiffness": "100 N/um", "damping_ratio": 0.05}
PLANETARY = {
    "gears": planetary_set(
        21,
        30,
        {"teeth": 81, "rim_diameter": "280 mm"},
        face_width="50 mm",
        carrier={"mass": "7.2 kg", "inertia": "21062 kg*mm^2"},
    ),
    "operation": {"torque": "10 N*m", "speed": "100 rad/s"},
    "mesh": {"damping_ratio": 0.05},
    "dynamics": {
        "model": "planetary",
        "supports": {"sun": HELD, "ring": HELD, "carrier": HELD},
    },
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "9 um", "flank": "sun"},
    },
}
EVERYTHING = {
    "gears": {
        "planet_angles": ["0 deg", "120 deg", "240 deg"],
        "sun": {"eccentricity": "2 um"},
        "ring": {"tip_alteration": "wang-2023"},
        "centre_distance": {"sun_planet": "76.5 mm", "planet_ring": "76.6 mm"},
    },
    "operation": {
        "input": "carrier",
        "output": "sun",
        "fixed": "ring",
        "load_torque": "balance",
    },
    "mesh": {
        "normal_backlash": "80 um",
        "sun_planet": {
            "stiffness": {"model": "constant", "value": "1e9 N/m"},
            "face_load_factor": 1.1,
        },
        "planet_ring": {
            "extended_contact": True,
            "damping": "5 N*s/m",
            "contact": "exact",
        },
    },
    "errors": {
        "seed": 3,
        "slow": "frozen",
        "sun": {"total_composite": "3 um"},
        "planet": {"tooth_composite": "1 um", "planet_position": ["3 um"]},
        "carrier": {"installation": ["2 um"]},
        "ring": {"installation": ["1 um"]},
        "harmonic": [{"mesh": "planet-ring-2", "order": 1, "amplitude": "1 um"}],
    },
    "dynamics": {"friction": {"coefficient": 0.05}, "rotation": False},
    "lubricant": {"viscosity": "0.01 Pa*s", "pressure_viscosity": "1e-8 1/Pa"},
    "wear": {
        "initial": {"planet-sun": {"depth": "1 um"}},
        "coefficient": {"planet": {"factor": 2}},
        "until": {"flank": "planet-ring"},
        "snapshots": {"depth": ["1 um"], "flank": "planet-ring"},
    },
}
REFUSED = [
    (
        "gears.gear.teeth",
        30,
        "gears.gear: not an option of 'planetary', but of 'external-pair'",
    ),
    ("gears.planets", 1, "gears.planets: 1 must be at least 2"),
    (
        "gears.planet_angles",
        ["0 deg", "120 deg"],
        "gears: planet_angles has 2 entries for 3 planets",
    ),
    (
        "gears.sun.eccentricity",
        "-3 um",
        "gears.sun.eccentricity: '-3 um' must be at least 0",
    ),
    (
        "gears.centre_distance",
        {"sun_planet": "76.5 mm"},
        "gears.centre_distance.planet_ring: required: of planets and ring, such as "
        "'20 mm'",
    ),
    (
        "operation.power",
        "1 N*m",
        "operation.power: '1 N*m': 'N*m' is not a unit like 'W'",
    ),
    (
        "operation.input",
        "planet",
        "operation.input: 'planet' is no member that may be that; there are sun, ",
    ),
    (
        "operation",
        {"input": "sun", "fixed": "sun"},
        "operation: one member in two roles: input 'sun', output 'carrier', fixed "
        "'sun'",
    ),
    (
        "operation",
        {"fixed": "sun"},
        "operation: the sun drives by default, but is fixed; give input = 'ring' or "
        "'carrier'",
    ),
    (
        "operation",
        {"output": "sun"},
        "operation: the sun drives by default, but is output; give input = 'ring' or "
        "'carrier'",
    ),
    (
        "operation.output",
        "pinion",
        "operation.output: 'pinion' is no member that may be that; there are",
    ),
    (
        "operation.load_torque",
        "zero",
        "operation.load_torque: 'zero' leaves the output 'carrier' without any load: "
        "give "
        "dynamics.supports.carrier a torsional_stiffness, or load_torque = 'balance'",
    ),
    (
        "operation.load_torque",
        "free",
        "operation.load_torque: 'free' is not one of 'balance', 'zero'",
    ),
    (
        "dynamics",
        {"model": "spur-3dof"},
        "dynamics.model: 'spur-3dof' does not belong to gears of kind 'planetary'; "
        "give 'planetary' or 'planetary-torsional'",
    ),
    (
        "dynamics.friction.coefficient",
        -0.1,
        "dynamics.friction.coefficient: -0.1 must be at least 0",
    ),
    (
        "dynamics.friction.coefficient",
        50,
        "dynamics.friction.coefficient: 50 must be at most 1",
    ),
    (
        "dynamics.supports.gear",
        HELD,
        "dynamics.supports.gear: unknown key; there are sun, ring, carrier, planet",
    ),
    (
        "dynamics.supports.sun.preload",
        "3 N",
        "dynamics.supports.sun.preload: unknown key; there are torsional_stiffness, "
        "tangential_stiffness, "
        "torsional_damping, damping_ratio, radial_stiffness, damping",
    ),
    (
        "wear.until.flank",
        "planet",
        "wear.until.flank: 'planet' is no flank of this gear set; there are sun, "
        "planet-sun",
    ),
    (
        "wear.snapshots",
        {"depth": ["1 um"], "flank": "gear"},
        "wear.snapshots.flank: 'gear' is no flank of this gear set; there are sun, "
        "planet-sun",
    ),
    (
        "wear.initial.pinion.depth",
        "1 um",
        "wear.initial.pinion: no flank of this gear set; there are sun, planet-sun",
    ),
    (
        "wear.initial.planet_sun",
        {},
        "wear.initial.planet_sun: unknown key, did you mean 'planet-sun'?",
    ),
    (
        "mesh.ring_planet",
        {},
        "mesh.ring_planet: unknown key, did you mean 'planet_ring'?",
    ),
    (
        "mesh.planet_ring.damping_in",
        "always",
        "mesh.planet_ring.damping_in: must be as in mesh.sun_planet: give "
        "it once, as mesh.damping_in, and leave it out of both",
    ),
    (
        "mesh.sun_planet.excitation",
        {"model": "fourier", "stiffness_harmonics": 3, "error_harmonics": 3},
        "mesh.planet_ring.excitation: must be as in mesh.sun_planet: give "
        "it once, as mesh.excitation, and leave it out of both",
    ),
    (
        "wear.coefficient.gear",
        "constant",
        "wear.coefficient: 'gear': no member with teeth of this gear set; there are "
        "sun, planet, ring",
    ),
    (
        "mesh.sun_planet.face_load_factor",
        0.5,
        "mesh.sun_planet.face_load_factor: 0.5 must be at least 1",
    ),
    (
        "errors.pinion",
        {},
        "errors.pinion: no member of this gear set; there are sun, planet, ring, "
        "carrier",
    ),
    (
        "errors.carrier.total_composite",
        "3 um",
        "errors.carrier.total_composite: unknown key; there are",
    ),
    (
        "errors.harmonic",
        [{"order": 1, "amplitude": "3 um"}],
        "errors.harmonic[0].mesh: required: 'sun-planet' or 'planet-ring', or one of "
        "them by its number",
    ),
    (
        "errors.harmonic",
        [{"mesh": "sun-planet-4", "order": 1, "amplitude": "3 um"}],
        "errors.harmonic[0].mesh: 'sun-planet-4': of that kind there are meshes 1 to 3",
    ),
    (
        "errors.harmonic",
        [{"mesh": "pinion-gear", "order": 1, "amplitude": "3 um"}],
        "errors.harmonic[0].mesh: 'pinion-gear' is no mesh of this gear set; there "
        "are sun-planet",
    ),
    (
        "errors",
        {
            "planet": {"planet_position": ["3 um"]},
            "carrier": {"planet_position": ["3 um"]},
        },
        "errors.planet.planet_position: stands in errors.carrier as well, and both "
        "would add up",
    ),
    (
        "gears",
        {"kind": "planetry"},
        "gears.kind: 'planetry' is not one of 'external-pair', 'internal-pair', "
        "'planetary'; "
        "did you mean 'planetary'?",
    ),
]


@pytest.fixture
def planetary():
    return copy.deepcopy(PLANETARY)


@pytest.mark.parametrize(
    ("key", "value", "said"), REFUSED, ids=[f"{k}={v}" for k, v, _ in REFUSED]
)
def test_each_fault_has_one_message(planetary, key, value, said):
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(merge(planetary, nested(key, value)))
    assert len(caught.value.problems) == 1, caught.value.problems
    assert caught.value.problems[0].startswith(f"scene.{said}")


def test_every_mesh_needs_damping_of_its_own_or_of_all(planetary):
    planetary["mesh"] = {"sun_planet": {"damping": "3 N*s/m"}}
    with pytest.raises(
        SceneError, match=r"^scene\.mesh\.planet_ring: dynamics need mesh damping"
    ) as caught:
        Scene.from_mapping(planetary)
    assert len(caught.value.problems) == 1
    planetary["mesh"]["planet_ring"] = {"damping_ratio": 0.1}
    assert Scene.from_mapping(planetary).mesh.of("planet_ring").damping_ratio == 0.1


def test_a_carrier_has_no_solid_to_weigh(planetary):
    with pytest.raises(
        SceneError, match=r"^scene\.gears\.carrier\.mass: required with .*'2.8 kg'$"
    ):
        Scene.from_mapping(without(planetary, "gears.carrier.mass"))


@pytest.mark.parametrize("own", ["sun_planet", "planet_ring"])
def test_a_mesh_that_says_what_all_say_says_nothing(planetary, own):
    plain = Scene.from_mapping(planetary)
    assert plain.replace(f"mesh.{own}.damping_ratio", 0.05).id == plain.id
    assert plain.replace(f"mesh.{own}.damping_ratio", 0.06).id != plain.id


def test_what_holds_counts_not_where_it_is_written(planetary):
    each = {"damping": "3 N*s/m", "contact": "exact"}
    general = Scene.from_mapping(merge(planetary, {"mesh": each}))
    both = Scene.from_mapping(
        merge(planetary, {"mesh": {"sun_planet": each, "planet_ring": each}})
    )
    assert both.id == general.id
    one = Scene.from_mapping(merge(planetary, {"mesh": {"sun_planet": each}}))
    other = Scene.from_mapping(
        merge(planetary, {"mesh": {**each, "planet_ring": {"contact": "displacement"}}})
    )
    other = other.replace("mesh.planet_ring.damping_ratio", 0.05)
    assert one.id == other.id != general.id


def test_a_mesh_without_backlash_beside_one_with_it_comes_back_so(planetary):
    scene = Scene.from_mapping(
        merge(planetary, nested("mesh.sun_planet.normal_backlash", "50 um"))
    )
    again = Scene.from_canonical(scene.canonical())
    assert again.id == scene.id
    assert again.mesh.of("sun_planet").normal_backlash == pytest.approx(50e-6)
    assert again.mesh.of("planet_ring").normal_backlash is None


def test_everything_comes_back_from_its_canonical_form(planetary):
    scene = Scene.from_mapping(merge(planetary, EVERYTHING))
    again = Scene.from_canonical(scene.canonical())
    assert again.canonical() == scene.canonical()
    assert again.mesh.of("planet_ring").damping == 5.0
    assert again.mesh.of("planet_ring").damping_ratio is None
    assert again.mesh.of("sun_planet").damping_ratio == 0.05
    assert again.mesh.of("sun_planet").stiffness.model == "constant"
    assert again.wear.coefficient_of("planet-ring").factor == 2.0
    assert again.wear.coefficient_of("sun").factor == 1.0
    assert again.wear.initial_of("planet-sun").depth == pytest.approx(1e-6)
    assert again.dynamics.friction.coefficient == 0.05


def test_power_is_torque_times_speed(planetary):
    scene = Scene.from_mapping(planetary)
    assert scene.replace("operation.power", "1 kW").id == scene.id
    assert (
        Scene.from_mapping(
            {**planetary, "operation": {"power": "1 kW", "torque": "10 N*m"}}
        ).id
        == scene.id
    )
    doubled = scene.replace("operation.power", "2 kW")
    assert doubled.operation.torque == pytest.approx(20.0) and doubled.id != scene.id
    assert Scene.from_canonical(doubled.canonical()).id == doubled.id
    assert doubled.replace("operation.torque", "10 N*m").id == scene.id


@pytest.mark.parametrize(
    ("key", "value", "read"),
    [
        (
            "wear.initial.sun.depth",
            "3 um",
            lambda s: s.wear.initial_of("sun").depth == pytest.approx(3e-6),
        ),
        ("operation.torque", "30 N*m", lambda s: s.operation.torque == 30.0),
        (
            "mesh.sun_planet.stiffness.model",
            "potential-energy",
            lambda s: (
                (
                    s.mesh.of("sun_planet").stiffness.model,
                    s.mesh.of("planet_ring").stiffness.model,
                )
                == ("potential-energy", "finite-element")
            ),
        ),
        (
            "operation.input",
            "carrier",
            lambda s: (s.operation.output, s.operation.fixed) == ("sun", "ring"),
        ),
    ],
)
def test_dotted_keys_of_sweeps(planetary, key, value, read):
    scene = Scene.from_mapping(planetary).replace(key, value)
    assert read(scene)
    assert Scene.from_canonical(scene.canonical()).id == scene.id


def test_a_dropped_support_is_gone(planetary):
    scene = Scene.from_mapping(without(planetary, "dynamics.supports.sun"))
    assert set(scene.dynamics.supports.given) == {"ring", "carrier"}


def test_a_measured_flank_replaces_a_shape_and_back():
    measured = {"file": "flank.csv", "units": {"diameter": "mm", "depth": "um"}}
    shaped = {
        "wear": {
            "initial": {"sun": {"depth": "3 um", "shape": "uniform", "sides": "both"}}
        }
    }
    over = merge(shaped, {"wear": {"initial": {"sun": measured}}})
    assert over["wear"]["initial"]["sun"] == {**measured, "sides": "both"}
    assert merge(over, nested("wear.initial.sun.depth", "1 um"))["wear"]["initial"][
        "sun"
    ] == {
        "depth": "1 um",
        "sides": "both",
    }


INTERNAL = {
    "gears": internal_pair(40, {"teeth": 100, "rim_diameter": "240 mm"}, module="2 mm"),
    "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
    "mesh": {"damping_ratio": 0.05},
}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        (
            "gears.gear.teeth",
            3,
            "gears.gear: not an option of 'internal-pair', but of 'external-pair'",
        ),
        (
            "gears.ring.tip_alteration",
            "wang",
            "gears.ring.tip_alteration: 'wang' is not 'wang-2023'",
        ),
        (
            "gears.ring.root_profile",
            "trochoid",
            "gears.ring.root_profile: 'trochoid' is not one of 'fillet'",
        ),
        (
            "dynamics.model",
            "planetary",
            "dynamics.model: 'planetary' does not belong to gears of kind 'inter",
        ),
        (
            "mesh.planet_ring.damping",
            "3 N*s/m",
            "mesh.planet_ring: belongs to planetary sets",
        ),
        (
            "operation.fixed",
            "ring",
            "operation.fixed: belongs to planetary sets; both gears of a pair turn",
        ),
        (
            "dynamics",
            {"model": "torsional", "supports": {"gear": {}}},
            "dynamics.supports.gear: no member of this gear set; there are pinion, "
            "ring",
        ),
        (
            "errors.gear",
            {},
            "errors.gear: no member of this gear set; there are pinion, ring",
        ),
    ],
)
def test_internal_pairs_refuse_what_is_not_theirs(key, value, said):
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(merge(INTERNAL, nested(key, value)))
    assert len(caught.value.problems) == 1, caught.value.problems
    assert caught.value.problems[0].startswith(f"scene.{said}")

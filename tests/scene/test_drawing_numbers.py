"""A drawing's numbers become a scene: allowances, backlash that dynamics know, a
carrier nobody weighed.
"""

import copy

import numpy as np
import pytest
from scenes import external_pair, planetary_set

from wearlab.assembly.sets import build_set
from wearlab.assembly.sheet import sheet
from wearlab.assembly.vibration import build_system
from wearlab.scene import Scene, SceneError, parts_left_out

TABLE = {
    "gears": external_pair(
        {
            "teeth": 20,
            "profile_shift_coefficient": 0.3,
            "tooth_thickness_allowance": {"upper": "-30 um", "lower": "-50 um"},
        },
        {
            "teeth": 40,
            "profile_shift_coefficient": 0.1,
            "tooth_thickness_allowance": "-40 um",
        },
        module="2 mm",
        centre_distance="60.85 mm",
    ),
    "operation": {"torque": "50 N*m", "speed": "1000 rpm"},
    "mesh": {"damping_ratio": 0.05},
    "dynamics": {"model": "torsional"},
}


def test_dynamics_know_the_backlash_of_the_drawing():
    scene = Scene.from_mapping(TABLE)
    gears = build_set(scene)
    free = gears.kinds[0].pair.drawn_backlash
    assert free == pytest.approx(
        80e-6 * np.cos(np.radians(20)) + 2 * 85.25e-6 * np.sin(np.radians(21.8)),
        rel=0.02,
    )
    assert build_system(scene, gears, np.array([3e8])).backlash == pytest.approx([free])
    given = scene.replace("mesh.normal_backlash", "10 um")
    assert build_system(given, gears, np.array([3e8])).backlash == pytest.approx(
        [10e-6]
    )


def test_a_backlash_normal_to_helical_flanks_is_that_of_teeth_thinned_as_much():
    """Thinning by E in the normal section leaves ``j_bn = E cos α_n``."""
    thinned = 100e-6 / np.cos(np.radians(20.0))
    pair = external_pair(
        30, 41, module="2 mm", face_width="40 mm", helix_angle="25 deg"
    )
    table = {**TABLE, "gears": pair}
    stated = Scene.from_mapping(
        {**table, "mesh": {"damping_ratio": 0.05, "normal_backlash": "100 um"}}
    )
    drawn = Scene.from_mapping(
        {
            **table,
            "gears": external_pair(
                {"teeth": 30, "tooth_thickness_allowance": f"{-thinned} m"},
                41,
                module="2 mm",
                face_width="40 mm",
                helix_angle="25 deg",
            ),
        }
    )
    base_angle = np.arcsin(np.sin(np.radians(25)) * np.cos(np.radians(20)))
    for scene in (stated, drawn):
        system = build_system(scene, build_set(scene), np.array([3e8]))
        assert system.backlash == pytest.approx([100e-6 / np.cos(base_angle)])
        said = {row.symbol: row.values for row in sheet(scene).rows}
        assert said["j_bn"] == ("0.1",)


def test_check_prints_centre_distance_contact_ratio_backlash_and_sliding():
    said = {row.symbol: row.values for row in sheet(Scene.from_mapping(TABLE)).rows}
    assert said["a_w"] == ("60.85",) and said["j_bn"] == ("0.139",)
    pair = build_set(Scene.from_mapping(TABLE)).kinds[0].pair
    at_e = pair.specific_sliding(np.array([pair.path.E]))[1, 0]
    assert float(said["ζ"][0]) == pytest.approx(at_e, rel=1e-3) and at_e < 0.0


def test_check_prints_tips_and_what_they_keep_from_the_root():
    """A pair of 3 mm whose centre distance is rounded below the one
    that its shifts ask for.
    """
    table = copy.deepcopy(TABLE)
    table["gears"] |= {"module": "3 mm", "centre_distance": "114.5 mm"}
    pinion = table["gears"]["pinion"]
    gear = table["gears"]["gear"]
    pinion |= {
        "teeth": 19,
        "profile_shift_coefficient": 0.35,
        "tooth_thickness_allowance": "-110 um",
    }
    gear |= {
        "teeth": 57,
        "profile_shift_coefficient": -0.1,
        "tooth_thickness_allowance": "-145 um",
    }
    said = {row.symbol: row.values for row in sheet(Scene.from_mapping(table)).rows}
    assert said["d_a"] == ("64.6", "175.9") and said["k"] == ("-0.0833", "-0.0833")
    assert said["d_w"] == ("57.25", "171.75")  # 2 a z / Σz
    thinned = [
        0.5 * e / np.tan(np.radians(20)) for e in (0.110, 0.145)
    ]  # a thinner tooth is cut deeper
    assert [float(c) for c in said["c"]] == pytest.approx(
        [0.75 + thinned[1], 0.75 + thinned[0]], abs=6e-4
    )
    x = 0.35 - 0.110 / (6 * np.tan(np.radians(20)))
    inv = {
        r: np.tan(a := np.arccos(57 * np.cos(np.radians(20)) / (2 * r))) - a
        for r in (28.5, 32.3)
    }
    half = np.pi / 38 + 2 * x * np.tan(np.radians(20)) / 19 + inv[28.5] - inv[32.3]
    assert float(said["s_an"][0]) == pytest.approx(2 * 32.3 * half, abs=6e-4)


def test_check_prints_the_modifications_of_the_flanks():
    table = copy.deepcopy(TABLE)
    table["gears"]["pinion"] |= {
        "tip_relief": {"amount": "20 um", "length": "2 mm"},
        "lead_crowning": "8 um",
    }
    table["mesh"] |= {"misalignment": "15 um"}
    scene = Scene.from_mapping(table)
    said = {row.symbol: row.values for row in sheet(scene).rows}
    assert (
        said["C_αa"] == ("20", "")
        and said["C_β"] == ("8", "")
        and said["F_βy"] == ("15",)
    )
    pinion = build_set(scene).gears["pinion"]
    length = np.sqrt(pinion.tip_radius**2 - pinion.base_radius**2)
    assert float(said["d_Ca"][0]) == pytest.approx(
        2e3 * np.hypot(pinion.base_radius, length - 2e-3), abs=6e-4
    )
    axes = {"torque": ["0 N*m", "100 N*m"], "value": ["0 um", "10 um"]}
    blocks = [
        {"torque": torque, "speed": "1500 rpm", "share": share}
        for torque, share in (("100 N*m", 0.1), ("20 N*m", 0.9))
    ]
    spectrum = table | {
        "operation": {"duty": blocks},
        "mesh": table["mesh"] | {"misalignment": axes},
    }
    rows = [r for r in sheet(Scene.from_mapping(spectrum)).rows if r.symbol == "F_βy"]
    assert [(row.meaning[-7:], row.values) for row in rows] == [
        (" 20 N·m", ("2",)),
        ("100 N·m", ("10",)),
    ]
    del table["gears"]["pinion"]["tip_relief"]
    assert "flank modifications" not in parts_left_out(Scene.from_mapping(table))


def test_allowances_thin_teeth():
    table = copy.deepcopy(TABLE)
    table["gears"]["pinion"]["tooth_thickness_allowance"] = "20 um"
    with pytest.raises(
        SceneError, match=r"gears\.pinion\.tooth_thickness_allowance.*must be at most 0"
    ):
        Scene.from_mapping(table)
    table["gears"]["pinion"]["tooth_thickness_allowance"] = {
        "upper": "-50 um",
        "lower": "-30 um",
    }
    with pytest.raises(SceneError, match="lower must not be above upper"):
        Scene.from_mapping(table)


def test_a_static_set_needs_no_carrier():
    gears = planetary_set(
        {"teeth": 20, "profile_shift_coefficient": 0.35},
        29,
        {"teeth": 79, "rim_diameter": "220 mm"},
        module="2.25 mm",
        face_width="40 mm",
        centre_distance="56.5 mm",
    )
    table = {"gears": gears, "operation": {"torque": "134 N*m", "speed": "1000 rpm"}}
    assert build_set(Scene.from_mapping(table)).bodies[
        "carrier"
    ].radius == pytest.approx(56.5e-3)
    moving = {
        **table,
        "dynamics": {"model": "planetary-torsional"},
        "mesh": {"damping_ratio": 0.05},
    }
    with pytest.raises(SceneError) as refused:
        Scene.from_mapping(moving)
    assert [line.split(", such")[0] for line in refused.value.problems] == [
        "scene.gears.carrier.mass: required with [dynamics]",
        "scene.gears.carrier.inertia: required with [dynamics]",
    ]


def test_what_is_read_off_a_motion_says_so_under_static_load():
    table = {k: v for k, v in TABLE.items() if k != "dynamics"}
    with pytest.raises(
        SceneError,
        match=r"mesh_acceleration_orders' is read off a motion, .*\[dynamics\]",
    ):
        Scene.from_mapping(
            {**table, "store": {"variables": ["all", "mesh_acceleration_orders"]}}
        )


def test_check_prints_no_backlash_of_0_where_none_is_given():
    table = copy.deepcopy(TABLE)
    del (
        table["gears"]["centre_distance"],
        table["gears"]["gear"]["tooth_thickness_allowance"],
    )
    del table["gears"]["pinion"]["tooth_thickness_allowance"]
    scene = Scene.from_mapping(table)

    def row(scene):
        return next(row for row in sheet(scene).rows if row.symbol == "j_bn")

    assert (row(scene).values, row(scene).unit) == (("none given",), "")
    assert row(scene.replace("mesh.normal_backlash", "0 um")).values == ("0",)
    assert row(scene.replace("mesh.normal_backlash", "90 um")).values == ("0.09",)

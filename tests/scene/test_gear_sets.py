"""The static load of the meshes of a set, said once and read by the
models of the dynamics.
"""

import pytest
from scenes import internal_pair, planetary_set

from wearlab.assembly import build
from wearlab.assembly.sets import build_set
from wearlab.scene import Scene

PLANETARY = planetary_set(
    {"teeth": 20, "profile_shift_coefficient": 0.35},
    29,
    {"teeth": 79, "rim_diameter": "220 mm"},
    module="2.25 mm",
    face_width="40 mm",
    centre_distance="56.5 mm",
    carrier={"mass": "1 kg", "inertia": "0.01 kg*m^2"},
)
INTERNAL = internal_pair(30, {"teeth": 80, "rim_diameter": "280 mm"})


def gear_set(gears, **operation):
    operation = {"torque": "134 N*m", "speed": "1000 rpm"} | operation
    return build_set(Scene.from_mapping({"gears": gears, "operation": operation}))


@pytest.mark.parametrize(
    ("roles", "sun"),
    [
        ({}, 134.0),
        ({"input": "carrier", "output": "sun"}, 134.0 * 20 / 99),
        ({"input": "ring", "output": "carrier", "fixed": "sun"}, 134.0 * 20 / 79),
    ],
)
def test_meshes_of_a_planetary_set_share_the_torque_on_the_sun(roles, sun):
    planetary = gear_set(PLANETARY, **roles)
    assert planetary.torque == pytest.approx(sun, rel=1e-12)
    radius = planetary.gears["sun"].base_radius
    assert [kind.load for kind in planetary.kinds] == pytest.approx(
        [sun / (3 * radius)] * 2, rel=1e-12
    )


@pytest.mark.parametrize("driver", ["pinion", "ring"])
def test_the_mesh_of_a_pair_carries_the_torque_of_whichever_gear_drives(driver):
    roles = {} if driver == "pinion" else {"input": "ring", "output": "pinion"}
    pair = gear_set(INTERNAL, **roles)
    assert pair.torque == pytest.approx(134.0, rel=1e-12)
    assert pair.kinds[0].load == pytest.approx(
        134.0 / pair.gears[driver].base_radius, rel=1e-12
    )


def test_the_torsional_model_of_a_set_is_loaded_by_the_force_of_all_its_meshes():
    scene = {
        "gears": PLANETARY,
        "operation": {"torque": "134 N*m", "speed": "1000 rpm"},
        "mesh": {"damping_ratio": 0.07},
        "dynamics": {"model": "planetary-torsional"},
    }
    parts = build(Scene.from_mapping(scene))
    assert parts.vibration.system.load[0] == pytest.approx(
        3.0 * parts.gears.kinds[0].load, rel=1e-12
    )

"""The slower a set runs, the nearer its mesh force is to the quasi-static one: nothing
jumps at A.
"""

import golden
import pytest

from wearlab.scene import Scene
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")

GEARS = {
    "external": (golden.PAIR["gears"], {"model": "torsional"}),
    "internal": (
        {k: v for k, v in golden.RING.items() if k != "gear"},
        {"model": "torsional"},
    ),
    "planetary": (golden.SET, {"model": "planetary-torsional"}),
}


@pytest.mark.parametrize(
    ("kind", "speed"), [*((kind, "5 rpm") for kind in GEARS), ("planetary", "1 rpm")]
)
def test_at_few_turns_a_minute_the_largest_force_is_the_static_one(kind, speed):
    gears, dynamics = GEARS[kind]
    given = {
        "gears": gears,
        "operation": {"torque": "340 N*m", "speed": speed},
        "mesh": {"damping_ratio": 0.05, "normal_backlash": "100 um"},
        "dynamics": dynamics,
    }
    run = simulate(Scene.from_mapping(given))
    assert float((run.mesh_force_max / run.static_mesh_force).max()) == pytest.approx(
        1.0, abs=0.01
    )
    given["mesh"]["extended_contact"] = False
    jump = simulate(Scene.from_mapping(given))
    assert float((jump.mesh_force_max / jump.static_mesh_force).max()) > 1.2

"""A motion that grows without bound is refused by name: no run holds numbers that are none."""

import pytest

from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.errors import Refused


def test_undamped_flanks_that_never_part_may_grow_without_bound():
    """Backlash far below the deflections: Hill's equation without damping, in a region of instability."""
    scene = {
        "gears": {
            "kind": "external-pair", "module": "0.01012 m", "face_width": "0.01012 m",
            "pinion": {"teeth": 171, "profile_shift_coefficient": 0.0}, "gear": {"teeth": 98},
        },
        "operation": {"torque": "2.31463 N*m", "speed": "271.6 rpm"},
        "mesh": {
            "stiffness": {"model": "potential-energy", "coupling": "shared", "hertz": "weber"},
            "normal_backlash": "1e-08 m", "damping_ratio": 0.0, "damping_in": "contact",
        },
        "dynamics": {"model": "torsional"},
        "errors": {"harmonic": [{"order": 2, "amplitude": "3.067372e-05 m"}]},
    }  # fmt: skip
    with pytest.raises(Refused, match="grows without bound"):
        simulate(Scene.from_mapping(scene))

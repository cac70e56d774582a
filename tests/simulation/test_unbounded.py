"""A motion that grows without bound is refused by name: no run holds
numbers that are none.
"""

import pytest
from scenes import external_pair

from wearlab.dynamics.steady.periodic import Periodic, Unbounded
from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused


@pytest.mark.parametrize("ratio", [0.0, 0.004])
def test_flanks_that_never_part_may_grow_without_bound(ratio):
    """Backlash far below the deflections: Hill's equation, where it is unstable.

    Damped, it stays finite.
    """
    scene = {
        "gears": external_pair(
            {"teeth": 171, "profile_shift_coefficient": 0.0},
            98,
            module="0.01012 m",
            face_width="0.01012 m",
        ),
        "operation": {"torque": "2.31463 N*m", "speed": "271.6 rpm"},
        "mesh": {
            "stiffness": {
                "model": "potential-energy",
                "coupling": "shared",
                "hertz": "weber",
            },
            "normal_backlash": "1e-08 m",
            "damping_ratio": ratio,
            "damping_in": "contact",
        },
        "dynamics": {"model": "torsional"},
        "errors": {"harmonic": [{"order": 2, "amplitude": "3.067372e-05 m"}]},
    }
    with pytest.raises(Refused, match="grows without bound"):
        simulate(Scene.from_mapping(scene))


def test_a_life_whose_motion_comes_to_know_no_bound_ends_there(scene, monkeypatch):
    known = Periodic.solve
    seen = []

    def solve(self, system, tables, *more):
        seen.append(float(tables.gap[tables.stiffness > 0.0].mean()))
        if seen[-1] > seen[0] + 1e-6:
            raise Unbounded("grows")
        return known(self, system, tables, *more)

    monkeypatch.setattr(Periodic, "solve", solve)
    lived = simulate(
        scene("base case").replace("wear.until", {"depth": "20 um", "flank": "pinion"})
    )
    assert lived.end_reason == "unbounded motion"
    assert lived.verdict == "stopped"
    assert 1e-6 < lived.wear_depth[-1].max() < 20e-6

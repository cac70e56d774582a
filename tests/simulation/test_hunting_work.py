"""Lives of hunting teeth are bounded by what their work costs, in right-hand sides: no
clock is read.
"""

import numpy as np
import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import simulate, work

SMALL = 20.0  # times less work than a run may take
STEP = 6  # maps over all mesh periods that a step over cycles begins at most
PAIR = {
    "gears": external_pair({"teeth": 17, "profile_shift_coefficient": 0.3}, 23),
    "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
    "mesh": {"damping_ratio": 0.07, "extended_contact": False},
    "dynamics": {"model": "torsional"},
    "errors": {
        "seed": 1,
        "slow": "hunting",
        "pinion": {"total_composite": "12 um"},
        "gear": {"total_composite": "14 um"},
    },
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "20 um"},
    },
    "numerics": {"tolerance": 1e-2},
}


def work_of(scene):
    """Return the mesh periods of a scene's hunting teeth, and the
    work that its life may take.
    """
    parts = build(scene)
    return parts.vibration.hunting, work.max_work(scene, parts) * work.units(
        parts.vibration.system
    )


def test_many_periods_may_take_a_tenth_of_the_right_hand_sides_of_few():
    hunting = Scene.from_mapping(PAIR)
    few = hunting.replace({"gears.pinion.teeth": 24, "gears.gear.teeth": 48})
    averaged = hunting.replace("errors.slow", "averaged")
    (many, least), (some, more), (_, most) = map(work_of, (hunting, few, averaged))
    assert (many, some) == (17 * 23, 48) and some <= work.MANY_PERIODS < many
    assert more == pytest.approx(most) and most / least == pytest.approx(
        work.OUT_OF_CACHE
    )


@pytest.mark.slow
def test_a_life_of_hunting_teeth_ends_at_that_work_and_says_so(monkeypatch):
    """A twentieth of the bound, which takes a minute.

    Beyond it no more maps than a step needs.
    """
    scene = Scene.from_mapping(PAIR)
    monkeypatch.setattr(work, "MAX_WORK", work.MAX_WORK / SMALL)
    allowed = work.max_work(scene, build(scene))
    run = simulate(scene)
    assert str(run["end_reason"].values) == "work limit" and np.isnan(run["life"])
    counted, maps = (
        int(run[f"count_{of}"]) for of in ("right_hand_sides", "period_maps")
    )
    assert allowed < counted < allowed + STEP * counted / maps

"""Lives of hunting teeth are bounded by what their work costs, in right-hand sides: no
clock is read.
"""

import numpy as np
import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.gears.specification import GearError
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


MANY_TEETH = {
    "gears": external_pair(1999, 2003),
    "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
    "mesh": {"damping_ratio": 0.07},
    "errors": {"seed": 1, "slow": "hunting", "pinion": {"total_composite": "12 um"}},
    "dynamics": {"model": "torsional"},
}
COMMON = {"gears.pinion.teeth": 2000, "gears.gear.teeth": 2000}


def test_teeth_that_hardly_meet_again_are_refused_before_tables_fill_the_memory():
    """They asked for 18 GB, in a traceback."""
    scene = Scene.from_mapping(MANY_TEETH)
    with pytest.raises(
        GearError, match=r"1999 and 2003 teeth meet again after 4003997"
    ):
        build(scene)
    assert build(scene.replace(COMMON)).vibration.hunting == 2000
    assert build(scene.replace("errors.slow", "averaged")).vibration.hunting == 1


@pytest.mark.parametrize(
    ("teeth", "need"), [((1999, 2003), "GB"), ((601, 607), "values of waves")]
)
def test_so_are_measured_pitches_of_such_teeth(teeth, need):
    """Their transmission error was worked out for hours, and filled the memory."""
    pitch = [f"{(7919 * k) % 23 - 11} um" for k in range(1, teeth[0])]
    still = {key: table for key, table in MANY_TEETH.items() if key != "dynamics"}
    still["gears"] = external_pair(*teeth)
    still["errors"] = {"slow": "hunting", "pinion": {"pitch": [*pitch, "0 um"]}}
    scene = Scene.from_mapping(still)
    with pytest.raises(GearError, match=f"{need}.*: give numbers of teeth with a"):
        build(scene)
    build(scene.replace("gears.gear.teeth", teeth[0]))

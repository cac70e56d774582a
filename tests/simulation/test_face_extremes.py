"""Flanks with a width at their edges: each scene has a verdict, with its loads in
balance, or one message.
"""

import re

import numpy as np
import pytest
from scenes import GEAR_UNIT

from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate

PAIR = {
    **GEAR_UNIT,
    "mesh": {"stiffness": {"model": "potential-energy"}, "face_points": 15},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "2 um"},
        "snapshots": {"depth": ["1 um"]},
    },
    "numerics": {"profile_points": 41},
}


def width_of_overlap(overlap, degrees):
    width = float(overlap * np.pi * 4.0 / np.sin(np.radians(degrees)))
    return {
        "gears.helix_angle": f"{degrees} deg",
        "gears.face_width": f"{width:.6f} mm",
    }


LIVES = {
    "overlap 0.01": width_of_overlap(0.01, 0.2),
    "overlap 5": width_of_overlap(5.0, 28.0),
    "narrow": {"gears.face_width": "8 mm", "mesh.misalignment": "5 um"},
    "wide": {"gears.face_width": "160 mm", "mesh.misalignment": "30 um"},
    "one corner": {
        "gears.helix_angle": "12 deg",
        "mesh.misalignment": "400 um",
        "gears.pinion.profile_slope": "60 um",
        "operation.torque": "5 N*m",
    },
    "half a face": {"mesh.misalignment": "60 um", "operation.torque": "120 N*m"},
    "crowned": {"gears.pinion.lead_crowning": "60 um"},
    "hollow": {"gears.pinion.lead_crowning": "-20 um"},
    "hardly turned": {"gears.helix_angle": "0 deg"},
    "without load": {
        "operation.torque": "0 N*m",
        "wear.until": {"cycles": 1e6},
        "wear.snapshots": None,
    },
}


def scene(changes):
    given = dict(changes)
    drop = [key for key, value in given.items() if value is None]
    mapping = {key: value for key, value in PAIR.items()}
    if drop:
        mapping["wear"] = {
            key: value
            for key, value in PAIR["wear"].items()
            if f"wear.{key}" not in drop
        }
    return Scene.from_mapping(mapping).replace(
        {key: v for key, v in given.items() if v is not None}
    )


@pytest.mark.parametrize("name", LIVES)
def test_a_face_at_its_edge_lives_to_its_end_and_carries_its_force(name):
    run = simulate(scene(LIVES[name]))
    assert run["verdict"].item() == "completed"
    deepest = run["max_wear_depth"].values.max(axis=1)
    assert np.isfinite(run["line_load"].values).all() and np.isfinite(deepest).all()
    if name == "without load":
        assert not run["line_load"].values.any() and "face_load_factor" not in run
        return
    assert run["residual_line_load"].values.max() < 1e-9
    assert (
        deepest[-1] == pytest.approx(2e-6, rel=1e-3) and (np.diff(deepest) > 0.0).all()
    )
    carrying = (run["mean_line_load"].values[0, 0] > 0.0).mean()
    factor = run["face_load_factor"].values[0, 0]
    assert factor >= 1.0 - 1e-9
    if name in ("one corner", "half a face"):
        assert carrying < 0.8 and factor > 2.0
    if name == "hollow":
        load = run["mean_line_load"].values[0, 0]
        assert load[[0, -1]].min() > 1.05 * load[len(load) // 2]


def test_the_end_that_carries_may_change_with_the_load_and_with_wear():
    """Shafts that bend open the other end under the light load.

    What wore there gives the load back.
    """
    bends = {"torque": ["100 N*m", "320 N*m"], "value": ["-20 um", "20 um"]}
    stages = [
        {"label": "heavy", "torque": "320 N*m", "speed": "1450 rpm", "cycles": 2e6},
        {"label": "light", "torque": "100 N*m", "speed": "1450 rpm", "cycles": 2e7},
    ]
    mapping = {
        **PAIR,
        "operation": {"stage": stages},
        "wear": {"coefficient": PAIR["wear"]["coefficient"]},
    }
    run = simulate(Scene.from_mapping(mapping).replace("mesh.misalignment", bends))
    assert run["verdict"].item() == "completed"
    load = run["mean_line_load"].values[:, 0]
    heavy = run["update_stage"].values == "heavy"
    ends = load[:, :3].sum(axis=1) - load[:, -3:].sum(axis=1)
    assert (ends[heavy] > 0.0).all() and (ends[~heavy] < 0.0).all()
    assert heavy.sum() > 1 and (~heavy).sum() > 1
    for own in (heavy, ~heavy):
        assert np.abs(ends[own])[-1] < np.abs(ends[own])[0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {
                **width_of_overlap(0.1, 20.0),
                "gears.pinion.addendum_coefficient": 0.5,
                "gears.gear.addendum_coefficient": 0.5,
            },
            "total contact ratio 0.9237 is below 1, with 0.1000 of overlap: .*; enl",
        ),
        ({"gears.helix_angle": "50 deg"}, "helix_angle must lie between 0 and 45 deg"),
        (
            {
                "gears.helix_angle": "12 deg",
                "gears.pinion.hand": "left",
                "gears.gear.hand": "left",
            },
            "opposite",
        ),
        ({"gears.pinion.hand": "left"}, "give gears.helix_angle"),
        (
            {"gears.pinion.end_relief": {"amount": "-5 um", "length": "4 mm"}},
            "end_relief.amount",
        ),
        ({"mesh.face_points": 2}, "mesh.face_points"),
        ({"mesh.misalignment": "20"}, "mesh.misalignment"),
        (
            {"mesh.misalignment": {"torque": ["0 N*m"], "value": ["1 um", "2 um"]}},
            "one for each torque",
        ),
        ({"gears.helix_angle": "-12 deg"}, "gears.helix_angle"),
        ({"mesh.face_coupling": "springs"}, "mesh.face_coupling"),
    ],
)
def test_what_no_face_can_be_is_refused_in_one_message(changes, said):
    with pytest.raises((SceneError, ValueError)) as caught:
        simulate(scene(changes))
    told = str(caught.value)
    assert re.search(said, told) and len(told.splitlines()) <= 2

"""Lives of a planetary set at rest: every flank may end it, be worn
first, and tell its passes.
"""

from functools import cache

import numpy as np
import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.scene.problems import SceneError
from wearlab.simulation import simulate

BY_HAND = (
    ("wear.contact_patch", "none"),
    ("mesh.stiffness", {"model": "potential-energy"}),
    ("mesh.extended_contact", False),
)
"""Point by point and linear in the load, as a life by hand is."""
PASSES = {
    "sun": 3.0,
    "planet-sun": 20 / 29,
    "planet-ring": 20 / 29,
    "ring": 3 * 20 / 79,
}


@cache
def still():
    """NGW11-6 under its static load, point by point, as hand calculations have it.

    Few nodes.
    """
    scene = load(CAMPAIGNS / "planetary_torque.toml").cases[0].scene
    for key, value in (
        ("wear.load", "static"),
        ("dynamics", None),
        ("wear.snapshots", None),
        *BY_HAND,
        ("numerics.profile_points", 81),
        ("wear.coefficient", {"model": "constant", "value": "2.4e-16 m^2/N"}),
    ):
        scene = scene.replace(key, value)
    return scene


@pytest.mark.parametrize("flank", list(PASSES))
def test_every_flank_may_end_the_life(flank):
    data = simulate(
        still()
        .replace("wear.until", None)
        .replace("wear.until", {"depth": "4 um", "flank": flank})
    )
    assert str(data.end_reason.values) == "depth"
    assert float(data.max_wear_depth.sel(flank=flank)[-1]) == pytest.approx(
        4e-6, rel=1e-9
    )
    np.testing.assert_allclose(
        data.load_cycles[-1], float(data.life) * np.array(list(PASSES.values()))
    )
    np.testing.assert_allclose(data.mesh_cycles, 20 * data.cycle)
    relative = 1500 / 60 * 79 / 99  # turns of the sun a second, seen from the carrier
    assert float(data.service_life) == pytest.approx(float(data.life) / relative)
    assert float(data.remaining_useful_life[0]) == float(data.life)


@pytest.mark.parametrize("flank", ["planet-sun", "ring"])
def test_only_the_named_flank_begins_worn(flank):
    data = simulate(
        still()
        .replace("wear.until", {"depth": "40 um"})
        .replace(f"wear.initial.{flank}", {"depth": "5 um"})
    )
    first = data.max_wear_depth.isel(update=0)
    assert float(first.sel(flank=flank)) == pytest.approx(5e-6, rel=1e-9)
    assert float(first.sum()) == pytest.approx(5e-6, rel=1e-9)


def test_deep_wear_shortens_the_life_by_its_share():
    """The deepest node carries one pair's load alone, so that its
    rate stays, as W23's nearly does.
    """
    new, worn = (
        float(simulate(one).life)
        for one in (still(), still().replace("wear.initial.sun", {"depth": "100 um"}))
    )
    assert worn / new == pytest.approx(0.75, abs=2e-3)


def test_a_deep_life_is_within_its_estimate():
    """Wear of fifty deflections: half the nodes, asked at its shape, told a third."""
    scene = load(CAMPAIGNS / "base" / "planetary_ngw11_coupled.toml").cases[0].scene
    for key, value in (
        ("wear.load", "static"),
        ("dynamics", None),
        ("wear.snapshots", None),
        ("wear.coefficient", {"model": "constant", "value": "1e-16 m^2/N"}),
        ("wear.until.depth", "200 um"),
    ):
        scene = scene.replace(key, value)
    run = simulate(scene)
    finer = simulate(scene.replace("numerics.profile_points", 401))
    error = 2.0 * abs(float(finer.life) - float(run.life))  # of first order in nodes
    told = float(run.error_estimate_life)
    assert 5e-4 * float(run.life) < error < told < 4.0 * error


def test_duty_of_a_planetary_set_mixes_the_lives():
    """The rate of the deepest node is the torque's: 1/N = Σ w/N_b,
    with weights by cycles.
    """
    blocks = [
        {"torque": "30 N*m", "speed": "1500 rpm", "share": 0.5},
        {"torque": "150 N*m", "speed": "500 rpm", "share": 0.5},
    ]
    lives = [
        float(simulate(still().replace("operation.torque", block["torque"])).life)
        for block in blocks
    ]
    mixed = simulate(still().replace("operation.duty", blocks))
    assert 1.0 / float(mixed.life) == pytest.approx(
        0.75 / lives[0] + 0.25 / lives[1], rel=2e-3
    )
    relative = 1000 / 60 * 79 / 99
    assert float(mixed.service_life) == pytest.approx(float(mixed.life) / relative)


@cache
def duty_life(label):
    case = next(
        c for c in load(CAMPAIGNS / "planetary_duty.toml").cases if c.label == label
    )
    scene = case.scene.replace("wear.load", "static").replace("dynamics", None)
    for key, value in (("wear.snapshots", None), *BY_HAND):
        scene = scene.replace(key, value)
    return simulate(scene)


def test_duty_campaign_by_hand():
    """Archard and Miner: 1/N = Σ w/N_b, N_b = 1.637e7 · 134 N·m / T_b, w by cycles of
    the carrier's view.
    """
    share = np.array([0.2, 0.5, 0.3])
    speed = np.array([1500, 1200, 600])
    torque = np.array([150, 90, 30])
    lives = 1.637e7 * 134 / torque
    weight = share * speed / (share @ speed)
    expected = 1.0 / (weight / lives).sum()
    mixed = duty_life("blocks by share")
    assert float(mixed.life) == pytest.approx(expected, rel=1e-3)
    relative = share @ speed / 60 * 79 / 99
    assert float(mixed.service_life) == pytest.approx(expected / relative, rel=1e-3)
    by_label = {
        case.label: case for case in load(CAMPAIGNS / "planetary_duty.toml").cases
    }
    assert by_label["load-duration table"].id == by_label["blocks by share"].id


@pytest.mark.parametrize(
    ("first", "torques"), [("heavy", (150, 30)), ("light", (30, 150))]
)
def test_stages_in_order_by_hand(first, torques):
    """5 million cycles use up their share of the first life, the rest
    is left of the second.
    """
    lives = [1.637e7 * 134 / torque for torque in torques]
    run = duty_life(f"{first} first")
    expected = 5e6 + (1.0 - 5e6 / lives[0]) * lives[1]
    assert float(run.life) == pytest.approx(expected, rel=1e-3)
    assert (
        run.update_stage.values[0] == first and len(set(run.update_stage.values)) == 2
    )


def test_calibration_names_a_flank_of_the_set():
    given = {
        "model": "calibrated",
        "life": 1e7,
        "depth": "400 um",
        "torque": "134 N*m",
        "speed": "1500 rpm",
    }
    with pytest.raises(
        SceneError, match="no flank of this gear set; there are sun, planet-sun"
    ):
        still().replace("wear.coefficient", {**given, "flank": "pinion"})
    with pytest.raises(SceneError, match="one coefficient for all members"):
        constant = {"model": "constant", "value": "1e-16 m^2/N"}
        still().replace(
            "wear.coefficient", {**constant, "sun": {**given, "flank": "sun"}}
        )

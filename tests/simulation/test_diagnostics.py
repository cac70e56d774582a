"""A life that has ended is stored, whatever fails of what is found of it afterwards."""

import numpy as np
import pytest
from scenes import CAMPAIGNS, internal_pair

from wearlab.campaign import load
from wearlab.scene import Scene
from wearlab.simulation import attractors, estimates, simulate
from wearlab.simulation.dataset import exact_contact, model_errors, path

LIGHT = {
    "gears": internal_pair(
        26,
        {"teeth": 66, "tip_alteration": "wang-2023", "rim_diameter": "95 mm"},
        module="1.25 mm",
        face_width="14 mm",
    ),
    "operation": {"torque": "2 N*m", "speed": "1500 rpm"},
    "mesh": {"contact": "exact"},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "3 um"},
    },
    "numerics": {"profile_points": 61, "phase_points": 32, "cycle_tolerance": 1e-2},
}
"""Worn by 3 µm, its flanks have a shape that overhangs long before it is 1 mm deep."""
BRIEF = LIGHT | {"wear": LIGHT["wear"] | {"until": {"cycles": 1e8}}}


def failing(*_, **__):
    raise ZeroDivisionError("no such number\nsecond line")


@pytest.fixture
def brief():
    return Scene.from_mapping(BRIEF)


def test_a_life_whose_flanks_cannot_be_as_deep_as_a_diagnostic_looks_is_stored():
    ended = simulate(Scene.from_mapping(LIGHT))
    assert ended.end_reason.item() in ("depth", "section vanished")
    assert float(ended.max_wear_depth[-1].max()) > 2.5e-6
    assert (
        np.isfinite(ended.first_order_excess[-1, 0])
        and "not computed" not in ended.validity.item()
    )


def test_of_a_mesh_relationship_that_fails_the_rest_is_there(monkeypatch, brief):
    monkeypatch.setattr(exact_contact.relation, "contact_loss", failing)
    ended = simulate(brief)
    assert ended.contact_loss.isnull().all() and ended.contact_angle.isnull().all()
    assert np.isfinite(ended.first_order_excess[-1, 0])
    told = [
        line
        for line in ended.validity.item().split("\n")
        if line.startswith("not computed")
    ]
    assert told == [
        "not computed: exact mesh relationship of pinion-ring: no such number"
    ]


@pytest.mark.parametrize(
    ("name", "told", "missing"),
    [
        ("other_attractors", "search for other attractors", "attractor_search"),
        ("model_errors", "model error", None),
        ("estimated", "estimates", None),
    ],
)
def test_what_fails_after_a_life_is_missing_and_told(
    monkeypatch, brief, name, told, missing
):
    module = {
        "model_errors": model_errors,
        "other_attractors": attractors,
        "estimated": estimates,
    }[name]
    monkeypatch.setattr(module, name, failing)
    ended = simulate(brief)
    assert ended.sizes["update"] >= 2 and float(ended.max_wear_depth[-1].max()) > 0.0
    assert f"not computed: {told}: no such number" in ended.validity.item().split("\n")
    assert missing is None or missing not in ended
    if name == "estimated":
        assert ended.error_estimate_wear_depth.isnull().all()
        assert ended.estimate_quality.item().startswith(
            "doubtful: its errors could not be estimated"
        )


def test_contact_that_fails_after_a_life_is_missing_and_told(monkeypatch, brief):
    monkeypatch.setattr(path, "path_values", failing)
    ended = simulate(brief)
    assert "tooth_force" not in ended and "wear_depth" in ended
    assert (
        "not computed: values along the path: no such number" in ended.validity.item()
    )


def test_a_scene_without_a_life_still_fails_by_its_own_error(monkeypatch):
    alone = {name: part for name, part in BRIEF.items() if name != "wear"}
    monkeypatch.setattr(path, "path_values", failing)
    with pytest.raises(ZeroDivisionError):
        simulate(Scene.from_mapping(alone))


def test_a_run_whose_flanks_part_says_for_how_long_and_one_in_contact_does_not() -> (
    None
):
    cases = {
        case.label: case.scene
        for case in load(CAMPAIGNS / "extremes" / "backlash.toml").cases
    }
    parting = simulate(cases["none"])
    said = [
        line
        for line in parting["validity"].item().split("\n")
        if line.startswith("contact lost")
    ]
    share = float(parting["separation_fraction"].max())
    assert share > 0.05
    assert said == [
        f"contact lost for {100 * share:.2g} % of the time: outside what the damping "
        "is known for; teeth strike when they meet again"
    ]
    held = simulate(cases["none"].replace("mesh.damping_ratio", 0.9))
    assert float(held["separation_fraction"].max()) == 0.0
    assert "contact lost" not in held["validity"].item()

"""Random scenes over many decades: finite data whose invariants
close, or a named refusal.
"""

from collections import Counter

import numpy as np
import pytest
import random_scenes
from hypothesis import HealthCheck, Phase, given, seed, settings
from scenes import external_pair

from wearlab.scene import Scene
from wearlab.simulation import Refused, simulate

SEED = 1
"""Of the drawn scenes: a number, not a hash of the test's own text,
which formatting moves.
"""
NEVER_IN_CONTACT = {
    "gears": external_pair(
        {"teeth": 185, "profile_shift_coefficient": 0.2},
        140,
        module="0.001273 m",
        face_width="0.001273 m",
    ),
    "operation": {"torque": "0.00155729 N*m", "speed": "5353.0 rpm"},
    "mesh": {
        "stiffness": {
            "model": "potential-energy",
            "coupling": "shared",
            "hertz": "weber",
        },
        "damping_ratio": 1.0,
        "damping_in": "always",
    },
    "dynamics": {"model": "torsional"},
    "errors": {"harmonic": [{"order": 3, "amplitude": "2.269759e-09 m"}]},
    "wear": {
        "coefficient": {"model": "constant", "value": "8.746e-15 m^2/N"},
        "until": {"depth": "4.025e-06 m"},
    },
}
"""Teeth that a dashpot keeps apart for whole periods, under 14 mN."""
KINDS = [
    (random_scenes.scenes(), 21),
    (random_scenes.internal_pairs(), 15),
    (random_scenes.planetary_sets(), 15),
    pytest.param(random_scenes.scenes(), 40, marks=pytest.mark.slow),
    pytest.param(random_scenes.internal_pairs(moving=True), 12, marks=pytest.mark.slow),
    pytest.param(random_scenes.planetary_sets(moving=True), 12, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(
    ("drawn", "examples"),
    KINDS,
    ids=[
        "external pairs",
        "internal pairs",
        "planetary sets",
        "more external pairs",
        "internal moving",
        "planetary moving",
    ],
)
def test_random_scenes_are_finite_or_refused_by_name(drawn, examples):
    verdicts: Counter[str] = Counter()

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @seed(SEED)
    @given(drawn)
    def run(mapping):
        verdict, rules = random_scenes.outcome(mapping)
        verdicts[verdict] += 1
        assert rules == [], mapping

    run()
    assert verdicts["refused"] <= 0.2 * verdicts.total()
    assert verdicts["completed"] >= 0.3 * verdicts.total()


def test_teeth_that_a_dashpot_keeps_apart_carry_the_load_in_the_mean():
    _, rules = random_scenes.outcome(NEVER_IN_CONTACT)
    assert rules == []


def test_the_rules_see_what_is_broken():
    mapping = {
        "gears": external_pair(50, 50),
        "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
        "mesh": {"damping_ratio": 0.05},
        "dynamics": {"model": "torsional"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": "2 um"},
        },
    }
    good = simulate(Scene.from_mapping(mapping))
    assert random_scenes.broken(good) == []
    for name, factor in (
        ("mesh_stiffness", np.nan),
        ("residual_load_share", np.inf),
        ("wear_depth", -1.0),
        ("residual_mean_force", 1e9),
    ):
        assert random_scenes.broken(
            good.assign({name: good[name] * factor + 0 * factor})
        ), name


@pytest.mark.parametrize(
    ("numerics", "speed", "reason"),
    [
        ({}, "0.1 rpm", "quasi-static: drop"),
        ({"steps_per_period": 8}, "300 rpm", "beyond the stability of Runge-Kutta 4"),
    ],
)
def test_work_without_bound_and_unstable_steps_are_refused(numerics, speed, reason):
    mapping = {
        "gears": external_pair(20, 40, module="0.5 mm", face_width="5 mm"),
        "operation": {"torque": "0.1 N*m", "speed": speed},
        "mesh": {"damping_ratio": 0.05},
        "dynamics": {"model": "torsional"},
        "numerics": numerics,
    }
    with pytest.raises(Refused, match=reason):
        simulate(Scene.from_mapping(mapping))

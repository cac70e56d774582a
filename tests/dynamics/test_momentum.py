"""Momentum: over an orbit the normal forces that wear carry what the loads ask for,
whatever contact does.
"""

from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from momentum_balance import unbalanced
from plain_planetary import BREAKS, PERIOD, planetary, torsional
from plain_planetary import tables as meshes
from scenes import external_pair

from wearlab.dynamics.forces.mesh_forces import (
    forces_within,
    mean_over_period,
    within_steps,
)
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.mesh.stages import StageGrid, stage_grid
from wearlab.scene import Scene
from wearlab.simulation import simulate


@pytest.mark.parametrize(
    ("pair", "rpm", "parts"),
    [
        (BenchmarkPair(), 1860, False),
        (BenchmarkPair(amplitude=6e-6), 6000, True),
        (BenchmarkPair(torque=60.0, amplitude=8e-6, backlash=1e-4), 9750, True),
    ],
)
def test_a_pair_carries_its_load_by_the_force_that_wears(
    pair: BenchmarkPair, rpm: float, parts: bool
) -> None:
    response = Periodic().solve(
        pair.system(), pair.tables(pair.grid(6000)), mesh_period(rpm)
    )
    assert response.period > 0
    apart = forces_within(response, np.array([0.5])).reserve.min() < 0.0
    assert apart == parts
    assert np.abs(unbalanced(response)).max() < 1e-6


@pytest.mark.parametrize(("build", "mu"), [(planetary, None), (torsional, 0.1)])
@pytest.mark.parametrize("amplitude", [1e-6, 4e-6])
def test_a_planetary_set_carries_its_load_by_the_force_that_wears(
    build: Any, mu: float | None, amplitude: float
) -> None:
    response = Periodic().solve(
        build(), meshes(stage_grid(BREAKS, 1500), mu, amplitude), PERIOD
    )
    assert response.period > 0
    assert np.abs(unbalanced(response)).max() < 1e-6


def test_a_short_blow_of_a_flank_that_comes_into_contact_counts_in_the_mean() -> None:
    """Its damping force, 26 times the load, lasts for a third of a
    step of 50 a period.
    """
    scene = Scene.from_mapping(
        {
            "gears": external_pair(105, 17, module="17.55 mm", face_width="44 mm"),
            "operation": {"torque": "202.194 N*m", "speed": "21130 rpm"},
            "mesh": {
                "stiffness": {
                    "model": "potential-energy",
                    "coupling": "shared",
                    "hertz": "weber",
                },
                "normal_backlash": "2.858e-8 m",
                "damping_ratio": 0.0229,
                "damping_in": "contact",
            },
            "dynamics": {"model": "torsional"},
            "numerics": {"steps_per_period": 50},
        }
    )
    dataset = simulate(scene)
    assert float(dataset.normal_force_factor.item()) > 20.0
    assert abs(float(dataset.residual_mean_force.item())) < 1e-4


def test_means_count_jumps_within_steps() -> None:
    def values(steps: StageGrid) -> Any:
        phase = within_steps(steps)[0]
        return np.stack(
            [np.where(phase < 0.2345, 26.0, 1.0), np.sin(2.0 * np.pi * phase) ** 2]
        )

    mean = mean_over_period(stage_grid(np.array([0.0, 0.6, 1.0]), 20), values)
    np.testing.assert_allclose(mean, [1.0 + 25.0 * 0.2345, 0.5], atol=5e-5)


def test_a_wave_without_a_mean_is_not_halved_for_ever() -> None:
    asked = []

    def values(steps: StageGrid) -> Any:
        asked.append(len(steps.start))
        return np.sin(2.0 * np.pi * within_steps(steps)[0])

    assert abs(mean_over_period(stage_grid(np.array([0.0, 1.0]), 20), values)) < 1e-12
    assert sum(asked) < 200

"""Momentum: over an orbit the normal forces that wear carry what the loads ask for, whatever contact does."""

from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from momentum_balance import unbalanced
from plain_planetary import BREAKS, PERIOD, planetary, torsional
from plain_planetary import tables as meshes

from wearlab.dynamics.forces.extremes import forces_within
from wearlab.dynamics.orbits.periodic import Periodic
from wearlab.mesh.stages import stage_grid


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
    response = Periodic().solve(pair.system(), pair.tables(pair.grid(6000)), mesh_period(rpm))
    assert response.period > 0
    apart = forces_within(response, np.array([0.5])).reserve.min() < 0.0
    assert apart == parts
    assert np.abs(unbalanced(response)).max() < 1e-6


@pytest.mark.parametrize(("build", "mu"), [(planetary, None), (torsional, 0.1)])
@pytest.mark.parametrize("amplitude", [1e-6, 4e-6])
def test_a_planetary_set_carries_its_load_by_the_force_that_wears(
    build: Any, mu: float | None, amplitude: float
) -> None:
    response = Periodic().solve(build(), meshes(stage_grid(BREAKS, 1500), mu, amplitude), PERIOD)
    assert response.period > 0
    assert np.abs(unbalanced(response)).max() < 1e-6

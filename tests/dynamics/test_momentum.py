"""Momentum: over an orbit the normal forces that wear carry what the loads ask for, whatever contact does."""

from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from plain_planetary import BREAKS, PERIOD, planetary, torsional
from plain_planetary import tables as meshes

from wearlab.dynamics.forces.extremes import forces_within
from wearlab.dynamics.orbits.periodic import Periodic
from wearlab.dynamics.orbits.response import Response
from wearlab.mesh.stages import parabola, stage_grid

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


def unbalanced(response: Response) -> np.ndarray:
    """Return what the mean of all forces leaves of the loads on every coordinate, over the largest load."""
    system = response.system
    forces = forces_within(response, 0.5 + 0.5 * NODES)
    tables, width = response.tables, response.tables.width

    def mean(values: Any) -> Any:
        return np.einsum("x,s,kxs...->...", 0.5 * WEIGHTS, width, values) / len(values)

    q, v = (mean(part) for part in _motion(response))
    left = system.load - mean(forces.normal) @ system.direction
    left = left - system.total_stiffness @ q - system.total_damping @ v
    step, fraction = np.tile(np.arange(len(width)), len(NODES)), np.repeat(0.5 + 0.5 * NODES, len(width))
    rubbing = ((tables.sliding, system.friction_constant), (tables.moment, system.friction_slope))
    for table, vectors in rubbing:
        if table is not None and vectors is not None:
            at = parabola(table, step, fraction).reshape(len(NODES), *table.shape[:1], *table.shape[2:])
            left = left - mean((at * forces.pair_normal).sum(axis=-1)) @ vectors
    return left / np.abs(system.load).max()


def _motion(response: Response) -> list[np.ndarray]:
    steps = len(response.tables.width)
    at = response.motion.at(np.tile(np.arange(steps), len(NODES)), np.repeat(0.5 + 0.5 * NODES, steps))
    return [part.reshape(len(part), len(NODES), steps, -1) for part in at]


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
    assert np.abs(unbalanced(response)).max() < 2e-6


@pytest.mark.parametrize(("build", "mu"), [(planetary, None), (torsional, 0.1)])
@pytest.mark.parametrize("amplitude", [1e-6, 4e-6])
def test_a_planetary_set_carries_its_load_by_the_force_that_wears(
    build: Any, mu: float | None, amplitude: float
) -> None:
    response = Periodic().solve(build(), meshes(stage_grid(BREAKS, 1500), mu, amplitude), PERIOD)
    assert response.period > 0
    assert np.abs(unbalanced(response)).max() < 2e-6

"""Largest and smallest mesh forces against SciPy's march from jump to
jump of every mesh.
"""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from plain_planetary import BREAKS, PERIOD, pairs, planetary, tables, torsional
from scipy.integrate import solve_ivp

from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response, deflection_at
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.mesh.stages import stage_grid

AMPLITUDE = 1e-6


def forces(
    response: Response, phase: float, middle: float, state: Any, mu: float
) -> Any:
    """Elastic force of the six meshes and the acceleration they leave, by formulas."""
    system = response.system
    n = len(state) // 2
    angle = 2.0 * np.pi * phase + np.arange(6)
    delta = system.direction @ state[:n] - AMPLITUDE * np.sin(angle)
    rate = (
        system.direction @ state[n:] - AMPLITUDE * 2.0 * np.pi * np.cos(angle) / PERIOD
    )
    elastic = np.zeros(6)
    load = system.load - system.total_stiffness @ state[:n]
    normal = np.zeros(6)
    load = load - system.total_damping @ state[n:]
    for m in range(6):
        springs = pairs(m, phase, middle, mu)
        every = sum(float(k) for k, _, _ in springs)
        for k, sliding, position in springs:
            force = float(k) * max(delta[m], 0.0)
            elastic[m] += force
            if force > 0.0:
                force = max(
                    0.0, force + system.mesh_damping[m] * float(k) / every * rate[m]
                )
            normal[m] += force
            if (
                mu
                and system.friction_constant is not None
                and system.friction_slope is not None
            ):
                load -= float(sliding) * force * system.friction_constant[m]
                load -= float(sliding * position) * force * system.friction_slope[m]
    load = load - system.direction.T @ normal
    return elastic, np.linalg.solve(system.mass, load)


@pytest.mark.parametrize(("build", "mu"), [(torsional, 0.1), (planetary, 0.0)])
def test_extremes_of_lagging_meshes_are_those_of_an_independent_march(
    build: Any, mu: float
) -> None:
    grid = stage_grid(BREAKS, 300)
    system = build(friction=bool(mu))
    response = Periodic().solve(system, tables(grid, mu or None, AMPLITUDE), PERIOD)
    assert response.period == 1
    state = response.state[0, 0]
    seen = []
    for low, high in pairwise([*BREAKS, 1.0]):
        middle = 0.5 * (low + high)

        def rate(phase: float, y: Any, middle: float = middle) -> Any:
            return (
                PERIOD
                * np.r_[y[len(y) // 2 :], forces(response, phase, middle, y, mu)[1]]
            )

        at = np.linspace(low, high, max(12, int(6000 * (high - low))))
        path = solve_ivp(rate, (low, high), state, "DOP853", at, rtol=1e-8, atol=1e-14)
        seen += [
            forces(response, x, middle, y, mu)[0]
            for x, y in zip(path.t, path.y.T, strict=True)
        ]
        state = path.y[:, -1]
    found = extremes(response)
    np.testing.assert_allclose(found.largest, np.max(seen, axis=0), rtol=1e-4)
    np.testing.assert_allclose(
        found.least, np.min(seen, axis=0), atol=1e-4 * found.largest.max()
    )
    assert not found.separated.any()


def test_the_time_apart_is_that_of_dense_samples() -> None:
    pair = BenchmarkPair(amplitude=6e-6)
    grid = pair.grid(600)
    period = mesh_period(6000)
    response = Periodic().solve(pair.system(), pair.tables(grid), period)
    delta, _ = deflection_at(response, grid, (np.arange(200_000) + 0.5) / 200_000)
    apart = float(np.mean(delta <= 0.0))
    assert 0.2 < apart < 0.4
    assert extremes(response).separated == pytest.approx(apart, abs=1e-4)


def test_extremes_over_several_periods_are_the_extremes_of_each_alone() -> None:
    pair = BenchmarkPair(amplitude=6e-6)
    period = mesh_period(6000)
    shooting = Shooting(pair.system(), pair.tables(pair.grid(40)), period)
    _, path = shooting.integrate(np.zeros(shooting.rows), 12, 12)
    whole = shooting.aperiodic(path, 0.0)
    alone = [extremes(replace(whole, state=whole.state[[turn]])) for turn in range(12)]
    found = extremes(whole)
    np.testing.assert_allclose(
        found.largest, np.max([one.largest for one in alone], axis=0), rtol=1e-12
    )
    np.testing.assert_allclose(
        found.least, np.min([one.least for one in alone], axis=0), atol=1e-9
    )
    np.testing.assert_allclose(
        found.separated, np.mean([one.separated for one in alone], axis=0)
    )

"""What is read off a response."""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import (
    Response,
    accelerations,
    coordinates_at,
    deflection_at,
    step_forces,
    step_of,
)

PAIR = BenchmarkPair(ramp=0.0)
GRID = PAIR.grid(300)


@pytest.fixture(scope="module")
def response() -> Response:
    return Periodic().solve(PAIR.system(), PAIR.tables(GRID), mesh_period(1860))


def test_sides_of_a_break() -> None:
    jump = int(np.flatnonzero(GRID.segment == 1)[0])
    phase = GRID.start[[jump]]
    assert (
        step_of(GRID, phase)[0] == jump
        and step_of(GRID, phase, side="left")[0] == jump - 1
    )
    assert step_of(GRID, phase, np.array([0]))[0] == jump - 1
    assert step_of(GRID, phase, np.array([1]))[0] == jump
    assert step_of(GRID, np.array([0.0, 1.0]))[1] == len(GRID.start) - 1


def test_interpolation_meets_the_states_and_their_rates(response: Response) -> None:
    delta, rate = deflection_at(response, GRID, GRID.start)
    state = response.state[0, :-1]
    d = PAIR.system().direction[0]
    tables = response.tables
    np.testing.assert_allclose(
        delta[0, 0], state[:, :3] @ d - tables.error[:, 0, 0], rtol=1e-13
    )
    speed = state[:, 3:] @ d - tables.error_rate[:, 0, 0] / response.mesh_period
    np.testing.assert_allclose(rate[0, 0], speed, rtol=1e-9, atol=1e-12)
    middle = GRID.start + 0.37 * GRID.width
    step = 1e-4 * GRID.width.min()
    up, down = (deflection_at(response, GRID, middle + x)[0] for x in (step, -step))
    numeric = (up - down) / (2 * step * response.mesh_period)
    speed = deflection_at(response, GRID, middle)[1]
    np.testing.assert_allclose(speed, numeric, atol=2e-4 * np.abs(speed).max())


def test_coordinates_give_the_deflection(response: Response) -> None:
    phase = np.linspace(0, 1, 77)
    q, v = coordinates_at(response, GRID, phase)
    delta, _ = deflection_at(response, GRID, phase)
    e = PAIR.amplitude * np.sin(2 * np.pi * phase)
    np.testing.assert_allclose(
        np.einsum("kns,n->ks", q, [1, -1, 1]) - e, delta[:, 0], atol=1e-12
    )
    assert q.shape == v.shape == (1, 3, 77)


def test_acceleration_is_the_derivative_of_velocity_and_one_sided(
    response: Response,
) -> None:
    a = accelerations(response)
    v = response.state[..., 3:]
    h = (GRID.width * response.mesh_period)[None, :, None]
    mean = (v[:, 1:] - v[:, :-1]) / h
    np.testing.assert_allclose(a.mean(axis=2), mean, atol=2e-3 * np.abs(mean).max())
    jump = int(np.flatnonzero(GRID.segment == 1)[0])
    assert np.abs(a[0, jump, 0] - a[0, jump - 1, 1]).max() > 0.05 * np.abs(a).max()


def test_pair_forces_sum_to_the_drive_force(response: Response) -> None:
    forces = step_forces(response)
    np.testing.assert_allclose(forces.pair.sum(axis=-1), forces.elastic)
    assert forces.pair.shape == (1, len(GRID.width), 2, 1, 2)

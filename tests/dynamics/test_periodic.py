"""Steady responses: closed forms, verdicts on the benchmark pair, and the derivative of
the period map.
"""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response, deflection_at, step_forces
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.mesh.stages import StageGrid, StageTables

PAIR = BenchmarkPair()
LIGHT = PAIR._replace(
    torque=60.0, mesh_damping=300.0, bearing_damping=2000.0, amplitude=8e-6
)


def respond(
    pair: BenchmarkPair, rpm: float, steps: int = 300
) -> tuple[StageGrid, Response]:
    grid = pair.grid(steps)
    return grid, Periodic().solve(pair.system(), pair.tables(grid), mesh_period(rpm))


def constant(tables: StageTables, stiffness: float) -> StageTables:
    return tables._replace(stiffness=np.sign(tables.stiffness) * stiffness)


def test_constant_mesh_carries_the_static_force_to_rounding() -> None:
    pair = PAIR._replace(amplitude=0.0)
    tables = constant(pair.tables(pair.grid(200)), 3e8)
    response = Periodic().solve(pair.system(), tables, mesh_period(1860))
    np.testing.assert_allclose(
        step_forces(response).elastic, pair.system().load[-1], rtol=1e-12
    )
    assert response.verdict.deviations == ()


def test_constant_mesh_under_harmonic_error_has_the_closed_form() -> None:
    k, order = 3e8, 1
    system = PAIR.system()
    grid = PAIR.grid(800)
    period = mesh_period(2200)
    response = Periodic().solve(system, constant(PAIR.tables(grid), k), period)
    omega = 2 * np.pi * order / period
    c = system.mesh_damping[0]
    d = system.direction
    dynamic = system.stiffness + k * d.T @ d - omega**2 * system.mass
    dynamic = dynamic + 1j * omega * (system.damping + c * d.T @ d)
    e = -1j * PAIR.amplitude  # e = Re[e exp(iωt)] = a sin ωt
    q = np.linalg.solve(dynamic, (k + 1j * omega * c) * e * d[0])
    mean = np.linalg.solve(system.stiffness + k * d.T @ d, system.load)
    phase = np.linspace(0.0, 1.0, 57)
    wave = np.exp(2j * np.pi * phase)
    delta, rate = deflection_at(response, grid, phase)
    expected = d[0] @ mean + ((d[0] @ q - e) * wave).real
    np.testing.assert_allclose(
        delta[0, 0], expected, atol=1e-9 * np.abs(expected).max()
    )
    speed = (1j * omega * (d[0] @ q - e) * wave).real
    np.testing.assert_allclose(rate[0, 0], speed, atol=1e-6 * np.abs(speed).max())


@pytest.mark.parametrize(
    ("rpm", "largest"), [(800, 0.510), (1860, 0.748), (2200, 0.783), (3720, 0.866)]
)
def test_multipliers_of_the_benchmark_pair(rpm: float, largest: float) -> None:
    _, response = respond(PAIR, rpm)
    assert (
        response.period == 1
        and response.verdict.deviations == ()
        and response.counts.newton_iterations == 1
    )
    assert abs(response.multipliers[0]) == pytest.approx(largest, abs=1e-3)


def test_mean_of_elastic_and_damping_force_is_the_static_force() -> None:
    for pair, rpm in ((PAIR, 1860), (PAIR._replace(amplitude=6e-6), 6000)):
        grid, response = respond(pair, rpm, 600)
        forces = step_forces(response)
        mean = (forces.normal[0, :, :, 0].mean(axis=1) * grid.width).sum()
        assert mean == pytest.approx(pair.system().load[-1], rel=2e-6)


def test_separation_is_reported() -> None:
    _, response = respond(PAIR._replace(amplitude=6e-6), 6000)
    separated = (step_forces(response).elastic == 0.0).mean()
    assert response.period == 1 and 0.2 < separated < 0.4


@pytest.mark.parametrize(
    ("pair", "rpm", "period"),
    [
        (PAIR._replace(torque=5.0), 4900, 2),
        (LIGHT, 9750, 4),
        (LIGHT, 10000, 4),
        (
            LIGHT,
            4400,
            0,
        ),  # at 4500 the chaos may end after some ten thousand periods, in period 2
    ],
)
def test_subharmonic_and_aperiodic_responses_are_named(
    pair: BenchmarkPair, rpm: float, period: int
) -> None:
    _, response = respond(pair, rpm)
    assert response.period == period
    if period:
        assert response.state.shape[0] == period and abs(response.multipliers[0]) < 1.0
        assert np.abs(response.state[0, 0] - response.state[1, 0]).max() > 1e-3
    else:
        assert (
            response.state.shape[0] >= 200
            and "aperiodic" in response.verdict.deviations
        )
        assert response.residual > 0.1
        mean = step_forces(response).normal.mean()
        assert mean == pytest.approx(pair.system().load[-1], rel=0.1)


def test_undamped_orbit_is_found_and_not_attracting() -> None:
    _, response = respond(PAIR._replace(mesh_damping=0.0, bearing_damping=0.0), 1860)
    assert response.period == 1 and response.verdict.deviations == ("not attracting",)
    assert abs(response.multipliers[0]) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("amplitude", [0.0, 3e-6])
def test_zero_torque_does_not_crash_and_is_not_unique(amplitude: float) -> None:
    _, response = respond(PAIR._replace(torque=0.0, amplitude=amplitude), 1860)
    assert not response.verdict.unique and np.isfinite(response.state).all()


def test_warm_start_returns_to_the_same_orbit() -> None:
    grid, cold = respond(LIGHT, 10000)
    warm = Periodic().solve(
        LIGHT.system(), LIGHT.tables(grid), mesh_period(10000), cold
    )
    assert warm.period == 4 and warm.counts.period_maps <= 8
    np.testing.assert_allclose(warm.state, cold.state, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("always", [True, False])
def test_monodromy_is_the_derivative_of_the_map_with_separation(always: bool) -> None:
    pair = PAIR._replace(amplitude=6e-6, damping_always=always)
    grid = pair.grid(120)
    shooting = Shooting(pair.system(), pair.tables(grid), mesh_period(6000))
    state = (
        Periodic()
        .solve(pair.system(), pair.tables(grid), mesh_period(6000))
        .state[0, 0]
        * 1.01
    )
    _, derivative = shooting.path_of(state)
    scale = np.r_[np.full(3, 1e-10), np.full(3, 1e-10 * shooting.rate)]
    numeric = np.empty_like(derivative)
    for column, step in enumerate(scale):
        moved = np.zeros(6)
        moved[column] = step
        up, down = (
            shooting.path_of(state + sign * moved)[0][-1] for sign in (1.0, -1.0)
        )
        numeric[:, column] = (up - down) / (2 * step)
    weights = scale[None, :] / scale[:, None]
    assert (
        np.abs((derivative - numeric) * weights).max()
        < 1e-6 * np.abs(derivative * weights).max()
    )


def test_sharp_jumps_keep_fourth_order() -> None:
    for pair, rpm in (
        (PAIR._replace(ramp=0.0), 1860),
        (PAIR._replace(ramp=0.0, amplitude=6e-6), 6000),
    ):
        reference = respond(pair, rpm, 3200)[1].state[0, 0]
        errors = [
            np.abs(respond(pair, rpm, n)[1].state[0, 0] - reference).max()
            for n in (100, 200, 400)
        ]
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert (orders > 3.4).all(), (rpm, orders)

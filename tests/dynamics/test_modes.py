"""Modes and the rule for the number of steps."""

import numpy as np
import pytest
from benchmark_pair import BASE_RADIUS, BenchmarkPair, mesh_period

from wearlab.dynamics.integrators.count import fastest_rate, steps_per_period
from wearlab.dynamics.modes import critical_speeds, modes
from wearlab.dynamics.spur import Meshing, Paired, torsional
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import deflection_at
from wearlab.mesh.gear_set import Body

RPM = 30.0 / np.pi
PAIR = BenchmarkPair()


def two(body: Body) -> dict[str, Body]:
    return dict.fromkeys(("pinion", "gear"), body)


def test_l16_primary_resonance_of_one_degree_of_freedom() -> None:
    system = torsional(
        Paired(
            two(Body(0.0, 7.3e-3, BASE_RADIUS)), {}, Meshing(1e3), 340.0 / BASE_RADIUS
        )
    )
    found = modes(system, 2.788e8)
    assert critical_speeds(found.frequency, 50)[0, 0] * RPM == pytest.approx(
        3720, abs=2
    )
    np.testing.assert_allclose(found.participation, 1.0)


def test_l16_coupled_modes_of_three_degrees_of_freedom() -> None:
    found = modes(PAIR.system(), 2.788e8)
    speeds = critical_speeds(found.frequency, 50, 3) * RPM
    np.testing.assert_allclose(speeds[0, found.excited()], [2650, 5300], rtol=0.02)
    np.testing.assert_allclose(speeds[2], speeds[0] / 3)
    # Both gears moving together do not deflect the mesh of equal gears.
    np.testing.assert_array_equal(found.excited(), [True, False, True])
    np.testing.assert_allclose(found.participation.sum(axis=0), 1.0)
    stiff = critical_speeds(modes(PAIR.system(), 1e14).frequency, 50)[0, 0] * RPM
    assert stiff == pytest.approx(3134, rel=0.005)


def test_modes_solve_the_eigenproblem() -> None:
    system = PAIR.system()
    found = modes(system, 3e8)
    k = system.stiffness + 3e8 * system.direction.T @ system.direction
    for f, shape in zip(found.frequency, found.shape, strict=True):
        np.testing.assert_allclose(
            k @ shape, (2 * np.pi * f) ** 2 * system.mass @ shape, atol=1.0
        )
        assert shape @ system.mass @ shape == pytest.approx(1.0)


def test_fastest_rate_of_an_oscillator() -> None:
    system = torsional(Paired(two(Body(0.0, 2.0, 1.0)), {}, Meshing(), 1.0))
    assert fastest_rate(system, 1e6) == pytest.approx(1e3)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
@pytest.mark.parametrize("rpm", [800, 1860, 3720])
def test_steps_meet_their_tolerance(rpm: float, tolerance: float) -> None:
    system = PAIR.system()
    period = mesh_period(rpm)
    phase = np.arange(100) / 100
    found = []
    for steps in (steps_per_period(system, PAIR.double, period, tolerance, 5), 4000):
        grid = PAIR.grid(steps)
        found.append(
            deflection_at(
                Periodic().solve(system, PAIR.tables(grid), period), grid, phase
            )[0]
        )
    error = np.abs(found[0] - found[1]).max() / np.abs(found[1]).max()
    assert error < 2.0 * tolerance


def test_stiff_and_hardly_damped_takes_more_steps_and_stays_accurate() -> None:
    pair = PAIR._replace(
        double=3.7e10, single=2.2e10, mesh_damping=10.0, bearing_damping=53.6
    )
    system = pair.system()
    period = mesh_period(1860)
    normal = steps_per_period(PAIR.system(), PAIR.double, period, 1e-3)
    steps = steps_per_period(system, pair.double, period, 1e-3)
    assert (
        steps > 5 * normal and fastest_rate(system, pair.double) * period / steps < 1.0
    )
    phase = np.arange(100) / 100
    found = []
    for count in (steps, 8 * steps):
        grid = pair.grid(count)
        found.append(
            deflection_at(
                Periodic().solve(system, pair.tables(grid), period), grid, phase
            )[0]
        )
    assert np.abs(found[0] - found[1]).max() < 5e-2 * np.abs(found[1]).max()

"""Orbits in power series over groups of steps, against SciPy and against stages solved for."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from plain_planetary import BREAKS, OFFSET, PERIOD, pairs, tables, torsional
from scipy.integrate import solve_ivp

from wearlab.dynamics import folded
from wearlab.dynamics.balance import balance_of
from wearlab.dynamics.folded import Unfolded
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.ringing import Ringing
from wearlab.dynamics.ringing_plan import felt_first, orthonormal
from wearlab.dynamics.system import System
from wearlab.dynamics.touching import Parted
from wearlab.dynamics.turning import symmetry_of
from wearlab.mesh.stages import StageTables, stage_grid

SLOW, MU, AMPLITUDE = 4.0 * PERIOD, 0.1, 1e-6
KINDS = np.array([0, 3])
LONG = 160
"""Steps: they turn the fastest mode by several radians."""
LAGS = np.repeat(OFFSET[KINDS], 3)


def in_phase() -> System:
    system = torsional()
    return system._replace(symmetry=symmetry_of(system, 2.0 * np.pi * np.arange(3) / 3, LAGS))


def meshes(steps: int) -> StageTables:
    """Meshes of which those of all planets do the same, with an error of each kind."""
    grid = stage_grid(BREAKS, steps, 4)
    own = 2.0 * np.pi * (grid.phase[..., None] - LAGS)
    given = {name: table for name, table in tables(grid, MU)._asdict().items() if table is not None}
    alike = {
        name: np.repeat(table[:, :, KINDS], 3, axis=2) for name, table in given.items() if name != "width"
    }
    error, rate = AMPLITUDE * np.sin(own), 2.0 * np.pi * AMPLITUDE * np.cos(own)
    return StageTables(**(given | {"fluctuation": None} | alike))._replace(error=error, error_rate=rate)


def found(steps: int) -> Unfolded:
    response = Periodic().solve(in_phase(), meshes(steps), SLOW)
    assert isinstance(response, Unfolded) and isinstance(response.of_blocks[0], Ringing)
    return response


def integrated(system: System, start: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Return the states (2n,) at ascending phases from 0 on, by SciPy on the formulas of the meshes."""
    n, d = len(start) // 2, system.direction
    assert system.friction_constant is not None and system.friction_slope is not None

    def rate(time: float, y: np.ndarray, middle: float) -> np.ndarray:
        phase = time / SLOW
        own = 2.0 * np.pi * (phase - LAGS)
        delta = d @ y[:n] - AMPLITUDE * np.sin(own)
        speed = d @ y[n:] - 2.0 * np.pi * AMPLITUDE / SLOW * np.cos(own)
        each = [np.array(pairs(m, phase, middle, MU)) for m in KINDS]  # (pairs, k Λμ s)
        k, sliding, position = (np.repeat([pair[:, i] for pair in each], 3, axis=0) for i in range(3))
        force = k * delta[:, None]
        load = system.load - (force.sum(axis=1) + system.mesh_damping * speed) @ d
        load = load - (sliding * force).sum(axis=1) @ system.friction_constant
        load = load - (sliding * position * force).sum(axis=1) @ system.friction_slope
        return np.r_[y[n:], np.linalg.solve(system.mass, load)]

    states, state = np.empty((len(phases), 2 * n)), start
    for low, high in pairwise(np.append(BREAKS, 1.0)):
        at = (phases >= low) & (phases < high if high < 1.0 else phases <= high)
        times = np.append(phases[at], high) * SLOW
        path = solve_ivp(
            rate, (low * SLOW, high * SLOW), state, "DOP853", np.unique(times), args=(0.5 * (low + high),),
            rtol=1e-11, atol=1e-18,
        )  # fmt: skip
        states[at], state = path.y.T[: at.sum()], path.y[:, -1]
    return states


def sizes(states: np.ndarray) -> np.ndarray:
    n = states.shape[1] // 2
    return np.repeat([np.abs(states[:, :n]).max(), np.abs(states[:, n:]).max()], n)


def test_scipy_follows_the_series_at_the_ends_of_steps_and_within_them() -> None:
    response = found(LONG)
    grid = stage_grid(BREAKS, LONG, 4)
    assert np.abs(response.of_blocks[0].multipliers[0]) < 0.5  # it rings, and dies out
    expected = integrated(response.system, response.state[0, 0], grid.start)
    scale = sizes(expected)
    np.testing.assert_allclose(response.state[0, :-1] / scale, expected / scale, atol=2e-8)
    steps = np.arange(len(grid.width))
    expected = integrated(response.system, response.state[0, 0], grid.start + 0.3 * grid.width)
    position, speed = (one[0] for one in response.motion.at(steps, np.full(len(steps), 0.3)))
    np.testing.assert_allclose(np.hstack([position, speed]) / scale, expected / scale, atol=2e-8)
    position, speed = (one[0] for one in response.approach.at(steps, np.full(len(steps), 0.3)))
    seen = expected.reshape(len(steps), 2, -1) @ response.system.direction.T
    np.testing.assert_allclose(position, seen[:, 0], atol=2e-8 * np.abs(seen[:, 0]).max())
    np.testing.assert_allclose(speed, seen[:, 1], atol=2e-8 * np.abs(seen[:, 1]).max())


def test_scipy_brings_a_disturbance_where_the_derivative_does() -> None:
    response = found(LONG)
    system, start = response.system, response.state[0, 0]
    balance = balance_of(system, SLOW)
    assert balance is not None
    beside = start + 0.1 * sizes(start[None]) * np.random.default_rng(2).standard_normal(len(start))
    beside[balance.held] = start[balance.held]  # their columns are of the loads
    moved = integrated(system, beside, np.array([1.0]))[0]
    expected = start + response.map_derivative @ (beside - start)
    np.testing.assert_allclose(moved / sizes(start[None]), expected / sizes(start[None]), atol=1e-7)
    pushed = system._replace(load=system.load + 1e3 * system.mass @ balance.push[0])
    moved = integrated(pushed, start, np.array([1.0]))[0]
    expected = start + 1e3 * response.map_derivative[:, balance.held[0]]
    np.testing.assert_allclose(moved / sizes(start[None]), expected / sizes(start[None]), atol=1e-7)


def test_steps_as_long_as_the_meshes_let_them_be_tell_what_stages_do(monkeypatch: Any) -> None:
    long = found(LONG)
    monkeypatch.setattr(folded, "rings", lambda system: False)
    stages = Periodic().solve(in_phase(), meshes(1200), SLOW)
    assert isinstance(stages, Unfolded) and not isinstance(stages.of_blocks[0], Ringing)
    scale = sizes(stages.state[0])
    np.testing.assert_allclose(long.state[0, 0] / scale, stages.state[0, 0] / scale, atol=1e-7)
    np.testing.assert_allclose(long.system.load, stages.system.load, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(np.abs(long.multipliers), np.abs(stages.multipliers), atol=1e-9)


def test_flanks_that_part_for_a_moment_within_a_group_are_seen() -> None:
    """A gap of one pair as smooth as a group resolves, deeper than the flanks of the other reach, and not."""
    response, given = found(LONG), meshes(LONG)
    first = len(given.width) // 8 * 4
    u = (np.arange(4)[:, None] + np.array([0.0, 0.5, 1.0])) / 2.0 - 1.0
    deflections = response.approach.at(np.arange(first, first + 4), np.full(4, 0.5))[0][0, :, 0]
    for depth, parts in ((3.0, True), (0.3, False)):
        gap = given.gap.copy()
        gap[first : first + 4, :, :3, 1] += depth * deflections.max() * ((1.0 - u**2) ** 2)[..., None]
        held = Periodic().held_together(in_phase(), given._replace(gap=gap), SLOW)
        assert isinstance(held, Parted if parts else Unfolded)


def test_a_jump_inside_a_group_asks_for_other_groups() -> None:
    """Plans are kept; where tables jump elsewhere afterwards, groups are cut anew, or left to others."""
    system, given = in_phase(), meshes(LONG)
    one = Periodic().held_together(system, given, SLOW)
    stiffness = given.stiffness.copy()
    stiffness[6:] *= 0.9
    other = Periodic().held_together(system, given._replace(stiffness=stiffness), SLOW)
    assert isinstance(one, Unfolded) and isinstance(one.of_blocks[0], Ringing)
    assert not isinstance(other, Unfolded) or not isinstance(other.of_blocks[0], Ringing)


def test_what_no_mesh_feels_comes_last_in_the_basis() -> None:
    system = torsional()
    basis, felt = felt_first(system)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-14)
    assert felt == len(basis) - 1
    np.testing.assert_allclose(system.direction @ basis[felt:].T, 0.0, atol=1e-13)


@pytest.mark.parametrize("order", range(9))
def test_polynomials_on_the_stages_are_orthonormal(order: int) -> None:
    values, powers = orthonormal()
    np.testing.assert_allclose(values @ values[order], np.eye(9)[order], atol=1e-12)
    u = np.linspace(-1.0, 1.0, 9)
    np.testing.assert_allclose(
        np.polynomial.polynomial.polyval(u, powers[:, order]), values[order], atol=1e-12
    )

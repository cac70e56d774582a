"""Orbits of small systems whose flanks part, on a few long steps: pieces of motion as power series."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wearlab.dynamics.known import known_of
from wearlab.dynamics.parting import orbit_of_small
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response, step_forces
from wearlab.dynamics.system import System
from wearlab.dynamics.within import forces_within
from wearlab.mesh.stages import StageTables, stage_grid

PERIOD = mesh_period(6000)
LEAVES = 0.6
PAIR = BenchmarkPair(torque=160.0, mesh_damping=2500.0).system()
ONE = System(
    ("mesh.x",), np.array([[0.73]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)), np.array([1500.0]),
    np.array([1500.0]), False, np.array([0.73]), np.array([8e-6]),
)  # fmt: skip
GATED = PAIR._replace(damping_always=False)


def tables(steps: int, amplitude: float) -> StageTables:
    """Two smooth pairs, the leading one leaving at once at LEAVES, the trailing one with a gap of its own."""
    grid = stage_grid(np.array([0.0, LEAVES]), steps, 4)
    middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
    phase = grid.phase
    leading = np.where(middle < LEAVES, 1e8 * (1.0 + 0.2 * np.cos(3.0 * phase)), 0.0)
    stiffness = np.stack([leading, 2.5e8 * (1.0 + 0.1 * np.sin(5.0 * phase))], -1)
    gap = np.stack([1e-6 * np.sin(2.0 * np.pi * phase), 2e-6 * (phase - 0.4) ** 2], -1)
    angle = 2.0 * np.pi * phase[..., None]
    return StageTables(
        grid.width, stiffness[:, :, None, :], gap[:, :, None, :].copy(), amplitude * np.sin(angle),
        2.0 * np.pi * amplitude * np.cos(angle), None,
    )  # fmt: skip


CASES = {"one, back flank": (ONE, 12e-6), "gated": (GATED, 8e-6), "always damped": (PAIR, 8e-6)}


@pytest.fixture(scope="module", params=CASES, ids=list(CASES))
def case(request: pytest.FixtureRequest) -> tuple[System, float, Response, Response]:
    """A system, its error, its orbit on few steps, and that of shooting with many Runge-Kutta steps."""
    system, amplitude = CASES[request.param]
    few = Periodic().on_few_steps(system, tables(48, amplitude), PERIOD)
    assert few is not None
    return system, amplitude, few, Periodic().solve(system, tables(4000, amplitude), PERIOD)


def largest(response: Response) -> NDArray[np.float64]:
    return np.abs(response.state).max(axis=(0, 1))


def test_flanks_part_and_the_orbit_is_that_of_shooting(
    case: tuple[System, float, Response, Response],
) -> None:
    _, _, few, many = case
    assert many.period == 1 and (step_forces(many).elastic <= 0.0).any()
    assert few.pieces is not None and len(few.tables.width) < 100
    assert few.residual < 1e-9
    np.testing.assert_allclose(few.state[0, 0] / largest(many), many.state[0, 0] / largest(many), atol=2e-8)


def test_its_multipliers_are_those_of_shooting(case: tuple[System, float, Response, Response]) -> None:
    _, _, few, many = case
    np.testing.assert_allclose(abs(few.multipliers), abs(many.multipliers), atol=1e-6)


def test_its_steps_make_up_the_period_and_end_where_contact_changes(
    case: tuple[System, float, Response, Response],
) -> None:
    system, amplitude, few, _ = case
    assert few.pieces is not None
    grid = stage_grid(np.array([0.0, LEAVES]), 48, 4)
    pieces = few.pieces.of(grid)
    np.testing.assert_allclose(pieces.width, few.tables.width, rtol=1e-12)
    np.testing.assert_allclose(pieces.start[1:], np.cumsum(pieces.width)[:-1], atol=1e-12)
    angle = 2.0 * np.pi * pieces.phase
    np.testing.assert_allclose(few.tables.error[..., 0], amplitude * np.sin(angle), atol=1e-8 * amplitude)
    # No flank that bears at one end of a step is open at the other: up to rounding none bears then.
    forces = step_forces(few)
    pair, size = forces.pair[0], forces.pair.max()
    assert not ((pair.max(axis=1) > 1e-9 * size) & (pair.min(axis=1) <= 0.0) & _open(few, system)).any()


def _open(response: Response, system: System) -> NDArray[np.bool_]:
    """Which pairs are clearly open at one end of a step, (n_steps, n_mesh, n_pairs)."""
    n, t = len(system.load), response.tables
    state = np.stack([response.state[0, :-1, :n], response.state[0, 1:, :n]], axis=1)
    apart = t.gap[:, [0, 2]] + t.error[:, [0, 2], :, None] - (state @ system.direction.T)[..., None]
    return (apart.max(axis=1) > 1e-12) & (t.stiffness[:, 1] > 0.0)


def test_the_mean_mesh_force_is_the_static_one(case: tuple[System, float, Response, Response]) -> None:
    system, _, few, _ = case
    node, weight = np.polynomial.legendre.leggauss(8)
    forces = forces_within(few, 0.5 * (node + 1.0))
    total = np.einsum("kism,i,s->m", forces.elastic + forces.damping, 0.5 * weight, few.tables.width)
    static = system.load[-1] / system.direction[0, -1]
    np.testing.assert_allclose(total, static, rtol=2e-5)
    assert few.verdict.words == ()


def test_more_steps_change_nothing(case: tuple[System, float, Response, Response]) -> None:
    system, amplitude, few, _ = case
    more = Periodic().on_few_steps(system, tables(96, amplitude), PERIOD)
    assert more is not None
    np.testing.assert_allclose(few.state[0, 0] / largest(few), more.state[0, 0] / largest(few), atol=1e-9)


def test_from_a_neighbour_it_is_the_same_in_fewer_passes(
    case: tuple[System, float, Response, Response],
) -> None:
    system, amplitude, few, _ = case
    near = Periodic().on_few_steps(system, tables(48, 1.001 * amplitude), PERIOD, few)
    assert near is not None
    again = Periodic().on_few_steps(system, tables(48, amplitude), PERIOD, near)
    assert again is not None and again.counts.period_maps <= few.counts.period_maps
    np.testing.assert_allclose(again.state[0, 0] / largest(few), few.state[0, 0] / largest(few), atol=1e-9)


def test_few_steps_are_tried_from_neighbours_on_them_alone(
    case: tuple[System, float, Response, Response],
) -> None:
    """Where they are not tried their tables are not asked for, which `on_few_steps` must not miss."""
    system, amplitude, few, shot = case
    assert shot.counts.newton_iterations > 1
    assert Periodic().tries_few_steps(system, None) and Periodic().tries_few_steps(system, few)
    assert not Periodic().tries_few_steps(system, shot)
    assert Periodic().on_few_steps(system, tables(48, amplitude), PERIOD, shot) is None


AMPLITUDE = 12e-6
SINGLE = {
    "damped by contact, both flanks": ONE,
    "always damped, both flanks": ONE._replace(damping_always=True),
}


def right_hand_side(system: System, leading: bool) -> Callable[[float, Any], Any]:
    """The tables of `tables`, as functions of time."""

    def rate(time: float, y: Any) -> Any:
        phase = time / PERIOD
        k = np.array(
            [1e8 * (1.0 + 0.2 * np.cos(3.0 * phase)) * leading, 2.5e8 * (1.0 + 0.1 * np.sin(5.0 * phase))]
        )
        gap = np.array([1e-6 * np.sin(2.0 * np.pi * phase), 2e-6 * (phase - 0.4) ** 2])
        delta = y[0] - AMPLITUDE * np.sin(2.0 * np.pi * phase)
        speed = y[1] - AMPLITUDE * 2.0 * np.pi / PERIOD * np.cos(2.0 * np.pi * phase)
        drive = k * np.maximum(0.0, delta - gap)
        back = 0.0 if system.backlash is None else k.sum() * max(0.0, -system.backlash[0] - delta)
        touching = system.damping_always or drive.any() or back > 0.0
        force = drive.sum() - back + system.mesh_damping[0] * speed * touching
        return np.array([y[1], (system.load[0] - force) / system.mass[0, 0]])

    return rate


def period_map(system: System, state: Any) -> Any:
    """Return where a state is after a period; steps so short that a change within one is lost in rounding."""
    for low, high in ((0.0, LEAVES), (LEAVES, 1.0)):
        solution = solve_ivp(
            right_hand_side(system, low == 0.0), (low * PERIOD, high * PERIOD), state, method="DOP853",
            rtol=1e-11, atol=1e-16, max_step=PERIOD / 2000,
        )  # fmt: skip
        state = solution.y[:, -1]
    return state


@pytest.fixture(scope="module", params=SINGLE, ids=list(SINGLE))
def single(request: pytest.FixtureRequest) -> tuple[System, Response]:
    system = SINGLE[request.param]
    given = tables(48, AMPLITUDE)
    found = orbit_of_small(known_of(system, given, PERIOD), given, 1e-3)
    assert found is not None and found.pieces is not None
    return system, found


def test_the_orbit_closes_under_scipy(single: tuple[System, Response]) -> None:
    system, found = single
    start = found.state[0, 0]
    assert np.abs((period_map(system, start) - start) / np.abs(found.state).max(axis=(0, 1))).max() < 1e-6


def test_its_multipliers_are_differences_of_scipys_period_map(single: tuple[System, Response]) -> None:
    system, found = single
    scale, start = np.abs(found.state).max(axis=(0, 1)), found.state[0, 0]
    columns = []
    for at in range(2):
        move = np.zeros(2)
        move[at] = 1e-4 * scale[at]
        columns.append(
            (period_map(system, start + move) - period_map(system, start - move)) / (2.0 * move[at])
        )
    by_differences = np.linalg.eigvals(np.stack(columns, axis=1))
    np.testing.assert_allclose(np.sort(abs(found.multipliers)), np.sort(abs(by_differences)), rtol=1e-3)


def test_its_error_falls_as_the_ninth_power_of_the_steps() -> None:
    """Polynomials of degree eight miss the ninth power of their length."""
    states = []
    for steps in (16, 32, 128):
        given = tables(steps, AMPLITUDE)
        found = orbit_of_small(known_of(ONE, given, PERIOD), given, 1e-3)
        assert found is not None
        states.append(found.state[0, 0] / np.abs(found.state).max(axis=(0, 1)))
    coarse, fine = (np.abs(state - states[-1]).max() for state in states[:2])
    assert fine < coarse / 100.0 or fine < 1e-12

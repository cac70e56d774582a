"""What foreign integrators are given is the equation of motion that ours tabulate."""

import numpy as np
import pytest

from wearlab.accuracy.equation import Motion, motion_of, motion_within
from wearlab.accuracy.steady import Steady, steady
from wearlab.mesh.clock import StepLookup
from wearlab.mesh.excitation import stage_tables
from wearlab.scene import Scene


def by_hand(problem: Steady, time: float, y: np.ndarray) -> np.ndarray:
    """ẏ from the tables' own look-up, with dense matrices and plain NumPy."""
    vibration = problem.vibration
    system = problem.vibration.system
    phase = (time / vibration.period) % 1.0
    where = problem.parts.locate(0, np.array([phase]))
    only = StepLookup(_thrice(where), np.zeros((1, 1), np.int64))
    stages = vibration.sampling._replace(grid=_one_step(phase), where=(only,))
    tables = stage_tables(problem.kinds, stages, None)
    k = tables.stiffness[0, 0, 0]
    g = tables.gap[0, 0, 0]
    n = len(system.load)
    d = system.direction[0]
    delta = d @ y[:n] - tables.error[0, 0, 0]
    rate = d @ y[n:] - tables.error_rate[0, 0, 0] / vibration.period
    pressed = np.where(
        k > 0.0, k * np.maximum(0.0, delta - np.where(k > 0.0, g, 0.0)), 0.0
    )
    back = k.sum() * max(0.0, -float(system.backlash[0]) - delta)
    c = system.mesh_damping[0]
    moves = tables.pair_rate[0, 0, 0] / vibration.period
    share = np.where(pressed > 0.0, k, 0.0) / max(k[pressed > 0.0].sum(), 1e-300)
    drive = np.where(
        pressed > 0.0, np.maximum(0.0, pressed + c * share * (rate - moves)), 0.0
    ).sum()
    force = drive - (max(0.0, back - c * rate) if back > 0.0 else 0.0)
    load = (
        system.load
        - system.total_stiffness @ y[:n]
        - system.total_damping @ y[n:]
        - d * force
    )
    return np.concatenate([y[n:], np.linalg.solve(system.mass, load)])


def _one_step(phase: float):
    from wearlab.mesh.stages import StageGrid

    return StageGrid(np.array([phase]), np.array([0.0]), np.array([0]))


def _thrice(where):
    return where._replace(
        **{name: np.repeat(value, 3, axis=0) for name, value in where._asdict().items()}
    )


@pytest.fixture(scope="module")
def case(separating: Scene) -> tuple[Steady, Motion]:
    built = steady(separating)
    return built, built.motion()


def states(n: int, seed: int = 4) -> np.ndarray:
    """States on both sides of both flanks."""
    random = np.random.default_rng(seed)
    states = random.normal(size=(40, 2 * n)) * np.r_[np.full(n, 8e-6), np.full(n, 0.05)]
    states[:, n - 1] += np.linspace(-2e-5, 2e-5, 40)
    return states


def test_motion_is_the_tables(case):
    problem, given = case
    times = np.random.default_rng(1).uniform(0.0, 5.0, 40) * given.period
    for time, y in zip(times, states(len(given.push)), strict=True):
        exact = by_hand(problem, time, y)
        np.testing.assert_allclose(
            motion_of(time, y, given), exact, rtol=1e-5, atol=1e-5 * abs(exact).max()
        )


def test_each_side_of_a_jump_can_be_asked_for(problem):
    given = problem.motion()
    jump = given.breaks[1] * given.period
    y = states(len(given.push))[30]
    bounds = [int(cell) for cell in given.first_cell]
    left = motion_within(jump, y, given, bounds[0], bounds[1])
    right = motion_within(jump, y, given, bounds[1], bounds[2])
    np.testing.assert_allclose(right, motion_of(jump * (1 + 1e-9), y, given), rtol=1e-5)
    assert np.abs(left - right).max() > 1e-2 * np.abs(right).max()

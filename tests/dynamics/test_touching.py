"""Orbits of pairs whose flanks never part: by collocation over groups of steps, in one compiled call."""

from types import SimpleNamespace

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from scipy.integrate import solve_ivp

from wearlab.dynamics import known as room
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables, stage_grid

PERIOD = mesh_period(1860)
LEAVES = 0.6
ERROR = 1e-6
SYSTEM = BenchmarkPair().system()
ONE = System(
    ("mesh.x",), np.array([[0.73]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)), np.array([4800.0]),
    np.array([1000.0]), True, np.array([0.73]), np.array([1e-4]),
)  # fmt: skip


def pairs(phase: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and gap of two smooth pairs, (…, 2); the leading one leaves at once at LEAVES."""
    leading = np.where(middle < LEAVES, 5e7 * (1.0 + 0.2 * np.cos(3.0 * phase)), 0.0)
    trailing = 2.8e8 * (1.0 + 0.1 * np.sin(5.0 * phase))
    gaps = 5e-7 * np.sin(2.0 * np.pi * phase + 1.0), 8e-7 * (phase - 0.4) ** 2
    return np.stack([leading, trailing], -1), np.stack(gaps, -1)


def tables(steps: int, amplitude: float = ERROR, softer: float = 1.0) -> StageTables:
    grid = stage_grid(np.array([0.0, LEAVES]), steps, 4)
    middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
    stiffness, gap = pairs(grid.phase, middle)
    angle = 2.0 * np.pi * grid.phase[..., None]
    return StageTables(
        grid.width, softer * stiffness[:, :, None, :], gap[:, :, None, :].copy(), amplitude * np.sin(angle),
        2.0 * np.pi * amplitude * np.cos(angle), None,
    )  # fmt: skip


def over_a_period(system: System, start: np.ndarray) -> np.ndarray:
    """Return the states at 0, LEAVES and 1, (3, 2n), by SciPy's DOP853 from jump to jump."""
    n, found = len(system.load), [start]

    def rate(time: float, y: np.ndarray, middle: float) -> np.ndarray:
        angle = 2.0 * np.pi * time / PERIOD
        k, g = pairs(np.array(time / PERIOD), np.array(middle))
        d = system.direction[0]
        delta = d @ y[:n] - ERROR * np.sin(angle)
        speed = d @ y[n:] - ERROR * 2.0 * np.pi / PERIOD * np.cos(angle)
        force = k @ (delta - g) + system.mesh_damping[0] * speed
        load = system.load - system.total_stiffness @ y[:n] - system.total_damping @ y[n:] - d * force
        return np.r_[y[n:], np.linalg.solve(system.mass, load)]

    for low, high in ((0.0, LEAVES), (LEAVES, 1.0)):
        scale = np.r_[np.full(n, 1e-5), np.full(n, 1e-2)]
        solution = solve_ivp(
            rate, (low * PERIOD, high * PERIOD), found[-1], method="DOP853", args=(0.5 * (low + high),),
            rtol=1e-13, atol=1e-14 * scale,
        )  # fmt: skip
        found.append(solution.y[:, -1])
    return np.array(found)


def held(
    system: System, given: StageTables, start: Response | None = None, **options: float
) -> Response | None:
    found = Periodic(**options).held_together(system, given, PERIOD, start)
    return found if isinstance(found, Response) else None


def touching(steps: int, system: System = SYSTEM, **changes: float) -> Response:
    found = held(system, tables(steps, **changes))
    assert found is not None
    return found


@pytest.mark.parametrize("system", [SYSTEM, ONE], ids=["three coordinates", "one"])
def test_an_orbit_closes_under_scipy(system: System) -> None:
    response = touching(60, system)
    state = response.state[0]
    by_scipy = over_a_period(system, state[0])
    leaves = round(np.searchsorted(np.cumsum(response.tables.width), LEAVES - 1e-9)) + 1
    size = np.abs(state).max(axis=0)
    np.testing.assert_allclose(by_scipy / size, state[[0, leaves, -1]] / size, atol=1e-8)


def test_groups_of_four_steps_are_of_high_order() -> None:
    best = touching(120).state[0, 0]
    error = [np.abs(touching(steps).state[0, 0] / best - 1.0).max() for steps in (20, 40)]
    assert error[1] < 1e-7 and np.log2(error[0] / error[1]) > 7.0


def test_collocation_and_runge_kutta_find_the_same_orbit_and_multipliers() -> None:
    one, other = touching(60), Periodic().solve(SYSTEM, tables(1200), PERIOD)
    np.testing.assert_allclose(one.state[0, 0], other.state[0, 0], rtol=1e-7)
    np.testing.assert_allclose(np.abs(one.multipliers), np.abs(other.multipliers), rtol=1e-7)
    assert one.verdict == other.verdict and one.verdict.words == ()


def test_a_constant_mesh_holds_still() -> None:
    flat = tables(16, 0.0)
    flat = flat._replace(stiffness=np.full_like(flat.stiffness, 2e8), gap=np.zeros_like(flat.gap))
    found = held(SYSTEM, flat)
    assert found is not None
    stiffness = SYSTEM.stiffness + 4e8 * SYSTEM.direction.T @ SYSTEM.direction
    still = np.linalg.solve(stiffness, SYSTEM.load)
    np.testing.assert_allclose(found.state[0, :, :3], np.tile(still, (len(found.state[0]), 1)), rtol=1e-10)


def test_parting_flanks_are_left_to_other_steps() -> None:
    light = SYSTEM._replace(load=0.02 * SYSTEM.load)
    assert held(light, tables(60)) is None
    apart = Periodic().solve(light, tables(600), PERIOD)
    assert apart.counts.newton_iterations > 1
    assert held(SYSTEM, tables(60), start=apart) is None  # its branch is followed


def test_no_load_and_no_damping_are_not_taken_for_an_attracting_orbit() -> None:
    assert held(SYSTEM._replace(load=0.0 * SYSTEM.load), tables(60)) is None
    undamped = SYSTEM._replace(damping=0.0 * SYSTEM.damping, mesh_damping=np.zeros(1))
    found = held(undamped, tables(120))
    assert found is None or found.verdict.attracting is False


def test_what_steps_do_not_resolve_is_left_to_others() -> None:
    rough = tables(40)
    stiffness = rough.stiffness.copy()
    stiffness[10, 1] *= 1.02  # seen by a single stage
    rough = rough._replace(stiffness=stiffness)
    assert held(SYSTEM, rough, resolved=1e-4) is None
    assert held(SYSTEM, tables(40), resolved=1e-4) is not None


def test_plans_of_old_gears_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that had run planetary sets one after another held 2.4 GB."""
    on = tables(40)
    known = [room.Known(SYSTEM, on, PERIOD * (1 + k)) for k in range(4)]
    shared, own = np.zeros(1_000), [np.zeros(1_000) for _ in known]
    for one, table in zip(known, own, strict=True):
        one._plans |= {
            (b"one", b""): SimpleNamespace(tables=shared),
            (b"", b""): SimpleNamespace(tables=table),
        }
    monkeypatch.setattr(room, "_known", list(known))
    for most, left in ((shared.nbytes * 5, 4), (shared.nbytes * 3, 2), (0, 1)):
        monkeypatch.setattr(room, "KEPT_BYTES", most)
        room.forget()
        assert room._known == known[:left]


def test_an_answer_does_not_depend_on_what_was_solved_before() -> None:
    first = touching(40)
    again = held(SYSTEM, tables(40, softer=0.7), start=first)
    warm = held(SYSTEM, first.tables, start=again)
    assert again is not None and warm is not None
    np.testing.assert_array_equal(warm.state, first.state)
    assert np.abs(again.state[0, 0] / first.state[0, 0] - 1.0).max() > 0.01

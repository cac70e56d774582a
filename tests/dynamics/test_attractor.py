"""What counts as back: flanks that can part no more, and what the
modes of a state amount to.
"""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics.steady.coexisting import SPARED, Attractor
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response, step_forces
from wearlab.dynamics.steady.shooting import Shooting

PAIR = BenchmarkPair()
LIGHT = PAIR._replace(
    torque=60.0, mesh_damping=300.0, bearing_damping=2000.0, amplitude=8e-6
)


def at_attractor(
    pair: BenchmarkPair, rpm: float
) -> tuple[Response, Shooting, Attractor]:
    response = Periodic().solve(
        pair.system(), pair.tables(pair.grid(100)), mesh_period(rpm)
    )
    shooting = Shooting(response.system, response.tables, response.mesh_period)
    return response, shooting, Attractor(response, shooting.rate)


def moved(
    response: Response, attractor: Attractor, away: float, rng: np.random.Generator
) -> np.ndarray:
    """Return a state off the response in a random direction, so far away."""
    sizes = np.abs(response.state[0]).max(axis=0)
    start = response.state[0, 0]
    direction = sizes * rng.normal(size=len(start))
    return start + away / attractor.away(start + direction) * direction


@pytest.mark.parametrize(
    ("pair", "rpm"), [(PAIR, 800.0), (PAIR, 1860.0), (LIGHT, 4000.0)]
)
def test_what_counts_as_back_parts_no_more(pair: BenchmarkPair, rpm: float) -> None:
    response, shooting, attractor = at_attractor(pair, rpm)
    assert attractor.permanent_contact
    rng = np.random.default_rng(3)
    for _ in range(20):
        state = moved(response, attractor, 1.0, rng)
        assert attractor.away(state) == pytest.approx(1.0)
        _, path = shooting.integrate(state.copy(), 40, 40)
        deflection = (
            path[:, :, :3] @ response.system.direction[0]
            - response.tables.error[:, [0, 2], 0].reshape(-1)[
                np.r_[0, 1 : 2 * path.shape[1] - 1 : 2]
            ]
        )
        assert deflection.min() > 0.0


def test_flanks_can_part_where_a_motion_takes_away_more() -> None:
    response, shooting, attractor = at_attractor(LIGHT, 4000.0)
    rng = np.random.default_rng(3)
    parted = 0
    for _ in range(20):
        before = shooting.changes
        shooting.integrate(moved(response, attractor, 3.0 / SPARED, rng), 2)
        parted += shooting.changes > before
    assert parted > 10


def test_a_state_of_the_response_is_not_away() -> None:
    response, _, attractor = at_attractor(LIGHT, 9750.0)
    assert response.period == 4 and not attractor.permanent_contact
    for state in response.state[:, 0]:
        assert attractor.away(state) == attractor.distance(
            state
        ) == 0.0 and attractor.is_at(state)


def test_the_swing_is_that_of_modes_in_phase() -> None:
    """One mode that swings by so much adds so much deflection, at any phase."""
    response, _, attractor = at_attractor(PAIR, 1860.0)
    square, shapes = np.linalg.eig(
        np.linalg.solve(
            response.system.mass,
            response.system.in_contact(response.tables.mean_stiffness),
        )
    )
    for rate, shape in zip(np.sqrt(square), shapes.T, strict=True):
        felt = abs(float(response.system.direction[0] @ shape))
        for phase in (0.0, 1.0, 2.0):
            swing = (
                np.concatenate([np.cos(phase) * shape, -np.sin(phase) * rate * shape])
                * 1e-7
            )
            away = attractor.away(response.state[0, 0] + swing)
            assert away * attractor.spare == pytest.approx(
                felt * 1e-7, rel=1e-9, abs=1e-16
            )


def test_the_slowest_vibration_shrinks_in_the_periods_told() -> None:
    response, _, attractor = at_attractor(PAIR, 1860.0)
    periods = attractor.periods_to(1000.0)
    assert abs(response.multipliers[0]) ** periods == pytest.approx(1e-3)
    assert attractor.periods_to(0.5) == 0.0


def test_mean_force_over_mean_stiffness_is_near_the_mean_deflection() -> None:
    response, _, attractor = at_attractor(PAIR, 800.0)
    mean = step_forces(response).elastic.mean() / response.tables.mean_stiffness[0]
    assert attractor.deflection == pytest.approx(mean, rel=0.1)

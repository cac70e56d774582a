"""Tooth friction: an independent integration, the energy of a period, its limits, and
the load found.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wearlab.dynamics.forces.energy import energy_balance, nominal_speeds
from wearlab.dynamics.methods import IntegrationMethod
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.spur import Meshing, Paired, PairFriction, spur_3dof
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import (
    Response,
    deflection_at,
    friction_forces,
    step_forces,
)
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.dynamics.supports import MemberSupport
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body
from wearlab.mesh.stages import StageGrid, StageTables, stage_grid

RADIUS = (0.07, 0.09)
INERTIA = (7e-3, 12e-3)
ALPHA = np.deg2rad(21.0)
PITCH = 8.8e-3
ENTRY = -5.5e-3
RATIO = 1.7
PERIOD = 1.0 / 800.0
TORQUE = 200.0
BREAKS = np.array([0.0, RATIO - 1.0, -ENTRY / PITCH % 1.0])
BEARING = MemberSupport(radial_stiffness=1e9, radial_damping=5000.0)


RUBBING = PairFriction(ALPHA)


def spur(
    friction: PairFriction | None = RUBBING, second: MemberSupport = BEARING
) -> System:
    gears = {
        "pinion": Body(2.8, INERTIA[0], RADIUS[0]),
        "gear": Body(3.1, INERTIA[1], RADIUS[1]),
    }
    held = {"pinion": BEARING, "gear": second}
    return spur_3dof(
        Paired(gears, held, Meshing(1000.0), TORQUE / RADIUS[0], friction=friction)
    )


def pair_values(phase: Any, middle: Any, j: int) -> tuple[Any, Any, Any]:
    """Stiffness, gap and path position of pair j.

    The side of a jump is decided by ``middle``.
    """
    x = phase + j
    inside = middle + j < RATIO
    stiffness = np.where(
        inside, 2.2e8 * (1.0 - 0.35 * (2.0 * x / RATIO - 1.0) ** 2), 0.0
    )
    return stiffness, 1e-6 * np.sin(3.0 * x) ** 2, ENTRY + x * PITCH


def tables(grid: StageGrid, mu: float) -> StageTables:
    phase = grid.phase
    middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
    columns = []
    for j in (0, 1):
        stiffness, gap, position = pair_values(phase, middle, j)
        sliding = np.where(
            stiffness > 0.0, mu * np.sign(ENTRY + (middle + j) * PITCH), 0.0
        )
        columns.append((stiffness, gap, sliding, position))
    k, g, sliding, position = (
        np.ascontiguousarray(np.stack(c, -1)[:, :, None])
        for c in zip(*columns, strict=True)
    )
    angle = 2.0 * np.pi * phase[..., None]
    error = 2e-6 * np.sin(angle)
    rate = 4e-6 * np.pi * np.cos(angle)
    pair_rate = np.stack([3e-6 * np.sin(6.0 * (phase + j)) for j in (0, 1)], -1)[
        :, :, None
    ]
    still = np.zeros_like(error)
    return StageTables(
        grid.width,
        k,
        g,
        error,
        rate,
        None,
        sliding,
        sliding * position,
        pair_rate,
        still,
    )


def respond(
    mu: float = 0.1,
    steps: int = 300,
    method: IntegrationMethod | None = None,
    **changes: Any,
) -> Response:
    return (method or Periodic()).solve(
        spur(**changes), tables(stage_grid(BREAKS, steps), mu), PERIOD
    )


def speeds(system: System) -> np.ndarray:
    return nominal_speeds(system, {"pinion.u": PITCH / PERIOD})


def newton(
    load: float, mu: float, slope: tuple[float, float], middle: float
) -> Callable[..., np.ndarray]:
    """Newton's law of both gears, with lever arms written out."""
    (r1, r2), (i1, i2) = RADIUS, INERTIA

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        y1, y2, u1, u2, v1, v2, w1, w2 = y
        phase = time / PERIOD
        delta = y1 - y2 + u1 - u2 - 2e-6 * np.sin(2 * np.pi * phase)
        speed = v1 - v2 + w1 - w2 - 4e-6 * np.pi / PERIOD * np.cos(2 * np.pi * phase)
        total = moment1 = moment2 = 0.0
        touching = [
            float(pair_values(phase, middle, j)[0])
            * (delta > pair_values(phase, middle, j)[1])
            for j in (0, 1)
        ]
        for j in (0, 1):
            k, gap, s = pair_values(phase, middle, j)
            pair = 0.0
            if touching[j] > 0.0:
                approach = speed - 3e-6 * np.sin(6.0 * (phase + j)) / PERIOD
                pair = (
                    float(k) * (delta - gap)
                    + 1000.0 * touching[j] / sum(touching) * approach
                )
            pair = max(0.0, pair)
            rubbing = mu * np.sign(ENTRY + (middle + j) * PITCH) * pair
            total += pair
            moment1 += rubbing * (r1 * np.tan(ALPHA) + slope[0] * s)
            moment2 += rubbing * (r2 * np.tan(ALPHA) + slope[1] * s)
        return np.array(
            [
                *(v1, v2, w1, w2),
                (-total - 1e9 * y1 - 5000.0 * v1) / 2.8,
                (total - 1e9 * y2 - 5000.0 * v2) / 3.1,
                (TORQUE - total * r1 - moment1) / i1 * r1,
                (total * r2 + moment2 - load) / i2 * r2,
            ]
        )

    return rate


@pytest.mark.parametrize("slope", [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0)])
def test_the_orbit_closes_under_an_independent_integration(
    slope: tuple[float, float],
) -> None:
    response = respond(0.2, 900, friction=PairFriction(ALPHA, slope))
    load = -response.system.load[-1] * RADIUS[1]
    y = response.state[0, 0].copy()
    for low, high in zip(np.sort(BREAKS), [*np.sort(BREAKS)[1:], 1.0], strict=True):
        law = newton(load, 0.2, slope, 0.5 * (low + high))
        y = solve_ivp(
            law,
            (low * PERIOD, high * PERIOD),
            y,
            method="DOP853",
            rtol=1e-11,
            atol=1e-16,
        ).y[:, -1]
    size = np.abs(response.state[0]).max(axis=0)
    assert (np.abs(y - response.state[0, -1]) < 1e-6 * size).all()
    assert (np.abs(y - response.state[0, 0]) < 1e-6 * size).all()


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_energy_closes_and_every_term_counts(mu: float) -> None:
    response = respond(mu)
    balance = energy_balance(response, speeds(response.system))
    assert abs(balance.residual) < 1e-7
    for name in (
        "friction",
        "bearing_damping",
        "mesh_damping",
        "parametric",
        "moving_gaps",
    ):
        assert abs(getattr(balance, name)) > 1e-6 * balance.input, name
    assert balance.input == pytest.approx(TORQUE / RADIUS[0] * PITCH / PERIOD, rel=1e-9)
    # Both gears keep their mean speed: the load torque found is the efficiency of the
    # gear ratio.
    assert -response.system.load[-1] / (TORQUE / RADIUS[0]) == pytest.approx(
        balance.efficiency, rel=1e-9
    )


HELD = BEARING._replace(tangential_stiffness=1e7, tangential_damping=2e3)


@pytest.mark.parametrize("second", [BEARING, HELD])
def test_a_motion_that_does_not_repeat_gains_what_it_does_not_lose(
    second: MemberSupport,
) -> None:
    """Soon after rest.

    A free set keeps one load throughout, whatever its march has tried before.
    """
    system = spur(second=second)
    grid = stage_grid(BREAKS, 1200)
    response = RungeKutta4(max_periods=0, averaged=2).solve(
        system, tables(grid, 0.1), PERIOD
    )
    balance = energy_balance(response, speeds(system))
    assert response.period == 0
    assert abs(balance.residual) < 1e-6
    assert abs(balance.stored) > 1e-4 * balance.input


def test_friction_moments_and_mesh_force_carry_the_torque_in_the_mean() -> None:
    response = respond(0.3, 600)
    forces = step_forces(response)
    tangential, moment = friction_forces(response, forces)
    arm = RADIUS[0] * np.tan(ALPHA)
    torque = forces.normal * RADIUS[0] + tangential * arm + moment
    mean = (torque[0, :, :, 0].mean(axis=1) * response.tables.width).sum()
    assert mean == pytest.approx(TORQUE, rel=1e-5)


def test_no_friction_is_the_model_without_friction() -> None:
    grid = stage_grid(BREAKS, 1200)
    plain = Periodic().solve(
        spur(friction=None),
        tables(grid, 0.0)._replace(sliding=None, moment=None),
        PERIOD,
    )
    smooth = respond(0.0, 1200)
    phase = np.linspace(0.0, 0.99, 50)
    expected, _ = deflection_at(plain, grid, phase)
    found, _ = deflection_at(smooth, grid, phase)
    np.testing.assert_allclose(
        found, expected, rtol=1e-6
    )  # exact steps, and Runge–Kutta's
    np.testing.assert_allclose(smooth.system.load, spur().load, rtol=1e-9)
    assert energy_balance(smooth, speeds(smooth.system)).friction == 0.0
    # position and speed of the free rotation are no multipliers
    np.testing.assert_allclose(
        np.abs(smooth.multipliers), np.abs(plain.multipliers), atol=1e-7
    )


def test_slow_and_stiff_loses_what_the_quasi_static_formula_says() -> None:
    """At low speed ``P = μ F Σ share |s| (ω1 + ω2)``, averaged over the period."""
    grid = stage_grid(BREAKS, 800)
    slow = 0.02
    still = tables(grid, 0.05)
    still = still._replace(
        error=0.0 * still.error,
        error_rate=0.0 * still.error_rate,
        gap=0.0 * still.gap,
        pair_rate=0.0 * still.pair_rate,
    )
    response = Periodic().solve(spur(), still, slow)
    found = energy_balance(
        response, nominal_speeds(response.system, {"pinion.u": PITCH / slow})
    )
    # type: ignore[index]
    k = still.stiffness[:, :, 0]
    s = np.abs(still.moment[:, :, 0]) / 0.05
    arms = (k * s).sum(-1) / k.sum(-1)
    mean = float(still.width @ (arms @ np.array([1.0, 4.0, 1.0]) / 6.0))
    loss = (
        0.05
        * TORQUE
        / RADIUS[0]
        * mean
        * (1.0 / RADIUS[0] + 1.0 / RADIUS[1])
        * PITCH
        / slow
    )
    assert found.friction == pytest.approx(loss, rel=0.02)
    assert 1.0 - found.efficiency == pytest.approx(loss / found.input, rel=0.02)


@pytest.mark.parametrize(
    ("method", "tolerance"),
    [(RungeKutta4(), 1e-6), (RungeKutta45(), 2e-5), (Newmark(), 6e-3)],
)
def test_marching_methods_find_orbit_and_load(
    method: IntegrationMethod, tolerance: float
) -> None:
    exact = respond(0.2, 600)
    found = respond(0.2, 600, method=method)
    assert found.verdict.deviations == ()
    assert found.system.load[-1] == pytest.approx(exact.system.load[-1], rel=tolerance)
    delta = [r.state[0, :, :4] @ r.system.direction[0] for r in (exact, found)]
    assert np.abs(delta[1] - delta[0]).max() < tolerance * np.abs(delta[0]).max()


def test_newmark_is_of_second_order_with_friction() -> None:
    exact = respond(0.2, 1600).state[0, 0, :4] @ spur().direction[0]
    errors = [
        abs(
            float(
                respond(0.2, n, Newmark()).state[0, 0, :4] @ spur().direction[0] - exact
            )
        )
        for n in (200, 400, 800)
    ]
    np.testing.assert_allclose(
        np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.3
    )


def test_a_grounded_pair_needs_no_load_to_be_found() -> None:
    system = spur(second=HELD)
    assert system.balance is None
    response = Periodic().solve(system, tables(stage_grid(BREAKS, 300), 0.2), PERIOD)
    np.testing.assert_array_equal(response.system.load, system.load)
    assert abs(energy_balance(response, speeds(system)).residual) < 1e-7


@pytest.mark.parametrize(("second", "again"), [(BEARING, 10), (HELD, 0)])
def test_following_a_motion_under_one_load_counts_as_work(
    second: MemberSupport, again: int
) -> None:
    """Twice as many periods once more, of a pair that is free to turn."""
    shooting = Shooting(
        spur(second=second), tables(stage_grid(BREAKS, 60), 0.1), PERIOD
    )
    _, kept = shooting.integrate(np.zeros(shooting.rows), 20, 5)
    assert shooting.maps == 20
    response = shooting.aperiodic(kept, 0.0)
    assert shooting.maps == 20 + again
    assert response.counts.right_hand_sides >= 4 * len(shooting.tables.width) * (
        20 + again
    )

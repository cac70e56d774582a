"""Transients of pairs with their own gaps against SciPy, integrated
from jump to jump.
"""

from collections.abc import Callable

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from scipy.integrate import solve_ivp

from wearlab.dynamics.integrators.kernel import kernel_of
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.steady.integrate import OnTables
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables, stage_grid

PERIOD = mesh_period(5200)
LEAVES = 0.6


def pair_values(
    phase: np.ndarray, sharp_side: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Two pairs with smooth stiffness, gaps of micrometres.

    The leading one leaves sharply at LEAVES.
    """
    leading = np.where(sharp_side < LEAVES, 1.5e8 * (1 + 0.2 * np.cos(3 * phase)), 0.0)
    trailing = 2.1e8 * (1 + 0.3 * np.sin(5 * phase))
    gaps = 2e-6 * np.sin(2 * np.pi * phase + 1.0), 3e-6 * (phase - 0.4) ** 2
    return np.stack([leading, trailing], -1), np.stack(gaps, -1)


def tables(steps: int, fluctuation: bool) -> tuple[StageTables, np.ndarray]:
    grid = stage_grid(np.array([0.0, LEAVES]), steps)
    middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
    stiffness, gap = pair_values(grid.phase, middle)
    angle = 2 * np.pi * grid.phase
    return (
        StageTables(
            grid.width,
            stiffness[:, :, None, :].copy(),
            gap[:, :, None, :].copy(),
            4e-6 * np.sin(angle)[..., None],
            4e-6 * 2 * np.pi * np.cos(angle)[..., None],
            np.cos(angle) if fluctuation else None,
        ),
        grid.start,
    )


def right_hand_side(
    system: System, segment_middle: float, fluctuation: bool
) -> Callable[..., np.ndarray]:
    def rate(time: float, y: np.ndarray) -> np.ndarray:
        phase = time / PERIOD
        n = len(system.load)
        k, g = pair_values(np.array(phase), np.array(segment_middle))
        d = system.direction[0]
        delta = d @ y[:n] - 4e-6 * np.sin(2 * np.pi * phase)
        speed = d @ y[n:] - 4e-6 * 2 * np.pi / PERIOD * np.cos(2 * np.pi * phase)
        drive = k * np.maximum(0.0, delta - g)
        back = (
            0.0
            if system.backlash is None
            else k.sum() * max(0.0, -system.backlash[0] - delta)
        )
        touching = drive.any() or back > 0.0
        force = (
            drive.sum()
            - back
            + system.mesh_damping[0] * speed * (system.damping_always or touching)
        )
        load = system.load.copy()
        if fluctuation:
            load += system.fluctuation_direction * np.cos(2 * np.pi * phase)
        q = np.linalg.solve(
            system.mass,
            load - system.stiffness @ y[:n] - system.total_damping @ y[n:] - d * force,
        )
        return np.r_[y[n:], q]

    return rate


def reference(system: System, state: np.ndarray, fluctuation: bool) -> np.ndarray:
    for low, high in ((0.0, LEAVES), (LEAVES, 1.0)):
        solution = solve_ivp(
            right_hand_side(system, 0.5 * (low + high), fluctuation),
            (low * PERIOD, high * PERIOD),
            state,
            method="DOP853",
            rtol=1e-11,
            atol=1e-15,
            max_step=PERIOD / 400,
        )
        state = solution.y[:, -1]
    return state


def rotated(system: System) -> System:
    """The same system in coordinates q = R q', so that no matrix is diagonal."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    return system._replace(
        mass=turn.T @ system.mass @ turn,
        damping=turn.T @ system.damping @ turn,
        stiffness=turn.T @ system.stiffness @ turn,
        direction=system.direction @ turn,
        load=turn.T @ system.load,
    )


@pytest.mark.parametrize("kind", ["two flanks", "drive flank only", "dense"])
def test_a_period_with_contact_changes(kind: str) -> None:
    alone = (
        kind == "drive flank only"
    )  # and damping in contact alone, and a fluctuating load
    system = BenchmarkPair(
        torque=60.0, backlash=None if alone else 9e-6, damping_always=not alone
    ).system()
    if alone:
        system = system._replace(fluctuation_direction=np.array([0.0, 0.0, 300.0]))
    if kind == "dense":
        system = rotated(system)
    start = np.array([0.0, 0.0, -8e-6, 0.0, 0.0, -0.05])
    if kind == "dense":
        turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
        start = np.r_[turn.T @ start[:3], turn.T @ start[3:]]
    exact = reference(system, start, alone)
    errors = []
    for steps in (80, 160):
        state = start.copy()
        OnTables(kernel_of(system, tables(steps, alone)[0], PERIOD)).integrate(state, 1)
        errors.append(np.abs(state - exact)[3:].max() / np.abs(exact[3:]).max())
    assert errors[1] < 3e-6
    assert errors[0] > 6.0 * errors[1] or errors[1] < 3e-8
    if kind != "dense":
        adaptive = RungeKutta45(relative=1e-9).integrator(
            system, tables(320, alone)[0], PERIOD
        )
        state = start.copy()
        adaptive.integrate(state, 1)
        assert np.abs(state - exact)[3:].max() < 1e-5 * np.abs(exact[3:]).max()

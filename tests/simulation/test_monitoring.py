"""Spectra of the mesh acceleration: none beyond what steps carry, none that the
sampling makes up.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.dynamics.forces.mesh_forces import lobatto
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")


@cache
def printed(steps: int | None) -> Any:
    """B23's set with its printed stiffness, a hundredfold low, unworn, at 100 rpm."""
    scene = load(CAMPAIGNS / "planetary_friction_as_published.toml").cases[0].scene
    scene = scene.replace("wear.snapshots", None).replace("wear.until", None)
    return simulate(
        scene if steps is None else scene.replace("numerics.steps_per_period", steps)
    )


def test_steps_made_for_the_motion_carry_its_spectrum_to_order_200() -> None:
    """Forces jump, so that lines fall slowly.

    Four nodes a step made humps of them at orders 130 to 190.
    """
    few = printed(None)
    many = printed(2000)
    assert int(few.count_steps_per_period) < 1000 < int(many.count_steps_per_period)
    lines = few.mesh_acceleration_orders.values[0]
    expected = many.mesh_acceleration_orders.values[0]
    assert few.order.values[-1] == 200.0 and np.isfinite(lines).all()
    for low in range(0, 200, 20):
        size = np.linalg.norm(expected[:, low : low + 20], axis=1)
        apart = np.linalg.norm(
            lines[:, low : low + 20] - expected[:, low : low + 20], axis=1
        )
        assert np.all(
            apart < 0.05 * size
        )  # steps for a thousandth of the largest force
    beyond = np.sqrt(0.5 * (lines[0, 100:] ** 2).sum())
    assert beyond < 30.0  # m/s², where four nodes a step gave 87
    assert "orders up to" not in str(few.validity.values)


def test_the_lines_hold_the_power_of_the_signal() -> None:
    """Parseval: what lines of order 200 leave out is the tail of a
    jump, a few per cent.
    """
    data = printed(None)
    power = np.sqrt(0.5 * (data.mesh_acceleration_orders.values[0] ** 2).sum(axis=1))
    rms = data.mesh_acceleration_rms.values[0]
    assert np.all(power < rms) and np.all(power > 0.98 * rms)


def test_a_spectrum_ends_where_too_few_steps_do() -> None:
    scene = next(c for c in load(CAMPAIGNS / "spur_speeds.toml").cases).scene
    scene = scene.replace("wear.snapshots", None).replace("wear.until", None)
    asked = {"variables": ["all", "mesh_acceleration_orders", "mesh_acceleration_rms"]}
    scene = scene.replace(
        "dynamics.method", "rk4"
    )  # orbits are found on other steps, which carry more
    few = simulate(
        scene.replace("store", asked).replace("numerics.steps_per_period", 24)
    )
    many = simulate(
        scene.replace("store", asked).replace("numerics.steps_per_period", 800)
    )
    lines = few.mesh_acceleration_orders.values[0, 0]
    expected = many.mesh_acceleration_orders.values[0, 0]
    carried = np.isfinite(lines)
    assert np.isfinite(expected).all() and 0 <= carried.sum() < 40
    assert "steps a mesh period carry orders up to" in str(few.validity.values)
    assert "steps a mesh period carry orders up to" not in str(many.validity.values)


@pytest.mark.parametrize("nodes", [2, 4, 9, 20])
def test_lobattos_rule_integrates_powers_up_to_its_degree(nodes: int) -> None:
    place, weight = lobatto(nodes)
    assert place[0] == 0.0 and place[-1] == 1.0
    for degree in range(2 * nodes - 2):
        assert weight @ place**degree == pytest.approx(1.0 / (degree + 1), rel=1e-12)

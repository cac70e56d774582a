"""The response over speed as a scene asks for it and a dataset names it."""

from typing import Any

import numpy as np
import pytest
from scenes import external_pair

from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.simulation.dataset.over_speed import LINES, order_amplitudes

TABLE: dict[str, Any] = {
    "gears": external_pair(
        {
            "teeth": 50,
            "root_diameter": "140 mm",
            "mass": "2.8 kg",
            "inertia": "7300 kg*mm^2",
        },
        {
            "teeth": 50,
            "root_diameter": "140 mm",
            "mass": "2.8 kg",
            "inertia": "7300 kg*mm^2",
        },
    ),
    "operation": {"torque": "340 N*m", "speed": "2400 rpm"},
    "mesh": {
        "damping": "1000 N*s/m",
        "normal_backlash": "100 um",
        "stiffness": {"model": "potential-energy"},
        "extended_contact": False,  # the jump at A parts the teeth on one branch
    },
    "dynamics": {
        "model": "torsional",
        "response": {
            "speed": {"from": "2200 rpm", "to": "3400 rpm", "points": 5},
            "strobe": 8,
        },
    },
}


def test_orders_of_known_waves() -> None:
    phase = np.arange(64) / 64
    turns = np.arange(2)[:, None] + phase
    found = order_amplitudes(
        5.0 + 3.0 * np.cos(2 * np.pi * turns) + 0.7 * np.sin(np.pi * turns + 0.3)
    )
    assert found[LINES - 1] == pytest.approx(3.0) and found[
        LINES // 2 - 1
    ] == pytest.approx(0.7)
    assert np.delete(found, [LINES - 1, LINES // 2 - 1]).max() < 1e-12
    turns = np.arange(200)[:, None] + phase
    assert order_amplitudes(2.0 * np.cos(2 * np.pi * turns / 3))[
        LINES // 3 - 1
    ] == pytest.approx(2.0)


def test_a_scene_follows_its_response() -> None:
    data = simulate(Scene.from_mapping(TABLE))
    assert (
        list(data.direction.values) == ["up", "down"]
        and data.response_speed.attrs["display_units"] == "rpm"
    )
    np.testing.assert_allclose(
        data.response_speed * 30 / np.pi, [2200, 2500, 2800, 3100, 3400]
    )
    factor = data.response_dynamic_factor.isel(mesh=0)
    np.testing.assert_allclose(
        factor.sel(direction="up")[-1], factor.sel(direction="down")[-1], rtol=1e-6
    )
    parted = factor.sel(direction="down") / factor.sel(direction="up")
    assert (
        parted.max() > 1.5
        and (data.response_orbit_period == 1).all()
        and (data.response_multiplier < 1).all()
    )
    assert (
        data.response_jump_speed.sel(edge="before")
        != data.response_jump_speed.sel(edge="after")
    ).all()
    single = simulate(Scene.from_mapping(TABLE).replace("operation.speed", "3400 rpm"))
    assert float(single.dynamic_factor[0, 0]) == pytest.approx(
        float(factor[0, -1]), rel=2e-3
    )
    assert float(single.dte_rms[0, 0]) == pytest.approx(
        float(data.response_dte_rms.isel(mesh=0).sel(direction="up")[-1]), rel=2e-3
    )
    orders = data.response_dte_orders.isel(mesh=0, direction=0, response_speed=-1)
    np.testing.assert_allclose(
        orders.sel(order=[1, 2, 3]), single.dte_harmonics[0, 0, :3], rtol=1e-2
    )
    strobed = data.response_poincare_deflection.isel(
        mesh=0, direction=0, response_speed=-1
    )
    np.testing.assert_allclose(
        strobed, float(single.poincare_deflection[0, 0, 0]), rtol=1e-3
    )


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("dynamics.response.speed.from", "4000 rpm", "'from' must be below 'to'"),
        ("dynamics.method", "rk4", "needs method 'periodic'"),
        ("dynamics.response.direction", "sideways", "up"),
        ("dynamics.response.speed.to", "60 Hz", "Hz"),
    ],
)
def test_a_response_that_cannot_be_is_refused(key: str, value: str, says: str) -> None:
    with pytest.raises(SceneError, match=says):
        Scene.from_mapping(TABLE).replace(key, value)


def test_an_absent_response_is_no_part_of_the_identity() -> None:
    without = Scene.from_mapping(TABLE).replace("dynamics.response", None)
    assert (
        "response" not in without.canonical()
        and "response" in Scene.from_mapping(TABLE).canonical()
    )
    assert (
        Scene.from_canonical(Scene.from_mapping(TABLE).canonical()).id
        == Scene.from_mapping(TABLE).id
    )

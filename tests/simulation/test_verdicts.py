"""Verdicts of lightly damped pairs, and lives under responses that never repeat."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scenes import CAMPAIGNS, external_pair

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.dynamics.integrators.count import settling_periods
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.life.coupling import BLOCK, scatter
from wearlab.scene import Scene
from wearlab.simulation import simulate

LIGHT: dict[str, Any] = {
    "gears": external_pair(30, 40),
    "operation": {"torque": "200 N*m", "speed": "5900 rpm"},
    "mesh": {
        "damping_ratio": 1e-4,
        "normal_backlash": "100 um",
        "stiffness": {"coupling": "none"},
        "extended_contact": False,
    },
    "dynamics": {"model": "torsional"},
}


def test_a_lightly_damped_pair_that_settles_on_period_one_is_not_aperiodic() -> None:
    data = simulate(Scene.from_mapping(LIGHT))
    assert int(data.response_period[0]) == 1
    assert str(data.verdict.values) in ("completed", "coexisting")
    assert str(data.estimate_quality.values) == "as usual"
    largest = float(np.hypot(*data.floquet_multiplier.values[0, 0]))
    assert largest < 1.0 - Periodic().margin


def test_the_march_is_as_long_as_the_damping_asks_for() -> None:
    """A torsional pair is one oscillator: it dies out as exp(−ζ ω t),
    ω that of its mean stiffness.
    """
    parts = build(Scene.from_mapping(LIGHT))
    found = parts.coupling.evaluate(parts.coupling.unworn()).response
    assert found is not None
    mass = float(found.system.mass[0, 0])
    damping = float(found.system.mesh_damping[0])
    wanted = np.log(1e6) / (damping / (2.0 * mass) * found.mesh_period)
    counted = settling_periods(found.system, found.tables, found.mesh_period)
    assert counted == pytest.approx(wanted, rel=1e-9)
    marched = Periodic().transients(
        Shooting(found.system, found.tables, found.mesh_period)
    )
    assert sum(marched) == pytest.approx(wanted, rel=0.01) and wanted > 5 * 2000


@pytest.mark.parametrize("damping", [1e-4, 0.0])
def test_an_orbit_that_attracts_slowly_or_not_is_not_called_unstable(
    damping: float,
) -> None:
    mesh = {k: v for k, v in LIGHT["mesh"].items() if k != "normal_backlash"}
    data = simulate(
        Scene.from_mapping({**LIGHT, "mesh": {**mesh, "damping_ratio": damping}})
    )
    assert str(data.verdict.values) == "not attracting within the margin"
    assert str(data.estimate_quality.values).startswith(
        "doubtful: an orbit is not alone or hardly attracts"
    )


@cache
def aperiodic(load_kind: str) -> Any:
    scene = load(CAMPAIGNS / "extremes" / "light_load.toml").cases[0].scene
    wear = {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "load": load_kind,
        "until": {"cycles": 1e5},
        **({"wohler_slope": 6.0} if load_kind == "equivalent" else {}),
    }
    return simulate(scene.replace("operation.speed", "4500 rpm").replace("wear", wear))


@pytest.mark.parametrize("load_kind", ["static", "equivalent", "instant"])
def test_every_load_wears_under_a_response_that_never_repeats(load_kind: str) -> None:
    data = aperiodic(load_kind)
    assert (
        str(data.verdict.values) == "aperiodic"
        and str(data.end_reason.values) == "cycles"
    )
    assert float(data.max_wear_depth.max()) > 0.0
    assert "a response does not repeat" in str(data.estimate_quality.values)
    if load_kind != "static":
        assert (
            float(data.error_estimate_wear_depth[-1]) > 0.0
        )  # blows that do not repeat scatter


def test_static_wear_does_not_ask_how_the_pair_vibrates() -> None:
    scene = load(CAMPAIGNS / "extremes" / "light_load.toml").cases[0].scene
    data = aperiodic("static")
    first = np.abs(data.wear_rate.values[0] / data.static_mesh_force.values[0])
    again = simulate(
        scene.replace("operation.speed", "1000 rpm").replace(
            "wear",
            {
                "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
                "load": "static",
                "until": {"cycles": 1e5},
            },
        )
    )
    np.testing.assert_allclose(
        first, np.abs(again.wear_rate.values[0] / again.static_mesh_force.values[0])
    )


def test_scatter_is_the_standard_error_of_the_means_of_blocks() -> None:
    meshes = 2
    count = 5 * BLOCK + 3
    rows = np.random.default_rng(3).normal(size=(meshes, count, 4))

    def rate_of(some: Any) -> Any:
        return rows.reshape(-1, 4)[some].mean(axis=0)[None]

    means = rows[:, : 5 * BLOCK].mean(axis=0).reshape(5, BLOCK, 4).mean(axis=1)
    expected = means.std(axis=0, ddof=1).max() / np.sqrt(5)
    assert scatter(rate_of, meshes, [count]) == pytest.approx(expected, rel=1e-12)
    assert scatter(rate_of, meshes, [1, 2]) == 0.0

"""Bearing forces against the equilibrium of every member, for every kind of gear set."""

from copy import deepcopy
from functools import cache, reduce
from typing import Any

import numpy as np
import pytest

from wearlab.scene import Scene
from wearlab.scene.build import build
from wearlab.simulation import simulate

BEARING = {"radial_stiffness": "300 N/um", "damping_ratio": 0.03}
SET: dict[str, Any] = {
    "gears": {
        "kind": "planetary",
        "module": "2.25 mm",
        "face_width": "25 mm",
        "centre_distance": "56.5 mm",
        "planets": 3,
        "sun": {"teeth": 20, "profile_shift_coefficient": 0.35},
        "planet": {"teeth": 29, "mass": "0.35 kg", "bore_diameter": "47 mm"},
        "ring": {"teeth": 79, "rim_diameter": "209 mm"},
        "carrier": {"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    },
    "operation": {"torque": "134 N*m", "speed": "1500 rpm"},
    "mesh": {"damping_ratio": 0.07},
    "dynamics": {
        "model": "planetary",
        "supports": {
            "sun": BEARING,
            "planet": {"radial_stiffness": "58 N/um", "damping_ratio": 0.03},
            "ring": {**BEARING, "tangential_stiffness": "57.6 N/um"},
            "carrier": {**BEARING, "tangential_stiffness": "10 N/um"},
        },
    },
}
BY_CARRIER = {"input": "carrier", "output": "sun", "fixed": "ring"}
OUTPUT_GROUNDED = {
    **SET["dynamics"]["supports"],
    "sun": {**BEARING, "tangential_stiffness": "10 N/um"},
    "carrier": BEARING,
}
CASES: dict[str, dict[str, Any]] = {
    "three planets": {},
    "four unequal, free to turn, at speed": {
        "gears.planets": 4,
        "gears.planet_angles": [f"{round(k * 24.75) * 360 / 99!r} deg" for k in range(4)],
        "operation.speed": "6000 rpm",
        "dynamics.supports.carrier": BEARING,
    },
    "driven by the carrier": {
        "operation": {"torque": "500 N*m", "speed": "400 rpm", **BY_CARRIER},
        "dynamics.supports": OUTPUT_GROUNDED,
    },
}


@cache
def of_set(case: str) -> Any:
    mapping = deepcopy(SET)
    for key, value in CASES[case].items():
        *path, last = key.split(".")
        reduce(lambda table, name: table[name], path, mapping)[last] = value
    scene = Scene.from_mapping(mapping)
    return scene, simulate(scene)


def mean_bearing_force(data: Any) -> Any:
    return data.bearing_force.isel(update=0).mean(["mesh_period", "phase"])


@pytest.mark.parametrize("case", list(CASES))
def test_every_member_of_a_planetary_set_is_in_equilibrium(case: str) -> None:
    """Mesh forces by load and geometry alone, the centrifugal force and the bearing: zero in the mean."""
    scene, data = of_set(case)
    built = build(scene).gears
    force = data.static_mesh_force.values * data.mesh_load_factor.values[0]
    angles = built.sense * np.asarray(built.angles)
    n, sun_drives = len(angles), built.sense > 0.0
    sense = 1.0 if sun_drives else -1.0  # in which the sun pushes its planets
    sun, ring = (kind.pair.working_pressure_angle for kind in built.kinds)
    radius = built.bodies["carrier"].radius
    train_speed = float(scene.operation.speed)
    carrier = train_speed * (1.0 if not sun_drives else 20.0 / 99.0)
    outwards = np.stack([np.cos(angles), np.sin(angles)])
    onwards = np.stack([-np.sin(angles), np.cos(angles)])
    by_sun = force[:n] * (sense * np.cos(sun) * onwards + np.sin(sun) * outwards)
    by_ring = force[n:] * (sense * np.cos(ring) * onwards - np.sin(ring) * outwards)
    flung = built.bodies["planet"].mass * carrier**2 * radius * outwards
    held = mean_bearing_force(data).transpose("axis", "member")
    planets = [f"planet-{k + 1}" for k in range(n)]
    size = np.hypot(*(by_sun + by_ring)).max()
    np.testing.assert_allclose(held.sel(member=planets), -(by_sun + by_ring + flung), atol=2e-4 * size)
    np.testing.assert_allclose(held.sel(member="sun"), by_sun.sum(axis=1), atol=1e-3 * size)
    np.testing.assert_allclose(held.sel(member="ring"), by_ring.sum(axis=1), atol=1e-3 * size)
    on_pins = held.sel(member=planets).sum("member")
    np.testing.assert_allclose(held.sel(member="carrier"), on_pins, atol=1e-3 * size)


def test_a_planet_of_ngw11_presses_on_its_pin_as_statics_says() -> None:
    _, data = of_set("three planets")
    held = np.hypot(*mean_bearing_force(data).transpose("axis", "member").values)
    assert held[1:4] == pytest.approx(3915.0, rel=2e-3)  # by hand: 134 N·m, N = 3, 0.35 kg at 303 rpm


@pytest.mark.parametrize("input_gear", ["pinion", "ring"])
def test_both_gears_of_an_internal_pair_are_in_equilibrium(input_gear: str) -> None:
    other = "ring" if input_gear == "pinion" else "pinion"
    scene = Scene.from_mapping({
        "gears": {
            "kind": "internal-pair", "module": "6 mm", "face_width": "60 mm",
            "pinion": {"teeth": 40}, "ring": {"teeth": 100, "rim_diameter": "680 mm"},
        },
        "operation": {"torque": "1000 N*m", "speed": "1000 rpm", "input": input_gear, "output": other},
        "mesh": {"damping_ratio": 0.07},
        "dynamics": {
            "model": "spur-3dof",
            "supports": {"pinion": BEARING, "ring": {**BEARING, "preload": "250 N"}},
        },
    })  # fmt: skip
    data = simulate(scene)
    load = float(data.static_mesh_force[0])
    held = mean_bearing_force(data).sel(axis="y")
    push = {input_gear: load, other: -load}
    away = -250.0 if input_gear == "ring" else 250.0  # a preload pulls the gears apart
    assert float(held.sel(member="pinion")) == pytest.approx(push["pinion"], rel=1e-3)
    assert float(held.sel(member="ring")) == pytest.approx(push["ring"] - away, rel=1e-3)

"""Bearing forces against the equilibrium of every member, for every
kind of gear set.
"""

from copy import deepcopy
from functools import cache, reduce
from typing import Any, NamedTuple

import numpy as np
import pytest
from scenes import internal_pair, planetary_set

from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")

BEARING = {"radial_stiffness": "300 N/um", "damping_ratio": 0.03}
SET: dict[str, Any] = {
    "gears": planetary_set(
        {"teeth": 20, "profile_shift_coefficient": 0.35},
        {"teeth": 29, "mass": "0.35 kg", "bore_diameter": "47 mm"},
        {"teeth": 79, "rim_diameter": "209 mm"},
        module="2.25 mm",
        face_width="25 mm",
        centre_distance="56.5 mm",
        carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    ),
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
        "gears.planet_angles": [
            f"{round(k * 24.75) * 360 / 99!r} deg" for k in range(4)
        ],
        "operation.speed": "6000 rpm",
        "dynamics.supports.carrier": BEARING,
    },
    "driven by the carrier": {
        "operation": {"torque": "500 N*m", "speed": "400 rpm", **BY_CARRIER},
        "dynamics.supports": OUTPUT_GROUNDED,
    },
}
RUBBING: dict[str, dict[str, Any]] = {
    f"{name}, rubbing": {
        **changes,
        "dynamics.friction": {"coefficient": 0.08},
        "numerics": {"phase_points": 1024},
    }
    for name, changes in CASES.items()
}


@cache
def of_set(case: str) -> Any:
    mapping = deepcopy(SET)
    for key, value in (CASES | RUBBING)[case].items():
        *path, last = key.split(".")
        reduce(lambda table, name: table[name], path, mapping)[last] = deepcopy(value)
    scene = Scene.from_mapping(mapping)
    return scene, simulate(scene)


def mean_bearing_force(data: Any) -> Any:
    return data.bearing_force.isel(update=0).mean(["mesh_period", "phase"])


class Pushed(NamedTuple):
    """Mean forces on the planets by sun and ring, and the centrifugal
    one, (2, N) each [N].
    """

    by_sun: Any
    by_ring: Any
    flung: Any


def friction_on_driver(
    pitch: Any, along: Any, centres: tuple[Any, Any], speeds: tuple[float, float]
) -> Any:
    """Return where friction pushes the driving flank past the pitch point: against its
    sliding, (2, N).

    The contact moves on along the force on the driven gear; both flanks turn about
    their centres.
    """
    point = pitch + 1e-3 * along
    first, second = (
        speed * np.stack([-(point - centre)[1], (point - centre)[0]])
        for centre, speed in zip(centres, speeds, strict=True)
    )
    return (second - first) / np.hypot(*(second - first))


def pushed(scene: Any, data: Any) -> Pushed:
    """Return what pushes the planets, by geometry and the mean forces of the meshes.

    Without friction those are the static ones, by load alone; with it, what is stored
    along and across the lines of action.
    """
    built = build(scene).gears
    angles = built.sense * np.asarray(built.angles)
    n = len(angles)
    sun_drives = built.sense > 0.0
    sense = 1.0 if sun_drives else -1.0  # in which the sun pushes its planets
    sun, ring = (kind.pair.working_pressure_angle for kind in built.kinds)
    radius = built.bodies["carrier"].radius
    outwards = np.stack([np.cos(angles), np.sin(angles)])
    onwards = np.stack([-np.sin(angles), np.cos(angles)])
    normals = (
        sense * np.cos(sun) * onwards + np.sin(sun) * outwards,
        sense * np.cos(ring) * onwards - np.sin(ring) * outwards,
    )
    carrier = float(scene.operation.speed) * (1.0 if not sun_drives else 20.0 / 99.0)
    flung = built.bodies["planet"].mass * carrier**2 * radius * outwards
    if scene.dynamics.friction is None:
        force = data.static_mesh_force.values * data.mesh_load_factor.values[0]
        return Pushed(force[:n] * normals[0], force[n:] * normals[1], flung)
    along, across = (
        one.isel(update=0).mean(["mesh_period", "phase"]).values
        for one in (
            data.dynamic_mesh_force + data.mesh_damping_force,
            data.friction_force,
        )
    )
    gears = {name: built.gears[name] for name in ("sun", "ring", "planet")}
    own = radius * outwards  # the planets' centres
    found = []
    for at, (name, normal, alpha) in enumerate(
        zip(("sun", "ring"), normals, (sun, ring), strict=True)
    ):
        planet_drives = (name == "ring") == sun_drives
        speeds = (1.0 / gears[name].teeth, -1.0 / gears["planet"].teeth)
        if name == "ring":
            speeds = (-speeds[0], speeds[1])
        centres = (np.zeros_like(own), own)
        pitch = gears[name].base_radius / np.cos(alpha) * outwards
        on_driven = -normal if planet_drives else normal
        order = slice(None, None, -1) if planet_drives else slice(None)
        across_driver = friction_on_driver(
            pitch, on_driven, centres[order], speeds[order]
        )
        across_planet = across_driver if planet_drives else -across_driver
        mine = slice(at * n, (at + 1) * n)
        found.append(along[mine] * normal + across[mine] * across_planet)
    return Pushed(*found, flung)


@pytest.mark.parametrize("case", [*CASES, *RUBBING])
def test_every_member_of_a_planetary_set_is_in_equilibrium(case: str) -> None:
    """Mesh forces by load and geometry, friction, the centrifugal force and the
    bearing: zero in the mean.
    """
    scene, data = of_set(case)
    by_sun, by_ring, flung = pushed(scene, data)
    held = mean_bearing_force(data).transpose("axis", "member")
    planets = [f"planet-{k + 1}" for k in range(by_sun.shape[1])]
    size = np.hypot(*(by_sun + by_ring)).max()
    np.testing.assert_allclose(
        held.sel(member=planets), -(by_sun + by_ring + flung), atol=2e-4 * size
    )
    np.testing.assert_allclose(
        held.sel(member="sun"), by_sun.sum(axis=1), atol=1e-3 * size
    )
    np.testing.assert_allclose(
        held.sel(member="ring"), by_ring.sum(axis=1), atol=1e-3 * size
    )
    on_pins = held.sel(member=planets).sum("member")
    np.testing.assert_allclose(held.sel(member="carrier"), on_pins, atol=1e-3 * size)


@pytest.mark.parametrize("case", [*CASES, *RUBBING])
def test_the_pins_carry_the_torque_of_the_carrier(case: str) -> None:
    """The carrier's torque by the power that goes through the set, less its losses."""
    scene, data = of_set(case)
    built = build(scene).gears
    angles = built.sense * np.asarray(built.angles)
    onwards = np.stack([-np.sin(angles), np.cos(angles)])
    held = mean_bearing_force(data).transpose("axis", "member")
    pins = held.sel(member=[f"planet-{k + 1}" for k in range(len(angles))]).values
    torque = -built.sense * (pins * onwards).sum() * built.bodies["carrier"].radius
    given = float(scene.operation.torque)
    by_carrier = scene.operation.input == "carrier"
    efficiency = float(data.efficiency[0]) if "efficiency" in data else 1.0
    assert torque == pytest.approx(
        given if by_carrier else given * efficiency * 99.0 / 20.0, rel=1e-3
    )


def test_a_planet_of_ngw11_presses_on_its_pin_as_statics_says() -> None:
    _, data = of_set("three planets")
    held = np.hypot(*mean_bearing_force(data).transpose("axis", "member").values)
    assert held[1:4] == pytest.approx(
        3915.0, rel=2e-3
    )  # by hand: 134 N·m, N = 3, 0.35 kg at 303 rpm


@pytest.mark.parametrize("input_gear", ["pinion", "ring"])
def test_both_gears_of_an_internal_pair_are_in_equilibrium(input_gear: str) -> None:
    other = "ring" if input_gear == "pinion" else "pinion"
    scene = Scene.from_mapping(
        {
            "gears": internal_pair(
                40,
                {"teeth": 100, "rim_diameter": "680 mm"},
                module="6 mm",
                face_width="60 mm",
            ),
            "operation": {
                "torque": "1000 N*m",
                "speed": "1000 rpm",
                "input": input_gear,
                "output": other,
            },
            "mesh": {"damping_ratio": 0.07},
            "dynamics": {
                "model": "spur-3dof",
                "supports": {
                    "pinion": BEARING,
                    "ring": {**BEARING, "preload": "250 N"},
                },
            },
        }
    )
    data = simulate(scene)
    load = float(data.static_mesh_force[0])
    held = mean_bearing_force(data).sel(axis="y")
    push = {input_gear: load, other: -load}
    away = -250.0 if input_gear == "ring" else 250.0  # a preload pulls the gears apart
    assert float(held.sel(member="pinion")) == pytest.approx(push["pinion"], rel=1e-3)
    assert float(held.sel(member="ring")) == pytest.approx(
        push["ring"] - away, rel=1e-3
    )


@pytest.mark.parametrize(
    ("kind", "driving"),
    [("external", "pinion"), ("internal", "pinion"), ("internal", "ring")],
)
def test_both_gears_of_a_rubbing_pair_are_in_equilibrium(
    kind: str, driving: str
) -> None:
    """Forces along the path as they wear the flanks, with arms by
    geometry: bearings and torques.
    """
    mate = "gear" if kind == "external" else "ring"
    driven = mate if driving == "pinion" else "pinion"
    second = (
        {"teeth": 45}
        if kind == "external"
        else {"teeth": 100, "rim_diameter": "680 mm"}
    )
    friction = 0.1
    scene = Scene.from_mapping(
        {
            "gears": {
                "kind": f"{kind}-pair",
                "module": "6 mm",
                "face_width": "60 mm",
                "pinion": {"teeth": 40},
                mate: second,
            },
            "operation": {
                "torque": "1000 N*m",
                "speed": "400 rpm",
                "input": driving,
                "output": driven,
            },
            "mesh": {
                "damping_ratio": 0.07,
                "extended_contact": False,
            },  # all force is between A and E
            "dynamics": {
                "model": "spur-3dof",
                "supports": {"pinion": BEARING, mate: BEARING},
                "friction": {"coefficient": friction},
            },
        }
    )
    data = simulate(scene)
    pair = build(scene).gears.kinds[0].pair
    held = mean_bearing_force(data).sel(axis="y")
    torque = {}
    for gear in pair.gears:
        one = data.sel(flank=gear.name).isel(update=0)
        s = one.path_position.values
        force = one.tooth_force.values
        arm = pair.curvature(s)[pair.gears.index(gear)]
        normal = np.trapezoid(force, s) / pair.base_pitch
        torque[gear.name] = gear.base_radius * normal + np.trapezoid(
            force * np.sign(s) * friction * arm, s
        ) / (pair.base_pitch)
        push = normal if gear is pair.driving else -normal
        assert float(held.sel(member=gear.name)) == pytest.approx(push, rel=2e-3)
    assert torque[driving] == pytest.approx(1000.0, rel=2e-3)
    ratio = pair.driven.teeth / pair.driving.teeth
    assert torque[driven] == pytest.approx(
        1000.0 * ratio * float(data.efficiency[0]), rel=2e-3
    )

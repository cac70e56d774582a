"""A plastic pair, both of whose gears soften and wear, by a script of its own.

Nothing of the package is asked: uniform nodes, one stiffness of all pairs, wear point
by point, the temperatures by plain iteration in every stage of a Runge-Kutta march.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest
from warm_pair import warm_pair

from wearlab.simulation import simulate

MODULE, WIDTH, TORQUE, SPEED = 1.5e-3, 12e-3, 1.1, 900.0 * math.pi / 30.0
TEETH = np.array([24.0, 35.0])
AMBIENT = 25.0
DEGREES = [20.0, 50.0, 80.0, 110.0]
MODULI = [[3.1e9, 2.4e9, 1.6e9, 0.9e9], [2.6e9, 1.7e9, 1.3e9, 1.0e9]]
WEAR = [[0.5e-15, 0.8e-15, 1.1e-15, 1.9e-15], [2.0e-15, 3.1e-15, 3.3e-15, 5.0e-15]]
FRICTION = [0.18, 0.22, 0.25, 0.30]
TRANSFER = {"flank": 9000.0, "root": 2148.0}
CYCLES = 6e6


class Geometry(NamedTuple):
    """The path from A to B, B to D and D to E, and what slides there."""

    double: np.ndarray
    single: np.ndarray
    pitch: float
    base: np.ndarray

    def rolling(self, position):
        """Curvatures of both flanks, (2, n) [m]."""
        tangent = self.base * math.tan(math.radians(20.0))
        return np.stack([tangent[0] + position, tangent[1] - position])

    def slip(self, position):
        """|1 − v_other/v_own| of both flanks, (2, n)."""
        rho = self.rolling(position)
        per_tooth = rho / TEETH[:, None]
        return np.abs(1.0 - per_tooth[::-1] / per_tooth)

    def sliding(self, position):
        """|v_s| [m/s]."""
        return SPEED * (1.0 + TEETH[0] / TEETH[1]) * np.abs(position)


def geometry(nodes):
    radius = 0.5 * MODULE * TEETH
    base = radius * math.cos(math.radians(20.0))
    to_tip = np.sqrt((radius + MODULE) ** 2 - base**2)
    reach = to_tip - base * math.tan(math.radians(20.0))
    pitch = math.pi * MODULE * math.cos(math.radians(20.0))
    begin, end = -reach[1], reach[0]
    return Geometry(
        np.linspace(begin, end - pitch, nodes),
        np.linspace(end - pitch, begin + pitch, nodes),
        pitch,
        base,
    )


def integral(values, position):
    return np.trapezoid(values, position)


def shares(of, gap, stiffness, load):
    """Forces of the pair at s in A to B, and of that at s + p_b."""
    later = 0.5 * (load + stiffness * (gap[0] - gap[2]))
    later = np.clip(later, 0.0, load)
    return load - later, later


def at(table, temperature):
    assert DEGREES[0] <= temperature <= DEGREES[-1]
    return np.interp(temperature, DEGREES, table)


def resistance(gear, place):
    speed = SPEED * 0.5 * MODULE * TEETH[0]
    carried = (speed * MODULE * 1e3) ** 0.75
    return TRANSFER[place] / (WIDTH * 1e3 * TEETH[gear] * carried)


def state(of, depth):
    """Rates (3, 2, n) [m per cycle], power [W] and temperatures of depths (3, 2, n)."""
    load = TORQUE / of.base[0]
    gap = depth.sum(axis=1)
    power = 1.0
    for _ in range(60):
        root = [AMBIENT + resistance(i, "root") * power for i in (0, 1)]
        flank = [AMBIENT + resistance(i, "flank") * power for i in (0, 1)]
        soft = sum(1.0 / at(MODULI[i], root[i]) for i in (0, 1))
        stiffness = WIDTH / (7.5 * soft)
        first, later = shares(of, gap, stiffness, load)
        over_double = first * of.sliding(of.double)
        over_double = over_double + later * of.sliding(of.double + of.pitch)
        over_single = load * of.sliding(of.single)
        mean = integral(over_double, of.double) + integral(over_single, of.single)
        following = at(FRICTION, max(flank)) * mean / of.pitch
        settled = abs(following - power) < 1e-13 * power
        power = following
        if settled:
            break
    forces = (first, np.full_like(of.single, load), later)
    places = (of.double, of.single, of.double + of.pitch)
    passes = TEETH[0] / TEETH
    k = np.array([at(WEAR[i], flank[i]) for i in (0, 1)])
    rates = [
        (k * passes)[:, None] * force / WIDTH * of.slip(place)
        for force, place in zip(forces, places, strict=True)
    ]
    return np.stack(rates), power, (root, flank)


def march(nodes, steps):
    """Depths after CYCLES by the classical Runge-Kutta method, finer at the start."""
    of = geometry(nodes)
    depth = np.zeros((3, 2, nodes))
    ends = CYCLES * np.linspace(0.0, 1.0, steps + 1) ** 2
    for size in np.diff(ends):
        one = state(of, depth)[0]
        two = state(of, depth + 0.5 * size * one)[0]
        three = state(of, depth + 0.5 * size * two)[0]
        four = state(of, depth + size * three)[0]
        depth = depth + size / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return depth, state(of, depth)


def degrees(values):
    return [f"{value} degC" for value in values]


def table(values, unit):
    return {
        "temperature": degrees(DEGREES),
        "value": [f"{value!r} {unit}" for value in values],
    }


@pytest.fixture(scope="module")
def run():
    material = {"poisson_ratio": 0.37, "density": "1300 kg/m^3"}
    members = {
        name: {
            "teeth": int(TEETH[i]),
            "material": {**material, "youngs_modulus": table(MODULI[i], "Pa")},
        }
        for i, name in enumerate(("pinion", "gear"))
    }
    coefficients = {
        name: {"model": "over-temperature", **table(WEAR[i], "m^2/N")}
        for i, name in enumerate(("pinion", "gear"))
    }
    scene = warm_pair(
        gears={
            "kind": "external-pair",
            "module": "1.5 mm",
            "face_width": "12 mm",
            **members,
        },
        operation={"torque": f"{TORQUE} N*m", "speed": "900 rpm"},
        thermal={
            "ambient": f"{AMBIENT} degC",
            "friction": {"temperature": degrees(DEGREES), "value": FRICTION},
        },
        wear__coefficient=coefficients,
        wear__until={"cycles": CYCLES},
        wear__snapshots={"cycles": [CYCLES / 2]},
        numerics={"tolerance": 1e-4},
    )
    return simulate(scene)


def test_both_gears_soften_and_wear(run):
    depth, (rates, power, (root, flank)) = march(401, 60)
    rough = march(201, 30)[0]
    assert rough[:, :, ::200] == pytest.approx(depth[:, :, ::400], rel=1e-5)

    first, last = run.isel(update=0), run.isel(update=-1)
    begin = state(geometry(401), np.zeros((3, 2, 401)))
    assert first["friction_power"].item() == pytest.approx(begin[1], rel=1e-5)
    assert last["friction_power"].item() == pytest.approx(power, rel=1e-4)
    found = last["tooth_temperature"] - 273.15
    assert found.sel(place="root").values == pytest.approx(root, rel=1e-5)
    assert found.sel(place="flank").values == pytest.approx(flank, rel=1e-5)

    for number, name in enumerate(("pinion", "gear")):
        stored = last["wear_depth"].sel(flank=name).values
        ends = depth[0, number, 0], depth[2, number, -1]
        assert (stored[0], stored[-1]) == pytest.approx(ends, rel=1e-4), name
        rate = last["wear_rate"].sel(flank=name).values
        ends = rates[0, number, 0], rates[2, number, -1]
        assert (rate[0], rate[-1]) == pytest.approx(ends, rel=1e-3), name
    assert float(last["wear_depth"].sel(flank="pinion").max()) > 1e-6
    assert float(last["wear_depth"].sel(flank="gear").max()) > 1e-6

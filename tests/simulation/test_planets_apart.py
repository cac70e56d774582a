"""Planets that differ wear each by its own load: a march and a balance of our own."""

import copy

import numpy as np
import outside_march
import outside_planets
import pytest
from scenes import planetary_set
from scipy.optimize import brentq

from wearlab.assembly import build
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused
from wearlab.store.align import start_wear

SUN, PLANET, RING, PLANETS = 20, 29, 79, 3
TORQUE = 90.0
PAIR = 3e8  # stiffness of a pair of teeth [N/m]
K = 2.7e-16
FACE = 25e-3
SET = {
    "gears": planetary_set(
        {"teeth": SUN, "profile_shift_coefficient": 0.35, "mass": "0.53 kg"},
        {"teeth": PLANET, "bore_diameter": "47 mm", "mass": "0.35 kg"},
        {"teeth": RING, "rim_diameter": "209 mm"},
        module="2.25 mm",
        face_width="25 mm",
        centre_distance="56.5 mm",
        carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    ),
    "operation": {"torque": f"{TORQUE} N*m", "speed": "1000 rpm"},
    "mesh": {
        "stiffness": {"model": "constant", "value": f"{PAIR} N/m", "of": "pair"},
        "extended_contact": False,
    },
    "wear": {
        "coefficient": {"model": "constant", "value": f"{K} m^2/N"},
        "contact_patch": "none",
        "load": "static",
        "until": {"depth": "8 um", "flank": "planet-sun"},
    },
}
PINS = {"slow": "frozen", "seed": 3, "planet": {"planet_position": ["2 um"]}}
SUPPORTS = {
    "sun": {"radial_stiffness": "10 N/um"},
    "planet": {"radial_stiffness": "58 N/um"},
    "ring": {"radial_stiffness": "1000 N/um", "tangential_stiffness": "57.6 N/um"},
    "carrier": {"radial_stiffness": "195 N/um", "tangential_stiffness": "10 N/um"},
}


def _with(**sections):
    return {**copy.deepcopy(SET), **copy.deepcopy(sections)}


class OwnMesh:
    """One mesh of our own: pairs as springs at phases of one base pitch."""

    def __init__(self, pair, passes, nodes=320):
        path = pair.path
        self.pairs = int(np.ceil(pair.contact_ratio))
        position = path.A + (np.arange(self.pairs * nodes) + 0.5) * (
            pair.base_pitch / nodes
        )
        self.present = (position < path.E).reshape(self.pairs, nodes)
        at_pitch = [
            gear.base_radius * np.tan(pair.working_pressure_angle)
            for gear in pair.gears
        ]
        second = at_pitch[1] + (position if pair.internal else -position)
        speed = np.array([at_pitch[0] + position, second]) / np.array(
            [[gear.base_radius] for gear in pair.gears]
        )
        sliding = np.abs(1.0 - speed[::-1] / speed)
        of_flank = K * sliding * np.array(passes)[:, None] / FACE
        self.wear = of_flank.reshape(2, self.pairs, nodes)

    def loaded(self, gap, load):
        """Return mean deflection, and the force at every position."""
        gaps = np.sort(np.where(self.present, gap, np.inf), axis=0)
        level = load / PAIR + gaps[0]
        for count in range(2, self.pairs + 1):
            more = (load / PAIR + gaps[:count].sum(axis=0)) / count
            level = np.where(level > gaps[count - 1], more, level)
        force = PAIR * np.maximum(0.0, np.where(self.present, level - gap, 0.0))
        return level.mean(), force


def _own_march(parts, limit, steps=30):
    """Return cycles, and depths of planets (steps, 3), by Heun's method."""
    pairs = [kind.pair for kind in parts.gears.kinds[::PLANETS]]
    at_sun = OwnMesh(pairs[0], (PLANETS, SUN / PLANET))
    at_ring = OwnMesh(pairs[1], (SUN / PLANET, PLANETS * SUN / RING))
    errors = np.array([float(mesh.error.slow.value(0.0)) for mesh in parts.meshes])
    total = TORQUE / pairs[0].gears[0].base_radius
    shape = (PLANETS + 1, *at_sun.present.shape)
    ring_shape = (PLANETS + 1, *at_ring.present.shape)

    def rates(state):
        on_sun, on_ring = state

        def carried(load, n):
            first, _ = at_sun.loaded(on_sun[-1] + on_sun[n], load)
            second, _ = at_ring.loaded(on_ring[-1] + on_ring[n], load)
            return first + second + errors[n] + errors[PLANETS + n]

        def load_at(turn, n):
            if carried(0.0, n) >= turn:
                return 0.0
            return brentq(lambda load: carried(load, n) - turn, 0.0, 3 * total)

        low = min(carried(0.0, n) for n in range(PLANETS))
        turn = brentq(
            lambda turn: sum(load_at(turn, n) for n in range(PLANETS)) - total,
            low,
            low + 60e-6,
        )
        loads = [load_at(turn, n) for n in range(PLANETS)]
        rate_sun, rate_ring = np.zeros(shape), np.zeros(ring_shape)
        for n, load in enumerate(loads):
            _, force = at_sun.loaded(on_sun[-1] + on_sun[n], load)
            rate_sun[n] = at_sun.wear[1] * force
            rate_sun[-1] += at_sun.wear[0] * force / PLANETS
            _, force = at_ring.loaded(on_ring[-1] + on_ring[n], load)
            rate_ring[n] = at_ring.wear[0] * force
            rate_ring[-1] += at_ring.wear[1] * force / PLANETS
        return rate_sun, rate_ring, np.array(loads) * PLANETS / total

    state = (np.zeros(shape), np.zeros(ring_shape))
    cycle, depths, factors = [0.0], [np.zeros(PLANETS)], []
    step = None
    while depths[-1].max() < limit and len(cycle) < 4 * steps:
        first = rates(state)
        factors.append(first[2])
        if step is None:
            step = limit / first[0][:PLANETS].max() / steps
        ahead = tuple(h + step * r for h, r in zip(state, first, strict=False))
        second = rates(ahead)
        state = tuple(
            h + 0.5 * step * (r + q)
            for h, r, q in zip(state, first, second, strict=False)
        )
        cycle.append(cycle[-1] + step)
        depths.append(state[0][:PLANETS].max(axis=(1, 2)))
    return np.array(cycle), np.array(depths), np.array(factors)


def test_each_planet_wears_as_in_a_march_of_our_own():
    scene = Scene.from_mapping(_with(errors=PINS))
    data = simulate(scene)
    cycle, depths, factors = _own_march(build(scene), 10e-6)
    np.testing.assert_allclose(data.planet_load_factor[0], factors[0], rtol=2e-3)
    ours = np.array(
        [np.interp(8e-6, depths[:, n], cycle, right=np.nan) for n in range(PLANETS)]
    )
    reached = np.isfinite(ours)
    first = int(np.nanargmin(ours))
    assert float(data.life) == pytest.approx(ours[first], rel=5e-3)
    np.testing.assert_allclose(data.planet_life[reached], ours[reached], rtol=1e-2)
    at_end = [np.interp(float(data.life), cycle, depths[:, n]) for n in range(PLANETS)]
    np.testing.assert_allclose(
        data.planet_max_wear_depth.sel(flank="planet-sun")[-1], at_end, rtol=5e-3
    )
    assert f"planet {first + 1} fails first" in data.validity.item()


@pytest.mark.slow
def test_planets_in_motion_wear_as_in_a_march_of_18_coordinates():
    """There pins that are off push by the stiffness of their bearings."""
    depth = 1.5e-6
    scene = outside_planets.scene_of(90.0, 20.0, 7, 1e6 * depth, "elastic")
    data = simulate(scene)
    outside = outside_march.Outside(scene, 600)
    np.testing.assert_allclose(np.hypot(*outside.pins.T), 20e-6, rtol=1e-6)
    ours = outside_planets.marched(outside, depth)
    moving = data.mesh_load_factor.values[0, :PLANETS]
    assert np.ptp(moving) > 0.05
    np.testing.assert_allclose(moving, ours.load_factor, atol=1e-3)
    np.testing.assert_allclose(data.planet_life, ours.life, rtol=5e-3)


def test_planets_on_rigid_pins_share_as_springs_in_series():
    """``W_n = (u − e_n)/(1/k_s + 1/k_r)`` and ``Σ W_n = T/r``."""
    table = _with(errors=PINS)
    table["mesh"]["stiffness"]["of"] = "mesh"
    del table["wear"]["until"]
    scene = Scene.from_mapping(table)
    parts = build(scene)
    errors = [float(mesh.error.slow.value(0.0)) for mesh in parts.meshes]
    of_planets = np.array(errors[:PLANETS]) + errors[PLANETS:]
    total = TORQUE / parts.gears.gears["sun"].base_radius
    springs = 0.5 * PAIR * (of_planets.mean() - of_planets) + total / PLANETS
    assert springs.min() > 0.0
    found = simulate(scene).planet_load_factor.values[0]
    np.testing.assert_allclose(found, springs * PLANETS / total, rtol=1e-9)


def test_planets_on_bearings_share_a_static_load_as_in_motion():
    """Constant stiffness: the mean of the motion is the balance at rest."""
    table = _with(errors={**PINS, "planet": {"planet_position": ["20 um"]}})
    table["mesh"] = {
        "stiffness": {"model": "constant", "value": f"{PAIR} N/m", "of": "mesh"},
        "damping_ratio": 0.07,
    }
    held = {name: {**held, "damping_ratio": 0.03} for name, held in SUPPORTS.items()}
    table["dynamics"] = {"model": "planetary", "supports": held}
    del table["wear"]["until"]
    data = simulate(Scene.from_mapping(table))
    at_rest = data.planet_load_factor.values[0]
    assert np.ptp(at_rest) > 0.1
    moving = data.mesh_load_factor.values[0, :PLANETS]
    np.testing.assert_allclose(at_rest, moving, rtol=1e-4)


def test_a_planet_whose_pin_is_far_off_carries_nothing():
    table = _with(errors={**PINS, "planet": {"planet_position": ["200 um"]}})
    del table["wear"]["until"]
    found = simulate(Scene.from_mapping(table)).planet_load_factor.values[0]
    assert found.min() == 0.0
    assert found.sum() == pytest.approx(PLANETS)


def test_planets_that_hardly_differ_wear_like_those_that_do_not():
    alike = simulate(Scene.from_mapping(SET))
    errors = {**PINS, "planet": {"planet_position": ["0.0001 nm"]}}
    apart = simulate(Scene.from_mapping(_with(errors=errors)))
    assert float(apart.life) == pytest.approx(float(alike.life), rel=1e-6)
    np.testing.assert_allclose(apart.worn_mass[-1], alike.worn_mass[-1], rtol=1e-6)
    np.testing.assert_allclose(
        apart.planet_wear_depth.sel(planet=2, flank="planet-ring")[-1],
        alike.wear_depth.sel(flank="planet-ring")[-1],
        atol=1e-11,
    )
    assert "mean planet" in apart.wear_depth.attrs["comment"]


@pytest.mark.parametrize(
    "errors", [{}, {"seed": 3, "sun": {"total_composite": "30 um"}}]
)
def test_nothing_is_stored_of_planets_that_are_alike(errors):
    table = _with(errors=errors) if errors else SET
    data = simulate(Scene.from_mapping(table))
    assert not [name for name in data.variables if str(name).startswith("planet")]
    assert "mean planet" not in data.wear_depth.attrs["comment"]


def test_one_planet_may_begin_worn():
    table = _with()
    table["wear"]["initial"] = {
        "planet-sun": {"depth": "3 um", "shape": "uniform", "planet": 2},
        "planet-ring": {"depth": "1 um", "planet": 1},
    }
    data = simulate(Scene.from_mapping(table))
    first = data.planet_max_wear_depth[0].sel(flank=["planet-sun", "planet-ring"])
    np.testing.assert_allclose(first, [[0, 1e-6], [3e-6, 0], [0, 0]], rtol=1e-9)
    mean = data.wear_depth[0].sel(flank="planet-sun").max()
    assert float(mean) == pytest.approx(1e-6)
    # what is worn yields: the other planets take over its load
    assert float(data.planet_load_factor[0, 1]) < 0.9


@pytest.mark.parametrize(
    ("flank", "planet", "reason"),
    [
        ("sun", 1, "sun is no flank of a planet"),
        ("planet-sun", 4, "there are planets 1 to 3, no planet 4"),
    ],
)
def test_wear_of_a_planet_that_is_none_is_refused(flank, planet, reason):
    table = _with()
    initial = {"depth": "3 um", "shape": "uniform", "planet": planet}
    table["wear"]["initial"] = {flank: initial}
    with pytest.raises(SceneError, match=reason):
        Scene.from_mapping(table)
    table["wear"]["initial"] = {"planet-sun": {**initial, "planet": 3}}
    Scene.from_mapping(table)


def test_a_run_goes_on_with_the_wear_of_every_planet():
    parent = simulate(Scene.from_mapping(_with(errors=PINS)))
    parent.attrs["id"] = "0" * 20
    table = _with(errors=PINS, start={"run": "0" * 20})
    scene = Scene.from_mapping(table)
    taken = start_wear(parent, scene.start)
    goes_on = simulate(scene.with_start_wear(taken))
    np.testing.assert_array_equal(
        goes_on.planet_wear_depth[0], parent.planet_wear_depth[-1]
    )


def test_other_numbers_of_planets_do_not_go_on():
    """They ended in a ValueError of zip."""
    parent = simulate(Scene.from_mapping(_with(errors=PINS)))
    scene = Scene.from_mapping(_with(errors=PINS, start={"run": parent.attrs["id"]}))
    taken = start_wear(parent, scene.start)
    fewer = {name: depths[:2] for name, depths in taken.planet_depth.items()}
    with pytest.raises(Refused, match=r"has 2 planets, this one 3: .* as many planets"):
        simulate(scene.with_start_wear(taken._replace(planet_depth=fewer)))


def test_tolerances_of_nought_let_planets_be_alike():
    errors = {"slow": "frozen", "seed": 3, "planet": {"planet_position": ["0 um"]}}
    parts = build(Scene.from_mapping(_with(errors=errors)))
    assert not parts.gears.planets_are_apart
    assert build(Scene.from_mapping(_with(errors=PINS))).gears.planets_are_apart


def test_cycles_of_planets_are_those_of_loaded_conditions():
    duty = [
        {"torque": "90 N*m", "speed": "1000 rpm", "share": 0.25},
        {"torque": "0 N*m", "speed": "1000 rpm", "share": 0.75},
    ]
    table = _with(errors=PINS, operation={"duty": duty})
    table["wear"]["until"] = {"cycles": 1e5}
    run = simulate(Scene.from_mapping(table)).isel(update=-1)
    of_flank = run["load_cycles"].sel(flank="planet-sun")
    assert run["planet_load_cycles"].values == pytest.approx([float(of_flank)] * 3)
    assert float(of_flank) == pytest.approx(0.25e5 * SUN / PLANET)


@pytest.mark.parametrize("stages", [False, True], ids=["one condition", "a stage"])
def test_the_life_of_the_planet_that_fails_first_is_that_of_the_set(stages):
    """To the bit on Euler's straight steps, too, and in a later stage."""
    sections = _with(errors=PINS)
    sections["wear"]["step"] = {"method": "euler", "threshold": "3 um"}
    if stages:
        first = {"torque": f"{TORQUE} N*m", "speed": "1000 rpm", "cycles": 1e5}
        second = {"torque": f"{1.2 * TORQUE} N*m", "speed": "1000 rpm"}
        sections["operation"] = {"stage": [first, second]}
    data = simulate(Scene.from_mapping(sections))
    assert float(data.planet_life.min()) == float(data.life)

"""Sets that turn into themselves: orbits on a section of the period, or in blocks, against the whole."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from plain_planetary import ANGLES, BREAKS, OFFSET, PERIOD, RIGID, planetary, tables, torsional
from scipy.integrate import solve_ivp

from wearlab.accuracy.steady import steady
from wearlab.dynamics.collocation import joined_steps
from wearlab.dynamics.folded import Unfolded
from wearlab.dynamics.folding import blocks_of
from wearlab.dynamics.period_map import TOUCHING, over_period
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response, step_forces
from wearlab.dynamics.sections import in_sections
from wearlab.dynamics.shooting import Shooting
from wearlab.dynamics.system import System
from wearlab.dynamics.touching import Parted
from wearlab.dynamics.turning import symmetry_of, turned
from wearlab.mesh.stages import StageTables, stage_grid
from wearlab.scene import Scene

KINDS = np.array([0, 3])
"""Meshes of planet 1."""


def turning(system: System) -> System:
    return system._replace(symmetry=symmetry_of(system, ANGLES, OFFSET))


def in_phase(system: System, planets: int = 3) -> System:
    lags = np.repeat(OFFSET[KINDS], planets)
    return system._replace(symmetry=symmetry_of(system, spaced(planets), lags))


def spaced(planets: int) -> np.ndarray:
    return 2.0 * np.pi * np.arange(planets) / planets


def alike(steps: int, mu: float | None = None, amplitude: float = 1e-6) -> StageTables:
    """Meshes with the same error, each a function of its own phase."""
    grid = stage_grid(BREAKS, steps, 4)
    own = 2.0 * np.pi * (grid.phase[..., None] - OFFSET)
    error, rate = amplitude * np.sin(own), amplitude * 2.0 * np.pi * np.cos(own)
    return tables(grid, mu)._replace(error=error, error_rate=rate)


def all_alike(steps: int, planets: int = 3, mu: float | None = None, amplitude: float = 1e-6) -> StageTables:
    """Meshes of each kind that all do what that of planet 1 does."""
    given = alike(steps, mu, amplitude)._asdict()
    own = {name: table for name, table in given.items() if table is not None and name != "width"}
    return StageTables(**given)._replace(
        **{name: np.repeat(table[:, :, KINDS], planets, axis=2) for name, table in own.items()}
    )


def both(system: System, given: StageTables, starts: Any = (None, None)) -> tuple[Response, Response]:
    whole = system._replace(symmetry=None)
    one, other = (
        Periodic().solve(s, given, PERIOD, at) for s, at in zip((system, whole), starts, strict=True)
    )
    return one, other


def agree(one: Response, other: Response, accurate: float, sections: int = 3, turns: float = 1e-6) -> None:
    assert one.sections == sections and other.sections == 1 and one.period == other.period == 1
    size = np.abs(other.state).max(axis=(0, 1))
    assert (np.abs(one.state - other.state) <= accurate * sizes(size)).all()
    np.testing.assert_allclose(np.abs(one.multipliers), np.abs(other.multipliers), atol=turns)
    np.testing.assert_allclose(one.system.load, other.system.load, rtol=1e-7, atol=1e-6)
    assert one.verdict == other.verdict


CASES = [
    pytest.param(planetary(), None, id="eighteen degrees"),
    pytest.param(planetary(carrier_stiffness=1.0), None, id="a free rotation"),
    pytest.param(torsional(), 0.1, id="friction, whose load is found"),
]


@pytest.mark.parametrize(("system", "mu"), CASES)
def test_a_section_tells_the_orbit_of_touching_flanks(system: System, mu: Any) -> None:
    system, given = turning(system), alike(300, mu)
    assert system.symmetry is not None and system.symmetry.sections == 3
    one, other = both(system, given)
    agree(one, other, 1e-6)
    assert (
        one.counts.newton_iterations == 1 and 3 * one.counts.right_hand_sides == other.counts.right_hand_sides
    )
    worn = given._replace(gap=1e-6 * (given.stiffness / given.stiffness.max()) ** 2)
    agree(*both(system, worn, (one, other)), 1e-6)


def test_a_section_tells_the_orbit_of_parting_flanks_cold_and_warm() -> None:
    system, given = turning(planetary()), alike(200)
    ends = given.stiffness < 1.6e8
    one, other = both(system, given._replace(gap=given.gap + 10e-6 * ends))
    assert one.counts.newton_iterations > 1
    agree(one, other, 1e-5)
    agree(*both(system, given._replace(gap=given.gap + 10.1e-6 * ends), (one, other)), 1e-5)


def unfolds(one: Response, other: Response, accurate: float = 1e-8) -> None:
    """Whether the response from blocks is that of the whole set, with its multipliers and its derivative."""
    assert isinstance(one, Unfolded) and not isinstance(other, Unfolded)
    agree(one, other, accurate, sections=1)
    assert one.counts.newton_iterations == other.counts.newton_iterations
    size = sizes(np.abs(other.state).max(axis=(0, 1)))
    found, expected = (given.map_derivative * size / size[:, None] for given in (one, other))
    np.testing.assert_allclose(found, expected, atol=accurate * np.abs(expected).max())
    forces = [np.hstack([step.elastic, step.damping]) for step in map(step_forces, (one, other))]
    np.testing.assert_allclose(*forces, atol=accurate * np.abs(forces[1]).max())
    steps = np.arange(len(one.tables.width))
    seen, wanted = (given.approach.at(steps, 0.3 + 0.0 * steps)[0] for given in (one, other))
    np.testing.assert_allclose(seen, wanted, atol=accurate * np.abs(wanted).max())


def of_planets(planets: int, **changes: Any) -> System:
    return in_phase(planetary(rigid=RIGID._replace(planet_angles=spaced(planets)), **changes), planets)


IN_PHASE = [
    pytest.param(in_phase(torsional()), 3, 0.1, id="friction, whose load is found"),
    pytest.param(of_planets(2), 2, None, id="two planets"),
    pytest.param(of_planets(3), 3, None, id="eighteen degrees"),
    pytest.param(of_planets(4), 4, None, id="four planets"),
    pytest.param(of_planets(5), 5, None, id="five planets"),
    pytest.param(
        of_planets(4, carrier_stiffness=0.0, balanced="carrier"), 4, None, id="a free rotation, balanced"
    ),
]


@pytest.mark.parametrize(("system", "planets", "mu"), IN_PHASE)
def test_planets_in_phase_are_one_planet_and_what_they_do_apart(
    system: System, planets: int, mu: Any
) -> None:
    given = all_alike(steps_for(mu), planets, mu)
    one, other = both(system, given)
    unfolds(one, other)
    worn = given._replace(gap=1e-6 * (given.stiffness / given.stiffness.max()) ** 2)
    warm, cold = both(system, worn, (one, None))
    assert isinstance(warm, Unfolded)
    agree(warm, cold, 1e-6, sections=1)
    stiffer = worn._replace(stiffness=1.004 * given.stiffness)
    warm, cold = both(system, stiffer, (one, None))
    agree(warm, cold, 1e-6, sections=1, turns=1e-3)
    anew = Periodic().solve(system, stiffer, PERIOD)
    for before, after, expected in zip(*map(leading, (one, warm, anew)), strict=True):
        assert abs(after - expected) <= 0.1 * abs(before - expected)


def steps_for(mu: float | None) -> int:
    """Return steps for which the stages of the whole set are as accurate as series of a small block."""
    return 300 if mu is None else 900


def leading(response: Response) -> list[complex]:
    """Return the largest multiplier of each block, above the real axis."""
    assert isinstance(response, Unfolded)
    first = [one.multipliers[0] for one in response.of_blocks]
    return [complex(value.real, abs(value.imag)) for value in first]


@pytest.mark.parametrize(("system", "planets", "mu"), IN_PHASE)
def test_flanks_in_phase_part_where_those_of_the_whole_set_do(system: System, planets: int, mu: Any) -> None:
    given = all_alike(steps_for(mu) - 100, planets, mu)
    given = given._replace(gap=given.gap + 1e-4 * (given.stiffness < 1.6e8))
    one, other = (
        Periodic().held_together(s, given, PERIOD) for s in (system, system._replace(symmetry=None))
    )
    assert isinstance(one, Parted) and isinstance(other, Parted)
    np.testing.assert_allclose(one.state / sizes(other.state), other.state / sizes(other.state), atol=1e-8)
    np.testing.assert_allclose(one.sizes, other.sizes, rtol=1e-6, atol=1e-12)


def test_free_planets_in_phase_whose_loads_balance_are_taken_whole() -> None:
    """No load of unknown size is named: blocks and set would each choose their own."""
    assert not isinstance(both(of_planets(3, carrier_stiffness=1.0), all_alike(300))[0], Unfolded)


def test_planets_tied_to_each_other_are_taken_whole() -> None:
    system = of_planets(3)
    stiffness, own = system.stiffness.copy(), [9 + 3 * planet + 2 for planet in range(3)]
    stiffness[np.ix_(own, own)] += 1e6 * (3.0 * np.eye(3) - 1.0)
    assert blocks_of(system) and not blocks_of(system._replace(stiffness=stiffness))


def integrated(system: System, given: StageTables, lags: np.ndarray, start: np.ndarray, end: float) -> Any:
    """Return the state to which SciPy brings ``start`` at the phase ``end``, over that size of both."""
    grid, n = stage_grid(BREAKS, 600, 4), len(system.load)
    inverse, phase = np.linalg.inv(system.mass), grid.phase

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        step = min(int(np.searchsorted(grid.start, time / PERIOD, side="right")) - 1, len(grid.start) - 1)
        x = (time / PERIOD - phase[step, 0]) / grid.width[step]
        by = np.array([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)])
        k = np.einsum("j,jmp->m", by, given.stiffness[step])
        own = 2.0 * np.pi * (time / PERIOD - lags)
        delta = system.direction @ y[:n] - 1e-6 * np.sin(own)
        speed = system.direction @ y[n:] - 2e-6 * np.pi / PERIOD * np.cos(own)
        force = system.load - (k * delta + system.mesh_damping * speed) @ system.direction
        return np.r_[y[n:], inverse @ (force - system.total_stiffness @ y[:n] - system.total_damping @ y[n:])]

    state = start.copy()
    edges = np.append(BREAKS[BREAKS < end - 1e-9], end) * PERIOD
    for low, high in pairwise(edges):
        inside = (np.nextafter(low, high), np.nextafter(high, low))
        state = solve_ivp(rate, inside, state, method="DOP853", rtol=1e-9, atol=1e-15, max_step=1e-6).y[:, -1]
    return state


def test_scipy_turns_the_start_by_a_section() -> None:
    """Integrated over a third of the mesh period the start of the orbit is turned by a planet's angle."""
    system, given = turning(planetary()), alike(600)
    start = Periodic().solve(system, given, PERIOD).state[0, 0]
    state = integrated(system, given, OFFSET, start, 1.0 / 3.0)
    assert system.symmetry is not None
    ahead = np.kron(np.eye(2), system.symmetry.turn) @ start
    np.testing.assert_allclose(state / sizes(start), ahead / sizes(start), atol=2e-5)


def test_scipy_brings_planets_in_phase_back_to_their_start_and_a_disturbance_where_the_map_does() -> None:
    system, given, lags = in_phase(planetary()), all_alike(600), np.repeat(OFFSET[KINDS], 3)
    found = Periodic().solve(system, given, PERIOD)
    assert isinstance(found, Unfolded)
    start, end = found.state[0, 0], found.state[0, 60]
    scale = sizes(start)
    beside = start + 0.1 * scale * np.random.default_rng(3).standard_normal(len(start))
    state = integrated(system, given, lags, beside, 1.0)
    expected = start + found.map_derivative @ (beside - start)
    np.testing.assert_allclose(state / scale, expected / scale, atol=2e-5)
    assert np.abs((end - start) / scale).max() > 1e-3  # it is no rest


def sizes(state: np.ndarray) -> np.ndarray:
    n = len(state) // 2
    return np.repeat([np.abs(state[:n]).max(), np.abs(state[n:]).max()], n)


@pytest.mark.parametrize("phased", [False, True], ids=["one after another", "in phase"])
@pytest.mark.parametrize("spoil", ["an error", "a stiffness", "a gap"])
def test_meshes_that_differ_are_taken_whole(spoil: str, phased: bool) -> None:
    system, given = (in_phase(planetary()), all_alike(300)) if phased else (turning(planetary()), alike(300))
    tables_of = {"an error": "error", "a stiffness": "stiffness", "a gap": "gap"}
    name = tables_of[spoil]
    table = getattr(given, name).copy()
    table[:, :, 1] += 1e-6 * max(np.abs(table).max(), 1e-6)
    spoilt = given._replace(**{name: table})
    one, other = both(system, spoilt)
    assert one.sections == 1 and not isinstance(one, Unfolded)
    np.testing.assert_array_equal(one.state, other.state)


def test_what_does_not_turn_into_itself_has_no_symmetry() -> None:
    unequal = np.array([0.0, 2.0, 4.2])
    assert symmetry_of(planetary(rigid=RIGID._replace(planet_angles=unequal)), unequal, OFFSET) is None
    some = np.repeat([0.0, 0.2, 0.0], 2)
    assert symmetry_of(planetary(), ANGLES, some) is None
    damped = planetary()
    lopsided = damped._replace(mesh_damping=damped.mesh_damping * np.array([1.0, 1.1, 1.0, 1.0, 1.0, 1.0]))
    assert symmetry_of(lopsided, ANGLES, OFFSET) is None
    heavy = damped.mass.copy()
    heavy[0, 0] *= 1.01  # of the sun along x alone
    assert symmetry_of(damped._replace(mass=heavy), ANGLES, OFFSET) is None


@pytest.mark.parametrize(("planets", "sections"), [(4, 2), (3, 1)], ids=["two and two", "in phase"])
def test_planets_of_one_phase_are_compared_with_each_other(planets: int, sections: int) -> None:
    """Two planets at a time do the same; where the third differs from the first they do not."""
    mesh, some = np.roll(np.arange(planets), -1), np.ones((8, 3, planets, 1))
    given = StageTables(np.full(8, 0.125), some, 0.0 * some, some[..., 0], some[..., 0], None).filled
    assert in_sections(sections, mesh, given)
    gap = given.gap.copy()
    gap[:4, :, 0], gap[4:, :, 1] = 1e-6, 1e-6
    assert not in_sections(sections, mesh, given._replace(gap=gap))


def test_turning_carries_a_vector_of_the_sun_and_numbers_of_planets() -> None:
    names = ("sun.x", "sun.y", "sun.u", "planet-1.u", "planet-2.u", "planet-3.u", "planet-4.u")
    turn = turned(names, np.arange(4) * np.pi / 2, 1)
    np.testing.assert_allclose(turn @ [1, 0, 5, 1, 2, 3, 4], [0, 1, 5, 4, 1, 2, 3], atol=1e-15)
    np.testing.assert_allclose(np.linalg.matrix_power(turn, 4), np.eye(7), atol=1e-15)


@pytest.mark.parametrize(
    ("planets", "sun", "planet", "ring", "sections"),
    [(3, 20, 28, 76, 3), (4, 30, 24, 78, 2), (5, 41, 24, 89, 5), (3, 21, 27, 75, 1)],
    ids=["one after another", "two and two in phase", "five", "in phase"],
)
def test_scenes_have_as_many_sections_as_groups_of_planets(
    planets: int, sun: int, planet: int, ring: int, sections: int
) -> None:
    problem = steady(scene_of(planets, {"sun": sun, "planet": planet, "ring": ring}))
    symmetry = problem.vibration.system.symmetry
    assert symmetry is not None and symmetry.sections == sections
    vibration = replace(problem.with_few_steps(300), method=Periodic(closed=1e-12))
    assert in_sections(sections, symmetry.mesh, vibration.tables(problem.kinds).filled)
    whole = replace(vibration, system=vibration.system._replace(symmetry=None))
    one, other = problem.solve(vibration), problem.solve(whole)
    agree(one, other, 1e-6, sections, 1e-4)  # multipliers of parting flanks are a neighbour's


def scene_of(planets: int, teeth: dict[str, int]) -> Scene:
    gears = {name: {"teeth": count} for name, count in teeth.items()}
    gears["ring"]["rim_diameter"] = "230 mm"
    given = {
        "gears": {
            "kind": "planetary",
            "module": "2.25 mm",
            "face_width": "20 mm",
            "planets": planets,
            **gears,
        },
        "operation": {"torque": "90 N*m", "speed": "1200 rpm"},
        "mesh": {"damping_ratio": 0.05},
        "dynamics": {
            "model": "planetary",
            "supports": {
                name: {"radial_stiffness": f"{radial} N/um", "damping_ratio": 0.03}
                for name, radial in (("sun", 10), ("planet", 58), ("ring", 1000), ("carrier", 195))
            },
        },
    }
    given["gears"]["carrier"] = {"mass": "4.5 kg", "inertia": "11178 kg*mm^2"}
    given["dynamics"]["supports"]["ring"]["tangential_stiffness"] = "57.6 N/um"
    given["dynamics"]["supports"]["carrier"]["tangential_stiffness"] = "10 N/um"
    return Scene.from_mapping(given)


def test_a_section_may_end_between_two_equal_steps() -> None:
    """Steps are made in twos, which is more accurate: the last of an odd number is not the first of two."""
    given = alike(400)
    shooting, ends = Shooting(planetary(), given, PERIOD), []
    odd = 5
    assert joined_steps(given)[:odd].all()
    marcher = shooting.marcher
    for steps in (len(given.width), odd):
        states = np.zeros((steps + 1) * shooting.rows)
        first = StageTables(*(table[:steps] for table in shooting.filled))
        over_period(
            marcher.kernel, first, PERIOD, np.uint64(1), marcher.width, states, 0, marcher.scratch, TOUCHING
        )
        ends.append(states.reshape(-1, shooting.rows)[: odd + 1])
    size = np.abs(ends[0]).max(axis=0)
    assert size.min() > 0.0
    np.testing.assert_allclose(ends[1] / size, ends[0] / size, atol=1e-4)

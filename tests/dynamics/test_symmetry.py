"""Sets that turn into themselves: orbits found on a section of the mesh period, against the whole of it."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from plain_planetary import ANGLES, BREAKS, OFFSET, PERIOD, RIGID, planetary, tables, torsional
from scipy.integrate import solve_ivp

from wearlab.accuracy.steady import steady
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.sections import in_sections
from wearlab.dynamics.system import System
from wearlab.dynamics.turning import symmetry_of, turned
from wearlab.mesh.stages import StageTables, stage_grid
from wearlab.scene import Scene


def turning(system: System) -> System:
    return system._replace(symmetry=symmetry_of(system, ANGLES, OFFSET))


def alike(steps: int, mu: float | None = None, amplitude: float = 1e-6) -> StageTables:
    """Meshes with the same error, each a function of its own phase."""
    grid = stage_grid(BREAKS, steps, 4)
    own = 2.0 * np.pi * (grid.phase[..., None] - OFFSET)
    error, rate = amplitude * np.sin(own), amplitude * 2.0 * np.pi * np.cos(own)
    return tables(grid, mu)._replace(error=error, error_rate=rate)


def both(system: System, given: StageTables, starts: Any = (None, None)) -> tuple[Response, Response]:
    whole = system._replace(symmetry=None)
    one, other = (
        Periodic().solve(s, given, PERIOD, at) for s, at in zip((system, whole), starts, strict=True)
    )
    return one, other


def agree(one: Response, other: Response, accurate: float, sections: int = 3, turns: float = 1e-6) -> None:
    assert one.sections == sections and other.sections == 1 and one.period == other.period == 1
    size = np.abs(other.state).max(axis=(0, 1))
    n = len(size) // 2
    scale = np.repeat([size[:n].max(), size[n:].max()], n)
    assert (np.abs(one.state - other.state) <= accurate * scale).all()
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


def test_scipy_turns_the_start_by_a_section() -> None:
    """Integrated over a third of the mesh period the start of the orbit is turned by a planet's angle."""
    system, grid = turning(planetary()), stage_grid(BREAKS, 600, 4)
    given, n = alike(600), len(system.load)
    start = Periodic().solve(system, given, PERIOD).state[0, 0]
    inverse, phase = np.linalg.inv(system.mass), grid.phase

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        step = min(int(np.searchsorted(grid.start, time / PERIOD, side="right")) - 1, len(grid.start) - 1)
        x = (time / PERIOD - phase[step, 0]) / grid.width[step]
        by = np.array([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)])
        k = np.einsum("j,jmp->m", by, given.stiffness[step])
        own = 2.0 * np.pi * (time / PERIOD - OFFSET)
        delta = system.direction @ y[:n] - 1e-6 * np.sin(own)
        speed = system.direction @ y[n:] - 2e-6 * np.pi / PERIOD * np.cos(own)
        force = system.load - (k * delta + system.mesh_damping * speed) @ system.direction
        return np.r_[y[n:], inverse @ (force - system.total_stiffness @ y[:n] - system.total_damping @ y[n:])]

    state = start.copy()
    edges = np.append(BREAKS[BREAKS < 1.0 / 3.0 - 1e-9], 1.0 / 3.0) * PERIOD
    for low, high in pairwise(edges):
        inside = (np.nextafter(low, high), np.nextafter(high, low))
        state = solve_ivp(rate, inside, state, method="DOP853", rtol=1e-9, atol=1e-15, max_step=1e-6).y[:, -1]
    assert system.symmetry is not None
    ahead = np.kron(np.eye(2), system.symmetry.turn) @ start
    scale = np.repeat([np.abs(start[:n]).max(), np.abs(start[n:]).max()], n)
    np.testing.assert_allclose(state / scale, ahead / scale, atol=2e-5)


@pytest.mark.parametrize("spoil", ["an error", "a stiffness", "a gap"])
def test_meshes_that_differ_are_taken_over_the_whole_period(spoil: str) -> None:
    system, given = turning(planetary()), alike(300)
    tables_of = {"an error": "error", "a stiffness": "stiffness", "a gap": "gap"}
    name = tables_of[spoil]
    table = getattr(given, name).copy()
    table[:, :, 1] += 1e-6 * max(np.abs(table).max(), 1e-6)
    spoilt = given._replace(**{name: table})
    one, other = both(system, spoilt)
    assert one.sections == 1
    np.testing.assert_array_equal(one.state, other.state)


def test_what_does_not_turn_into_itself_has_no_symmetry() -> None:
    unequal = np.array([0.0, 2.0, 4.2])
    assert symmetry_of(planetary(rigid=RIGID._replace(planet_angles=unequal)), unequal, OFFSET) is None
    assert symmetry_of(planetary(), ANGLES, np.zeros(6)) is None  # in phase: all at the same instant
    damped = planetary()
    lopsided = damped._replace(mesh_damping=damped.mesh_damping * np.array([1.0, 1.1, 1.0, 1.0, 1.0, 1.0]))
    assert symmetry_of(lopsided, ANGLES, OFFSET) is None
    heavy = damped.mass.copy()
    heavy[0, 0] *= 1.01  # of the sun along x alone
    assert symmetry_of(damped._replace(mass=heavy), ANGLES, OFFSET) is None


def test_turning_carries_a_vector_of_the_sun_and_numbers_of_planets() -> None:
    names = ("sun.x", "sun.y", "sun.u", "planet-1.u", "planet-2.u", "planet-3.u", "planet-4.u")
    turn = turned(names, np.arange(4) * np.pi / 2, 1)
    np.testing.assert_allclose(turn @ [1, 0, 5, 1, 2, 3, 4], [0, 1, 5, 4, 1, 2, 3], atol=1e-15)
    np.testing.assert_allclose(np.linalg.matrix_power(turn, 4), np.eye(7), atol=1e-15)


@pytest.mark.parametrize(
    ("planets", "sun", "planet", "ring", "sections"),
    [(3, 20, 28, 76, 3), (4, 30, 24, 78, 2), (5, 41, 24, 89, 5)],
    ids=["one after another", "two and two in phase", "five"],
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

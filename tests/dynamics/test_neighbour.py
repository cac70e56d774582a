"""Touching sets found from the factors of a neighbouring case, against solving them anew."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from plain_planetary import BREAKS, PERIOD, planetary, tables, torsional

from wearlab.dynamics.neighbour import CLEAR
from wearlab.dynamics.period_map import TOUCHING_FIRST
from wearlab.dynamics.periodic import BARELY, Periodic
from wearlab.dynamics.response import Response
from wearlab.dynamics.shooting import Shooting
from wearlab.dynamics.system import System
from wearlab.dynamics.touching import Parted, parting, touching_orbit
from wearlab.mesh.stages import StageTables, halved, stage_grid


def orbit(system: System, given: StageTables, near: Response | None = None) -> Response:
    found = touching_orbit(system, given, PERIOD, 1e-3, None if near is None else near.near)
    assert isinstance(found, Response)
    return found


def worn(given: StageTables, share: float = 1e-3) -> StageTables:
    """Gaps of a micrometre in the middle of the path, and a stiffness that has moved by a share."""
    k = given.stiffness
    moved = k * (1.0 + share * np.cos(np.arange(k.shape[2]))[:, None])
    return given._replace(stiffness=moved, gap=1e-6 * (k / k.max()) ** 2)


def cases() -> list[Any]:
    return [
        pytest.param(planetary(), None, 2, id="eighteen degrees, groups of all sizes"),
        pytest.param(torsional(), 0.1, 4, id="friction, whose load is found"),
    ]


@pytest.mark.parametrize(("system", "mu", "multiple"), cases())
def test_the_orbit_found_from_a_neighbour_is_the_orbit(system: System, mu: Any, multiple: int) -> None:
    given = tables(stage_grid(BREAKS, 300, multiple), mu)
    first, other = orbit(system, given), worn(given)
    cold, warm = orbit(system, other), orbit(system, other, first)
    assert warm.near is first.near and cold.near is not first.near and warm.counts.period_maps > 1
    n, d = len(system.load), system.direction.T
    for part, accurate in ((slice(n), 2e-7), (slice(n, None), 2e-6)):
        one, two, three = (case.state[..., part] @ d for case in (first, cold, warm))
        size = np.abs(two).max()
        assert np.abs(two - one).max() > 1e-2 * size
        np.testing.assert_allclose(three, two, atol=accurate * size)
    np.testing.assert_allclose(warm.system.load, cold.system.load, rtol=1e-9, atol=1e-9)
    # A second neighbour starts from the same factors.
    again = orbit(system, given, warm)
    np.testing.assert_allclose(again.state, first.state, atol=1e-10 * np.abs(first.state).max())


@pytest.mark.parametrize(("system", "mu", "multiple"), cases())
def test_leading_multipliers_follow_the_mesh(system: System, mu: Any, multiple: int) -> None:
    """To first order: ten times the change, a hundred times the error."""
    given = tables(stage_grid(BREAKS, 300, multiple), mu)
    first, error = orbit(system, given), []
    for share in (1e-4, 1e-3):
        other = worn(given, share)
        cold, warm = orbit(system, other), orbit(system, other, first)
        change = abs(cold.multipliers[0] - first.multipliers[0])
        error.append(abs(abs(warm.multipliers[0]) - abs(cold.multipliers[0])))
        assert error[-1] < 0.05 * change
        assert abs(warm.multipliers.imag.sum()) < 1e-14
    assert error[1] > 30.0 * error[0]


def test_what_a_neighbour_cannot_speak_for_is_solved_anew() -> None:
    system, given = planetary(), tables(stage_grid(BREAKS, 300, 4))
    first = orbit(system, given)
    jumping = given.stiffness.copy()
    jumping[40:] *= 1.001
    others = {
        "another system": (planetary(torque=95.0), given),
        "far stiffer": (system, worn(given, 0.02)),
        "a jump elsewhere": (system, given._replace(stiffness=jumping)),
    }
    for name, (whose, other) in others.items():
        warm, cold = orbit(whose, other, first), orbit(whose, other)
        assert warm.near is not first.near, name
        np.testing.assert_array_equal(warm.state, cold.state)
    assert first.near is not None
    lively = 1.0 - 0.5 * CLEAR
    near = replace(first.near, derivative=first.near.derivative * lively / abs(first.near.multipliers[0]))
    assert not near.resembles(system, given, PERIOD)


def test_flanks_that_part_next_door_are_left_to_the_general_map() -> None:
    system, given = planetary(), tables(stage_grid(BREAKS, 300, 4))
    first = orbit(system, given)
    apart = given._replace(gap=given.gap + 1e-4 * (given.stiffness < 1.6e8))
    assert isinstance(touching_orbit(system, apart, PERIOD, 1e-3, first.near), Parted)


def test_the_method_starts_from_its_neighbour() -> None:
    system, given = planetary(), tables(stage_grid(BREAKS, 300, 4))
    first = Periodic().solve(system, given, PERIOD)
    warm = Periodic().solve(system, worn(given), PERIOD, first)
    assert warm.near is first.near and warm.verdict.words == ()


def test_flanks_that_touch_beside_a_state_where_they_barely_part_are_found_as_if_cold() -> None:
    system, given = planetary(), tables(stage_grid(BREAKS, 200, 4))

    def relieved(amount: float) -> StageTables:
        return given._replace(gap=given.gap + amount * (given.stiffness < 1.6e8))

    for amount, tried in ((5e-6, True), (10e-6, False)):
        parted = Periodic().solve(system, relieved(amount), PERIOD)
        assert parted.near is None and (parting(parted) <= BARELY) == tried
        cold = Periodic().solve(system, relieved(2e-6), PERIOD)
        warm = Periodic().solve(system, relieved(2e-6), PERIOD, parted)
        assert (warm.counts == cold.counts) == tried
        if tried:
            np.testing.assert_array_equal(warm.state, cold.state)


def test_an_orbit_with_parting_flanks_starts_where_they_were_held_together() -> None:
    """The same orbit as from rest, by a pass less: that of the map of touching flanks."""
    system, given = planetary(), tables(stage_grid(BREAKS, 200, 4))
    apart = given._replace(gap=given.gap + 10e-6 * (given.stiffness < 1.6e8))
    held = touching_orbit(system, apart, PERIOD, 1e-3)
    assert isinstance(held, Parted)
    found = Periodic().solve(system, apart, PERIOD)
    shooting = Shooting(system, halved(apart), PERIOD)
    orbit = shooting.shoot(1, np.zeros(shooting.rows), touch=TOUCHING_FIRST)
    assert orbit is not None
    orbit = shooting.chord(orbit)
    assert orbit is not None and found.counts.newton_iterations == shooting.iterations - 1
    np.testing.assert_allclose(found.state, orbit.state[:, ::2], atol=1e-7 * np.abs(found.state).max())

"""Other attractors: found beside an orbit that never leaves contact, and not where there is none."""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics.coexisting import RELEASES, Search, coexisting
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response, step_forces
from wearlab.dynamics.shooting import Shooting

PAIR = BenchmarkPair()
LIGHT = PAIR._replace(torque=60.0, mesh_damping=300.0, bearing_damping=2000.0, amplitude=8e-6)


def respond(pair: BenchmarkPair, rpm: float, steps: int) -> Response:
    return Periodic().solve(pair.system(), pair.tables(pair.grid(steps)), mesh_period(rpm))


@pytest.mark.parametrize("steps", [40, 200])
def test_period_six_coexists_with_an_orbit_in_full_contact(steps: int) -> None:
    found = respond(LIGHT, 4000.0, steps)
    assert found.period == 1 and abs(found.multipliers[0]) == pytest.approx(0.956, abs=1e-3)
    assert step_forces(found).elastic.min() > 0.0
    search = coexisting(found, Periodic())
    other = search.rival
    assert other is not None and other.period == 6 and abs(other.multipliers[0]) < 1.0
    forces = step_forces(other).elastic
    assert forces.min() == 0.0 and forces.max() > 1.5 * step_forces(found).elastic.max()


def test_other_attractor_is_one() -> None:
    other = coexisting(respond(LIGHT, 4000.0, 100), Periodic()).rival
    assert other is not None
    shooting = Shooting(other.system, other.tables, other.mesh_period)
    strobe, _ = shooting.march(other.state[0, 0] * 1.0001, 600)
    np.testing.assert_allclose(strobe[600, :3], other.state[0, 0, :3], rtol=1e-6)


@pytest.mark.parametrize("rpm", [800.0, 1860.0, 3720.0, 6000.0])
def test_loaded_pair_has_no_other_attractor(rpm: float) -> None:
    search = coexisting(respond(PAIR, rpm, 100), Periodic())
    assert search.rival is None and not search.cut_off
    assert search.starts == len(RELEASES) and search.periods > len(RELEASES)


def test_an_orbit_is_no_rival_of_itself() -> None:
    found = respond(LIGHT, 9750.0, 100)
    assert found.period == 4 and coexisting(found, Periodic()).rival is None


def test_no_search_beside_what_attracts_nothing() -> None:
    aperiodic = respond(LIGHT, 4400.0, 60)
    rattle = respond(PAIR._replace(torque=0.0), 1860.0, 60)
    assert aperiodic.period == 0 and not rattle.verdict.unique
    assert coexisting(aperiodic, Periodic()) == coexisting(rattle, Periodic()) == Search()


@pytest.mark.parametrize("periods", [0, 1, 60, 400, 1000])
def test_a_search_takes_no_more_work_than_allowed(periods: int) -> None:
    found = respond(LIGHT, 4000.0, 40)
    whole = coexisting(found, Periodic())
    steps = len(found.tables.width)
    cut = coexisting(found, Periodic(), periods * steps)
    assert cut.periods <= periods and cut.cut_off == (periods < whole.periods)
    assert cut.starts < whole.starts if cut.cut_off else cut.starts == whole.starts
    assert (cut.rival is None) == cut.cut_off

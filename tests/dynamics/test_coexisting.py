"""Other attractors: found beside an orbit that never leaves contact, and not where
there is none.
"""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from scenes import CAMPAIGNS
from scipy.integrate import solve_ivp

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.dynamics.steady.coexisting import (
    ADDED,
    LONG,
    MAX_RELEASES,
    NEAR,
    RELEASES,
    Attractor,
    Search,
    Tries,
    coexisting,
)
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response, step_forces
from wearlab.dynamics.steady.shooting import Shooting

PAIR = BenchmarkPair()
LIGHT = PAIR._replace(
    torque=60.0, mesh_damping=300.0, bearing_damping=2000.0, amplitude=8e-6
)
EDGES = CAMPAIGNS / "extremes" / "benchmark_edges.toml"


def respond(pair: BenchmarkPair, rpm: float, steps: int) -> Response:
    return Periodic().solve(
        pair.system(), pair.tables(pair.grid(steps)), mesh_period(rpm)
    )


@pytest.mark.parametrize("steps", [40, 200])
def test_another_attractor_beside_an_orbit_in_full_contact(steps: int) -> None:
    response = respond(LIGHT, 4000.0, steps)
    assert response.period == 1 and abs(response.multipliers[0]) == pytest.approx(
        0.956, abs=1e-3
    )
    assert step_forces(response).elastic.min() > 0.0
    rival = coexisting(response, Periodic()).rival
    assert (
        rival is not None
        and rival.verdict.attracting
        and abs(rival.multipliers[0]) < 1.0
    )
    forces = step_forces(rival).elastic
    assert (
        forces.min() <= 0.0 and forces.max() > 1.5 * step_forces(response).elastic.max()
    )


def test_other_attractor_is_one() -> None:
    rival = coexisting(respond(LIGHT, 4000.0, 100), Periodic()).rival
    assert rival is not None
    shooting = Shooting(rival.system, rival.tables, rival.mesh_period)
    strobe, _ = shooting.integrate(rival.state[0, 0] * 1.0001, 600)
    np.testing.assert_allclose(strobe[600, :3], rival.state[0, 0, :3], rtol=1e-6)


def test_other_attractor_closes_by_scipy() -> None:
    rival = coexisting(respond(LIGHT, 4000.0, 400), Periodic()).rival
    assert rival is not None and rival.system.backlash is not None
    system = rival.system
    period = rival.mesh_period
    backlash = float(rival.system.backlash[0])
    (d,) = system.direction

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        phase = time / period % 1.0
        turn = 2.0 * np.pi
        delta = d @ y[:3] - LIGHT.amplitude * np.sin(turn * phase)
        speed = d @ y[3:] - LIGHT.amplitude * turn / period * np.cos(turn * phase)
        touching = max(delta, 0.0) + min(delta + backlash, 0.0)
        force = float(LIGHT.stiffness(np.array(phase), np.array(phase))) * touching
        force += float(system.mesh_damping[0]) * speed
        pushed = (
            system.load
            - system.stiffness @ y[:3]
            - system.total_damping @ y[3:]
            - d * force
        )
        return np.r_[y[3:], np.linalg.solve(system.mass, pushed)]

    end = solve_ivp(
        rate,
        (0.0, rival.period * period),
        rival.state[0, 0],
        method="DOP853",
        rtol=1e-10,
        atol=1e-14,
        max_step=period / 500,
    ).y[:, -1]
    sizes = np.abs(rival.state[:, :, :]).max(axis=(0, 1))
    assert (np.abs(end - rival.state[0, 0]) / sizes).max() < 2e-5


@pytest.mark.parametrize("rpm", [800.0, 1860.0, 3720.0, 6000.0])
def test_loaded_pair_has_no_other_attractor(rpm: float) -> None:
    search = coexisting(respond(PAIR, rpm, 100), Periodic())
    assert search.rival is None and not search.cut_off
    assert search.starts == RELEASES and search.periods > RELEASES


def test_an_orbit_is_no_rival_of_itself() -> None:
    response = respond(LIGHT, 9750.0, 100)
    assert response.period == 4
    assert coexisting(response, Periodic(), tries=Tries(0, 0, response)).rival is None
    rival = coexisting(response, Periodic()).rival
    shooting = Shooting(response.system, response.tables, response.mesh_period)
    assert (
        rival is not None
        and Attractor(response, shooting.rate).distance(rival.state[0, 0]) > NEAR
    )


def test_what_a_neighbour_has_found_is_found_without_a_release() -> None:
    """Twenty revolutions on, the other attractor is a little different.

    Far above it is gone.
    """
    near = coexisting(respond(LIGHT, 4000.0, 100), Periodic()).rival
    assert near is not None
    search = coexisting(
        respond(LIGHT, 4020.0, 100), Periodic(), tries=Tries(0, 0, near)
    )
    assert search.rival is not None and search.starts == 0
    largest = step_forces(search.rival).elastic.max()
    before = step_forces(near).elastic.max()
    assert largest != before and largest == pytest.approx(before, rel=0.05)
    assert (
        coexisting(
            respond(LIGHT, 800.0, 100), Periodic(), tries=Tries(0, 0, near)
        ).rival
        is None
    )


@pytest.mark.parametrize("share", [1e-9, 1e-3])
def test_chance_does_not_decide_whether_one_is_found(share: float) -> None:
    """Transients of this pair are chaotic: releases go on until one
    of many attractors is met.
    """
    (case,) = (
        case for case in load(EDGES).cases if case.label == "stiff, hardly damped"
    )
    parts = build(case.scene)
    vibration = parts.vibration
    state = parts.coupling.evaluate(parts.coupling.unworn())
    assert (
        vibration is not None
        and state.response is not None
        and isinstance(vibration.method, Periodic)
    )
    known = state.response
    system = known.system._replace(damping=known.system.damping * (1.0 + share))
    response = vibration.method.solve(system, known.tables, known.mesh_period, known)
    search = coexisting(response, vibration.method)
    assert search.rival is not None and search.rival.verdict.attracting is not False


def test_long_transients_ask_for_more_releases() -> None:
    """A tenth of its damping lets the loaded pair ring for hundreds of periods, far
    above its resonance.
    """
    ringing = PAIR._replace(
        torque=3000.0, mesh_damping=100.0, bearing_damping=500.0, amplitude=1e-7
    )
    response = respond(ringing, 20000.0, 60)
    search = coexisting(response, Periodic(), 1_000_000, Tries(8, 0))
    assert search.rival is None and not search.cut_off and search.periods > 8 * LONG
    assert 8 < search.starts <= 8 + 8 * ADDED
    assert coexisting(response, Periodic(), 1_000_000).starts < MAX_RELEASES


def test_no_search_beside_what_attracts_nothing() -> None:
    aperiodic = respond(LIGHT, 4400.0, 60)
    rattle = respond(PAIR._replace(torque=0.0), 1860.0, 60)
    assert aperiodic.period == 0 and not rattle.verdict.unique
    assert (
        coexisting(aperiodic, Periodic()) == coexisting(rattle, Periodic()) == Search()
    )


@pytest.mark.parametrize("periods", [0, 1, 60, 400, 1000])
def test_a_search_takes_no_more_work_than_allowed(periods: int) -> None:
    response = respond(LIGHT, 4000.0, 40)
    whole = coexisting(response, Periodic())
    steps = len(response.tables.width)
    cut = coexisting(response, Periodic(), periods * steps)
    assert cut.periods <= periods and cut.cut_off == (periods < whole.periods)
    assert cut.starts < whole.starts if cut.cut_off else cut.starts == whole.starts
    assert (cut.rival is None) == cut.cut_off

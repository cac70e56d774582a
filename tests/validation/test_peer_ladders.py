"""Peers at their best converge to our answer, and their transients
decay as the largest multiplier says.
"""

from dataclasses import replace

import numpy as np
import peer_ladders
import pytest
from best_peers import peers
from peer_ladders import peer_curves
from transient import periods_to, transient

from wearlab.accuracy.reference import Reference, reference, tight_steps
from wearlab.accuracy.steady import steady
from wearlab.dynamics.steady.periodic import Periodic

ONE_OF_EACH = ("SciPy DOP853", "CyRK VERN7, landing", "CyRK VERN7, Newton")


@pytest.fixture(autouse=True)
def untimed(monkeypatch):
    monkeypatch.setattr(
        peer_ladders, "timing", lambda action, **more: (action(), 1e-3)[1]
    )


@pytest.fixture(scope="module")
def known(problem):
    return reference(problem)


def test_peers_converge_to_the_same_answer(problem, known, monkeypatch):
    few = [
        replace(peer, tolerances=(1e-4, 1e-7))
        for peer in peers()
        if peer.name in ONE_OF_EACH
    ]
    monkeypatch.setattr(peer_ladders, "peers", lambda: few)
    monkeypatch.setattr(peer_ladders, "HARMONICS", (20, 80))
    told = []
    curves = list(peer_curves(problem, known, told.append))
    assert told == [*(peer.name for peer in few), "harmonic balance"]
    for curve in curves:
        coarse, fine = curve.rungs
        assert fine.error < (5e-3 if curve.name == "harmonic balance" else 3e-5), (
            curve.name
        )
        assert fine.error < coarse.error, curve.name
    if len(few) < len(ONE_OF_EACH):  # CyRK is not installed
        assert few
        return
    newton = next(c for c in curves if c.name.endswith("Newton"))
    assert all(curve.role == "peer" for curve in curves)
    assert newton.rungs[1].error < 5e-7  # a mesh period repeats to five tolerances
    assert (
        newton.rungs[1].work <= 12
    )  # mesh periods: the derivative of six states, and two or three more


def test_a_march_that_cannot_be_afforded_is_left_out(problem, known, monkeypatch):
    given = peer_ladders.course(problem, known)
    peer = next(peer for peer in peers() if peer.name == "SciPy DOP853")
    found = peer_ladders.rung(given, peer.bind(given.motion), 1e-5)
    assert found.error < 1e-4 and found.seconds == 1e-3
    monkeypatch.setattr(peer_ladders, "AFFORDED", 0.0)
    assert peer_ladders.rung(given, peer.bind(given.motion), 1e-5) is None
    assert not peer_ladders.peer_curve(given, replace(peer, tolerances=(1e-5,))).rungs


def test_a_transient_decays_like_the_largest_multiplier(problem):
    known = reference(problem)
    left = transient(problem, known, 1.1 * known.start)
    count = periods_to(left, 1e-2), periods_to(left, 1e-8)
    assert (count[1] - count[0]) == pytest.approx(
        np.log(1e-6) / np.log(known.multiplier), rel=0.1
    )
    assert np.all(np.diff(left) <= 0.0)


def test_a_transient_of_a_large_system_decays_too(planetary):
    problem = steady(planetary)
    response = problem.solve(problem.with_steps(tight_steps(problem), Periodic()))
    largest = float(np.abs(response.multipliers).max())
    force = problem.force_of(problem.vibration, response)
    known = Reference(force, response.state[0, 0], response, 0.0, largest)
    left = transient(problem, known, 1.1 * known.start)
    count = periods_to(left, 1e-5), periods_to(left, 1e-8)
    assert (count[1] - count[0]) == pytest.approx(
        np.log(1e-3) / np.log(largest), rel=0.2
    )

"""Ladders show the orders that methods have, and choose the cheapest
rung that is good enough.
"""

import numpy as np
import pytest

from wearlab.accuracy import knob_curves, life, life_curves, peer_curves, steady_curves
from wearlab.accuracy.ladder import Rung, WorkPrecision, interpolated, timing
from wearlab.accuracy.reference import reference
from wearlab.accuracy.steady import Steady
from wearlab.accuracy.steady_curves import integrated_curve, steps_curve
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.gears.specification import GearError
from wearlab.life.euler import Euler


@pytest.fixture(autouse=True)
def untimed(monkeypatch):
    def once(action):
        action()
        return 1e-3

    for module in (knob_curves, life, peer_curves, steady_curves):
        monkeypatch.setattr(module, "timing", once)


@pytest.fixture(scope="module")
def known(problem):
    return reference(problem)


def test_the_default_method_is_of_high_order(problem, known):
    """Four orders, until it errs as little as the reference."""
    curve = steps_curve(problem, known, (48, 96, 192))
    first, *others = curve.rungs
    for rung in others:
        least = max(
            first.error * (first.setting / rung.setting) ** 3.5,
            30.0 * known.disagreement,
            1e-8,
        )
        assert rung.error <= least
        assert rung.work > first.work


@pytest.mark.parametrize(("method", "order"), [(RungeKutta4, 4.0), (Newmark, 2.0)])
def test_marched_methods_have_their_order(problem, known, method, order):
    curve = integrated_curve(
        problem, known, "any", (64, 128, 256), lambda left: method(tolerance=left)
    )
    assert curve.order(known.disagreement) == pytest.approx(order, abs=0.25)


def test_peers_converge_to_the_same_answer(problem, known, monkeypatch):
    pytest.importorskip("CyRK")
    monkeypatch.setattr(peer_curves, "PEER_TOLERANCES", (1e-4, 1e-7))
    told = []
    curves = list(peer_curves.peer_curves(problem, known, told.append))
    assert [curve.name for curve in curves] == told == list(peer_curves.peers())
    for curve in curves:
        coarse, fine = curve.rungs
        assert fine.error < 3e-5 and fine.error < coarse.error, curve.name
        assert fine.seconds > 0.0 and curve.role == "peer"


def test_a_march_that_takes_long_or_does_not_settle_is_not_begun(
    problem, known, monkeypatch
):
    assert peer_curves.periods_to(known, 1e-3) == np.ceil(
        np.log(1e-3) / np.log(known.multiplier)
    )
    assert peer_curves.periods_to(known._replace(multiplier=1.01), 1e-3) == np.inf
    assert not list(
        peer_curves.peer_curves(
            problem, known._replace(multiplier=1.01), lambda text: None
        )
    )


def test_a_ladder_ends_where_rungs_take_long_or_tell_nothing(
    problem, known, monkeypatch
):
    def settings(seconds, disagreement):
        monkeypatch.setattr(steady_curves, "timing", lambda action: seconds)
        sure = known._replace(disagreement=disagreement)
        curve = integrated_curve(
            problem,
            sure,
            "any",
            (64, 128, 256),
            lambda left: RungeKutta4(tolerance=left),
        )
        return len(curve.rungs)

    assert settings(1e-3, 1e-10) == 3
    assert settings(99.0, 1e-10) == 1
    assert settings(1e-3, 1e-3) < 3


def test_settings_that_physics_refuses_are_left_out(problem, known, wears, monkeypatch):
    found = problem.with_steps(128)

    def refusing(self, steps, method):
        if steps < 100:
            raise GearError("too few steps")
        return found

    monkeypatch.setattr(Steady, "with_steps", refusing)
    assert len(steps_curve(problem, known, (64, 128)).rungs) == 1

    def refused(wearing, method, tolerance):
        if len(wearing.wear) < 100:
            raise GearError("too few nodes")
        return life.TimedLife(1e6, np.ones(4), np.zeros(4), 1, 1.0)

    monkeypatch.setattr(life_curves, "integrated_life", refused)
    truth = life.TimedLife(2e6, np.ones(4), np.zeros(4), 1, 1.0)
    (curve,) = life_curves._knob_of_life(
        wears, "numerics.profile_points", (41, 61), {}, truth
    )
    assert [rung.setting for rung in curve.rungs] == [61.0]


def test_euler_over_cycles_is_of_first_order_and_lives_agree(wears):
    problem = life.wear_problem(wears)
    known = life.integrated_life(problem, life_curves.adaptive.Adaptive(), 1e-5)
    other = life.second_life(problem, known.cycle)
    assert max(life.errors(known, other)) < 3e-5
    deepest = float(known.depth.max())
    found = [
        (deepest / n, life.integrated_life(problem, Euler(deepest / n), 1e-3))
        for n in (40, 80, 160)
    ]
    curves = {
        c.quantity: c
        for c in life_curves._curves_of(
            "Euler", "threshold", "as published", found, other
        )
    }
    assert curves["life"].order(1e-6) == pytest.approx(1.0, abs=0.1)
    assert [rung.work for rung in curves["life"].rungs] == sorted(
        r.work for r in curves["life"].rungs
    )


def ladder(errors, seconds=(1.0, 2.0, 4.0), settings=(10.0, 20.0, 40.0)):
    rungs = tuple(
        Rung(*values, work=1.0)
        for values in zip(settings, errors, seconds, strict=True)
    )
    return WorkPrecision("ours", "steps_per_period", "mesh_force", "wearlab", rungs)


def test_cheapest_is_the_fastest_rung_from_which_all_finer_ones_are_good():
    assert ladder((1e-2, 1e-4, 1e-6)).cheapest(1e-3)[:4] == (20.0, 1e-4, 2.0, 1.0)
    assert (
        ladder((1e-4, 1e-2, 1e-6)).cheapest(1e-3).setting == 40.0
    )  # the first was luck
    assert (
        ladder((1e-4, 1e-5, 1e-6), seconds=(5.0, 1.0, 4.0)).cheapest(1e-3).setting
        == 20.0
    )
    assert ladder((1e-2, 1e-3, 1e-4)).cheapest(1e-6) is None
    assert ladder((1e-2, np.nan, np.nan)).cheapest(1e-3) is None


def test_order_leaves_out_what_the_reference_cannot_tell():
    curve = ladder((1.6e-2, 1e-3, 1e-3 / 16))
    assert curve.order(0.0) == pytest.approx(4.0)
    assert np.isnan(curve.order(3e-5))  # one slope is no order
    stairs = ladder((1e-2, 9.9e-3, 1e-7), settings=(10.0, 20.0, 40.0))
    assert np.isnan(stairs.order(0.0))  # nor are slopes that have nothing in common
    bends = ladder(
        (1e-2, 1e-2 / 2, 1e-2 / 16, 1e-2 / 128, 1e-2 / 1024),
        (1.0,) * 5,
        (1.0, 2.0, 4.0, 8.0, 16.0),
    )
    assert bends.order(0.0) == pytest.approx(3.0)  # of the finest three: 3, 3, 3
    assert ladder((1e-2, 1e-12, 1e-12)).order(1e-12) != ladder(
        (1e-2, 1e-12, 1e-12)
    ).order(1e-12)  # NaN


def test_costs_are_interpolated_in_logarithms():
    assert interpolated((1e-2, 1e-4), (1.0, 4.0), 1e-3) == pytest.approx(2.0)
    assert interpolated((1e-4, 1e-6), (1.0, 4.0), 1e-3) == 1.0
    assert np.isnan(interpolated((1e-2, 1e-4), (1.0, 4.0), 1e-6))
    assert interpolated((1e-2, np.inf, 1e-4), (1.0, 9.0, 4.0), 1e-3) == pytest.approx(
        2.0
    )


def test_a_time_is_the_median_of_seven_after_a_warm_up():
    calls = []
    found = timing(lambda: calls.append(1), budget=0.0)
    assert found >= 0.0 and len(calls) == 8


@pytest.mark.parametrize("sections", [("",), ("sun_planet", "planet_ring")])
def test_harmonics_of_all_meshes_are_changed_wherever_they_are_written(
    planetary, sections
):
    series = {
        "excitation": {
            "model": "fourier",
            "stiffness_harmonics": 3,
            "error_harmonics": 2,
        }
    }
    written = series if sections == ("",) else dict.fromkeys(sections, series)
    changed = knob_curves.with_harmonics(planetary.replace("mesh", written), 7)
    for one in changed.meshes.values():
        assert (one.excitation.stiffness_harmonics, one.excitation.error_harmonics) == (
            7,
            7,
        )

"""A rate that wavers: what the motion adds to the static rate is held over a step."""

import numpy as np
import pytest

from wearlab.life import stiffness
from wearlab.life.integrate import AccumulatedError, integrate
from wearlab.life.limits import CountedRate, Limits
from wearlab.life.step import Node, Step
from wearlab.life.stiffness import Work, held_step

DEPTH, DEEP, RATE = 4e-4, 1e-4, 1e-11
RELAXES = 5e-6
NOTHING = np.zeros(30)


class Wavering:
    """Wear that evens out, with a drift beside the static rate.

    Beyond a depth dear and noisy.
    """

    def __init__(self, level, seed=1, deep=DEEP):
        self.deep = deep
        self.level, self.noise, self.work = level, 0.0, 0.0
        self.drawn = np.random.default_rng(seed)
        self.along = np.sin(np.linspace(0.0, 6.0, 30))

    def still(self, h):
        return RATE * np.maximum(0.0, 1.0 - (h - h.mean()) / RELAXES)

    def __call__(self, h):
        deep = h.max() > self.deep
        self.work += 100.0 if deep else 1.0
        self.noise = self.level * RATE if deep else 0.0
        rate = self.still(h) + 0.3 * RATE * self.along * h.mean() / DEPTH
        return np.maximum(0.0, rate + self.noise * self.drawn.normal(size=30))


def lived(level, seed=1, max_work=2e4):
    return integrate(
        Wavering(level, seed),
        np.zeros(30),
        limits=Limits(depth=DEPTH),
        max_work=max_work,
    )


@pytest.fixture(scope="module")
def quiet():
    return lived(0.0)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_noise_that_levels_moves_a_life_little_and_within_its_estimate(quiet, seed):
    """With a noise of 20 % in every rate, stages of a long step in
    it, the life was 5 % too short.
    """
    life = lived(0.2, seed)
    assert life.end_reason == "depth"
    off = abs(life.cycle[-1] - quiet.cycle[-1])
    assert off < min(0.01 * quiet.cycle[-1], life.error_estimate_life)


def test_scatter_of_independent_steps_adds_up_by_its_squares(quiet, monkeypatch):
    """A life with twice the noise is twice as doubtful, and far less than if all steps
    were wrong one way. (Where steps follow the noise, they are shorter.)
    """
    monkeypatch.setattr(stiffness, "ROUGH_SHARES", (0.02, 0.02))
    one = lived(0.1).error_estimate_life
    two = lived(0.2).error_estimate_life
    assert one < two < 3.0 * one
    assert two < 0.5 * 0.2 * quiet.cycle[-1]


def test_an_error_has_its_drift_and_its_scatter_node_by_node():
    """Noise moves both ends of a step: its second pass by 1/√2 of what it does to the
    wear. What drifts adds up with its sign, an error that turns cancels.
    """
    drifting = 1e-8 * np.array([1.0, 0.0, 1.0])
    turning = 1e-8 * np.array([0.0, 3.0, 1.0])
    accumulated = AccumulatedError(3, 0.0)
    for k in range(100):
        start = Node(float(k), np.zeros(3), np.zeros(3))
        end = start._replace(cycle=k + 1.0)
        error = drifting + (-1.0) ** k * turning
        slopes = start.rate, end.rate
        accumulated.add(Step(start, end, slopes, error, 1.0, holds=True), 1e-3)

    squares = np.sqrt(2.0 * 100.0 * (drifting**2 + turning**2))
    np.testing.assert_allclose(accumulated.total, 100.0 * drifting, atol=1e-16)
    np.testing.assert_allclose(accumulated.scatter[:2], squares[:2])
    expected = np.hypot(accumulated.total, accumulated.scatter).max()
    assert accumulated.largest[-1] == pytest.approx(expected)

    ordinary = AccumulatedError(3, 0.0)
    ordinary.add(Step(start, end, slopes, np.zeros(3), 1.0), 1e-9)
    np.testing.assert_allclose(ordinary.scatter, 1e-9)


def test_of_short_rough_steps_states_a_fiftieth_of_the_depth_apart_are_stored(quiet):
    """Every accepted one before the rough stretch is among them, and the last; a life
    that is not rough keeps all.
    """
    life = lived(0.2)
    cycle, depth = life.updates()
    smooth = 1 + [step.holds for step in life.steps].index(True)

    assert len(life.cycle) > 2 * len(cycle)
    assert np.array_equal(cycle[:smooth], life.cycle[:smooth])
    assert cycle[-1] == life.cycle[-1]
    well_within = depth[depth.max(axis=1) > 2.0 * DEEP][:-1]
    share = np.diff(well_within, axis=0).max(axis=1) / well_within[1:].max(axis=1)
    assert np.all((share >= 0.02) & (share < 0.05))
    assert np.array_equal(quiet.updates()[0], quiet.cycle)


def test_a_held_step_asks_for_one_dear_rate_and_is_stable_at_any_size():
    rate = Wavering(0.0)
    counted = []

    def dear(h):
        counted.append(h)
        return rate(h)

    start = np.linspace(0.0, 2e-6, 30)
    node = Node(0.0, start, rate(start))
    step, spectrum = held_step(dear, rate.still, node, 1e7, np.empty(0), 1e-9)
    assert len(counted) == 1
    assert spectrum.radius == pytest.approx(RATE / RELAXES, rel=0.05)
    assert step.size * spectrum.radius > 15.0
    assert np.ptp(step.end.depth) < RELAXES


def test_held_steps_converge_in_second_order_and_tell_more_than_their_error():
    rate = Wavering(0.0)

    def end_of(steps):
        node = Node(0.0, np.zeros(30), rate(np.zeros(30)))
        errors = np.zeros(30)
        for _ in range(steps):
            step, _ = held_step(rate, rate.still, node, 2e6 / steps, np.empty(0), 1e-9)
            node = step.end
            errors = errors + step.error
        return node.depth, errors

    (coarse, told) = end_of(32)
    (fine, _) = end_of(64)
    (finest, _) = end_of(256)
    one = np.abs(coarse - finest).max()
    half = np.abs(fine - finest).max()
    assert one / half == pytest.approx(4.0, rel=0.25)
    assert one < np.abs(told).max()


def test_a_step_that_runs_into_a_rough_stretch_is_taken_again_as_a_held_one(quiet):
    """An ordinary first step of 2.7 µm in a stiff, noisy rate was accepted whole,
    wherever it led.
    """
    life = integrate(
        Wavering(0.2, deep=0.0), np.zeros(30), limits=Limits(depth=DEPTH), max_work=2e5
    )
    assert life.end_reason == "depth"
    assert life.depth[1].max() < 0.1e-6
    off = abs(life.cycle[-1] - quiet.cycle[-1])
    assert off < min(0.01 * quiet.cycle[-1], life.error_estimate_life)


def test_steps_grow_where_their_second_pass_moves_little_and_shrink_where_it_does():
    work = Work(CountedRate(Wavering(0.0), 100), Node(0.0, NOTHING, NOTHING), 1e-6)

    def learnt(error, steps):
        end = Node(1.0, np.full(30, 1e-6), NOTHING)
        step = Step(Node(0.0, NOTHING, NOTHING), end, (NOTHING, NOTHING), error, 1.0)
        for _ in range(steps):
            work.learn(step)
        return work.share

    assert learnt(NOTHING, 1) == pytest.approx(1.3 * 0.005)
    assert learnt(NOTHING, 20) == 0.02
    assert learnt(np.full(30, 0.22e-6), 1) == pytest.approx(0.02 / 1.1)
    assert learnt(np.full(30, 1e-6), 20) == 0.002


def test_a_life_out_of_work_far_from_its_end_stops():
    life = integrate(
        Wavering(0.0, deep=0.1 * DEPTH),
        np.zeros(30),
        limits=Limits(depth=DEPTH),
        max_work=300,
    )
    assert life.end_reason == "work limit" and life.cycle[-1] > 0.0

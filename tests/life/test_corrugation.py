"""Flanks whose waves of wear grow, as under the load of the moment
below a mesh's natural frequency.
"""

import numpy as np
import pytest

from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.life.stiffness import growth_rate, random_direction

N = 60
MEAN, GROWTH, TURN, DECAY, SIZE = 5e-11, 1e-5, 3e-5, 1e-5, 1e-6
PLACE = np.arange(N) / N
WAVES = np.sqrt(2.0 / N) * np.stack(
    [np.cos(12 * np.pi * PLACE), np.sin(12 * np.pi * PLACE)]
)


def corrugating(growth=GROWTH, turn=TURN):
    """Waves that turn and grow from an uneven load until they are SIZE high.

    The rest is levelled.
    """
    uneven = 0.02 * MEAN * (1.0 + WAVES[0] * np.sqrt(N))

    def rate(h):
        level = h - h.mean()
        a = WAVES @ level
        held = growth * (1.0 - (a @ a) / (0.5 * N * SIZE**2))
        pulled = np.array([held * a[0] - turn * a[1], turn * a[0] + held * a[1]])
        return np.maximum(
            0.0, MEAN + uneven + pulled @ WAVES - DECAY * (level - a @ WAVES)
        )

    return rate


def linear(J):
    return lambda h: 1e-11 + J @ h


@pytest.mark.parametrize(
    ("growth", "turn"), [(1e-5, 3e-5), (2e-6, 1.5e-5), (1e-5, 0.0)]
)
def test_growth_is_the_largest_real_part_whatever_decays_faster(growth, turn):
    rng = np.random.default_rng(3)
    J = np.diag(-np.linspace(0.0, 3e-5, N)) + 1e-7 * rng.normal(size=(N, N)) / np.sqrt(
        N
    )
    block = np.array([[growth, -turn], [turn, growth]])
    J += WAVES.T @ (block - WAVES @ J @ WAVES.T) @ WAVES
    exact = np.linalg.eigvals(J).real.max()
    found = growth_rate(
        linear(J),
        np.zeros(N),
        random_direction(np.ones(N)),
        amplitude=1e-9,
        iterations=30,
    )
    assert found == pytest.approx(exact, rel=0.2, abs=0.0)


def test_what_decays_without_symmetry_does_not_grow():
    """All values are −1e-5, but those of a small Krylov space lie
    beyond zero: they are no eigenvalues.
    """
    J = 1e-5 * (
        3.0 * np.diag(np.random.default_rng(0).uniform(size=N - 1), 1) - np.eye(N)
    )
    found = growth_rate(
        linear(J), np.zeros(N), random_direction(np.ones(N)), amplitude=1e-9
    )
    assert found == 0.0


def test_a_life_with_growing_waves_ends_and_says_so():
    """Eighty e-foldings: to follow every wave to the tolerance takes more than twice
    the rates.

    What is stepped over is chance: 1e-21 m of initial wear move the last waves between
    0.6 and 1 of SIZE.
    """
    life = integrate(
        corrugating(), np.zeros(N), limits=Limits(depth=400e-6), max_evaluations=1_500
    )
    assert life.end_reason == "depth"
    assert life.wave_growth == pytest.approx(GROWTH, rel=0.2, abs=0.0)
    assert life.cycle[-1] == pytest.approx((400e-6 - SIZE) / (1.02 * MEAN), rel=2e-3)
    uneven = life.depth[-1] - life.depth[-1].mean()
    assert 0.3 * SIZE < np.abs(uneven).max() < 1.05 * SIZE


def test_a_short_life_follows_its_waves():
    life = integrate(
        corrugating(), np.zeros(N), limits=Limits(depth=10e-6), max_evaluations=2_500
    )
    strict = integrate(
        corrugating(), np.zeros(N), limits=Limits(depth=10e-6), tolerance=1e-5
    )
    assert life.wave_growth == 0.0
    assert life.cycle[-1] == pytest.approx(strict.cycle[-1], rel=1e-3)


def test_waves_that_decay_are_not_flagged():
    life = integrate(
        corrugating(growth=-1e-5), np.zeros(N), limits=Limits(depth=150e-6)
    )
    assert life.wave_growth == 0.0 and life.end_reason == "depth"

"""The third-order step: its order, its estimate, and what a life to a tolerance takes with it."""

import numpy as np
import pytest

from wearlab.life import embedded
from wearlab.life.limits import Limits
from wearlab.life.march import evolve


def decaying(h):
    """Return the rate of ``h = 1 − exp(−t)`` and of ``h = 2 − 2 exp(−t/2)``."""
    return np.array([1.0, 1.0]) - np.array([1.0, 0.5]) * h


def after(size):
    end, rate, error = embedded.step(decaying, np.zeros(2), decaying(np.zeros(2)), size, 1.0)
    exact = np.array([-np.expm1(-size), -2.0 * np.expm1(-0.5 * size)])
    np.testing.assert_array_equal(rate, decaying(end))
    return np.abs(end - exact), np.abs(error)


def test_local_error_is_of_fourth_order():
    coarse, fine = after(0.2)[0], after(0.1)[0]
    np.testing.assert_allclose(coarse / fine, 16.0, rtol=0.1)


@pytest.mark.parametrize("size", [0.15, 0.4, 1.0])
def test_estimate_is_the_error_of_the_fastest_wave_and_bounds_that_of_others(size):
    true, told = after(size)
    assert told[0] == pytest.approx(true[0], rel=0.6)
    assert told[0] > 0.9 * true[0] and told[1] > 1.5 * true[1]


def test_a_kink_is_not_explained_away():
    """Where the rate has a kink no order is reached, and the estimate must not count on one."""

    def kinked(h):
        return np.where(h < 0.05, 1.0, 0.5)

    end, _, error = embedded.step(kinked, np.zeros(1), np.ones(1), 0.1, 1e-3)
    assert abs(end[0] - 0.075) < 12.0 * abs(error[0])


def test_a_mild_life_takes_a_fraction_of_the_rates_that_euler_takes():
    def rate(h):
        return 1e-13 / (1.0 + h / 2e-5)

    life = evolve(rate, np.zeros(1), limits=Limits(depth=1e-5), tolerance=1e-3, scale=1e-8)
    exact = (1e-5 + 1e-10 / 4e-5) / 1e-13
    error = abs(life.cycle[-1] / exact - 1.0)
    assert error < 3e-4
    assert life.count_rate_evaluations < 0.02 / max(error, 1e-5)  # Euler: 0.2 / error

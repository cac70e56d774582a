"""The fourth-order step: its order, its estimate, and what a life to
a tolerance takes with it.
"""

import numpy as np
import pytest

from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.life.runge_kutta import fourth_order_error, fourth_order_step


def decaying(h):
    """Return the rate of ``h = 1 − exp(−t)`` and of ``h = 2 − 2 exp(−t/2)``."""
    return np.array([1.0, 1.0]) - np.array([1.0, 0.5]) * h


def stepped(rate, h, size, radius):
    """Return depth, rate, estimated error, and the decay that the stages saw."""
    end, last, difference, seen = fourth_order_step(rate, h, rate(h), size)
    return end, last, fourth_order_error(difference, size * radius), seen


def after(size):
    end, rate, error, _ = stepped(decaying, np.zeros(2), size, 1.0)
    exact = np.array([-np.expm1(-size), -2.0 * np.expm1(-0.5 * size)])
    np.testing.assert_array_equal(rate, decaying(end))
    return np.abs(end - exact), np.abs(error)


def test_local_error_is_of_fifth_order():
    coarse = after(0.2)[0]
    fine = after(0.1)[0]
    np.testing.assert_allclose(coarse / fine, 32.0, rtol=0.1)


def test_the_companion_is_of_third_order_where_the_rate_is_not_linear():
    """Orders of both against the closed form of h' = 1 + h², tan N: a wrong weight
    lowers one of them.
    """

    def rate(h):
        return 1.0 + h**2

    errors = []
    for size in (0.04, 0.02):
        h = np.full(1, np.tan(0.3))
        end, _, difference, _ = fourth_order_step(rate, h, rate(h), size)
        exact = np.tan(0.3 + size)
        errors.append([abs(end[0] - exact), abs(end[0] + difference[0] - exact)])
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders, [5.0, 4.0], atol=0.15)


@pytest.mark.parametrize("size", [0.15, 0.4, 1.0])
def test_estimate_bounds_the_error_of_the_fastest_wave_and_of_others(size):
    true, told = after(size)
    assert 1.5 * true[0] < told[0] < 5.0 * true[0] and told[1] > 1.5 * true[1]


@pytest.mark.parametrize("place", [0.01, 0.2, 0.4, 0.6, 0.7, 0.95])
def test_a_jump_anywhere_in_the_step_is_not_explained_away(place):
    """No order is reached, and the estimate must not count on one.

    A little before the end hides half.
    """

    def jumping(h):
        return np.where(h < 0.1 * place, 1.0, 0.5)

    end, _, error, _ = stepped(jumping, np.zeros(1), 0.1, 1e-3)
    exact = 0.1 * place + 0.5 * 0.1 * (1.0 - place)
    assert abs(end[0] - exact) < 30.0 * abs(error[0])


def test_stages_see_the_fastest_decay_and_no_noise():
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(12, 12)))[0]
    decay = np.linspace(0.05, 1.0, 12)

    def rate(h):
        return np.ones(12) - turn @ (decay * (turn.T @ h))

    seen = stepped(rate, np.zeros(12), 0.1, 0.0)[3]
    assert 0.7 < seen <= 1.0 + 1e-9
    assert (
        stepped(lambda h: 1.0 + 1e-9 * rng.normal(size=12), np.zeros(12), 0.1, 0.0)[3]
        == 0.0
    )


def test_a_mild_life_takes_a_fraction_of_the_rates_that_euler_takes():
    def rate(h):
        return 1e-13 / (1.0 + h / 2e-5)

    life = integrate(
        rate, np.zeros(1), limits=Limits(depth=1e-5), tolerance=1e-3, scale=1e-8
    )
    exact = (1e-5 + 1e-10 / 4e-5) / 1e-13
    error = abs(life.cycle[-1] / exact - 1.0)
    assert error < 3e-4
    assert life.count_rate_evaluations < 0.02 / max(error, 1e-5)  # Euler: 0.2 / error


def test_stages_never_refill_a_flank():
    start = np.full(1, 1.0)
    lowest = []

    def braking(h):
        lowest.append(h[0])
        return np.exp(-1e3 * (h - 1.0))

    stepped(braking, start, 1.0, 0.0)
    assert min(lowest) == 1.0

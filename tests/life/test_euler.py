import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wearlab.life.euler import Euler, Fixed, stability_limit, zigzag
from wearlab.life.integrate import integrate
from wearlab.life.limits import CountedRate, Limits
from wearlab.life.step import Node


def limit_from_eigenvalues(rate):
    probe, shift = 1e-10, 1e-10
    at = np.full(rate.n, shift)
    columns = [(rate(at + probe * e) - rate(at)) / probe for e in np.eye(rate.n)]
    return 2.0 / np.abs(np.linalg.eigvals(np.array(columns).T)).max()


@pytest.mark.parametrize("name", ["Sharing", "LineContact"])
def test_stability_limit_against_eigenvalues(toys, name):
    rate = getattr(toys, name)()
    h0 = np.zeros(rate.n)
    found = stability_limit(Node(0.0, h0, rate(h0)), CountedRate(rate, 100), 1e-7)
    assert found == pytest.approx(limit_from_eigenvalues(rate), rel=0.01, abs=0.0)


@pytest.mark.parametrize("name", ["Sharing", "LineContact"])
def test_fixed_step_smooth_below_the_limit_and_saw_tooth_above(toys, name):
    """NUMERICS §5 row 15."""
    rate = getattr(toys, name)()
    limits = Limits(cycles=40.0 * limit_from_eigenvalues(rate))
    below = integrate(
        rate, np.zeros(rate.n), limits=limits, method=Fixed(stability=0.9), scale=1e-7
    )
    assert below.end_reason == "cycles"
    assert not below.saw_tooth
    assert zigzag(below.rate[-1]) < 0.05
    above = integrate(
        rate, np.zeros(rate.n), limits=limits, method=Fixed(stability=1.5), scale=1e-7
    )
    assert above.end_reason == "saw-tooth"
    assert above.saw_tooth
    assert above.count_rejected == 1
    assert above.cycle[-1] < limits.cycles / 2


def test_fixed_size_is_the_size_and_lands_exactly(toys):
    rate = toys.Braking()
    life = integrate(rate, [0.0], limits=Limits(cycles=1.05e6), method=Fixed(size=1e5))
    assert np.diff(life.cycle)[:-1] == pytest.approx(1e5, rel=1e-6, abs=0.0)
    assert life.cycle[-1] == 1.05e6
    with pytest.raises(ValueError, match="fixed step"):
        integrate(rate, [0.0], limits=Limits(cycles=1.0), method=Fixed())


def test_threshold_is_the_wear_of_every_step(toys):
    rate = toys.Sharing()
    life = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=4e7), method=Euler(1e-7)
    )
    assert np.diff(life.depth, axis=0)[:-1].max(axis=1) == pytest.approx(
        1e-7, rel=1e-9, abs=0.0
    )
    assert life.count_rate_evaluations == life.count_steps + 1


def test_first_order_and_estimate_of_the_right_size(toys):
    rate = toys.Braking()
    errors = []
    estimates = []
    for threshold in (1e-6, 5e-7, 2.5e-7):
        life = integrate(
            rate, [0.0], limits=Limits(depth=2e-5), method=Euler(threshold)
        )
        errors.append(rate.life(2e-5) - life.cycle[-1])
        estimates.append(life.error_estimate_life)
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(1.0, abs=0.1)
    assert errors[0] > 0.0  # Euler holds the early, faster wear: life too short
    assert np.all(np.array(estimates) > errors)
    assert np.all(np.array(estimates) < 2.5 * np.array(errors))


def test_deep_thresholds_saw_and_go_on_as_published(toys):
    rate = toys.LineContact()
    exact = solve_ivp(
        lambda _, y: rate(y),
        (0, 4e6),
        np.zeros(rate.n),
        method="Radau",
        rtol=1e-7,
        atol=1e-16,
    ).y[:, -1]
    fine = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=4e6), method=Euler(5e-8)
    )
    coarse = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=4e6), method=Euler(5e-7)
    )
    assert not fine.saw_tooth
    assert coarse.saw_tooth
    assert coarse.end_reason == "cycles"
    assert (
        np.abs(fine.depth[-1] - exact).max()
        < 0.01 * exact.max()
        < np.abs(coarse.depth[-1] - exact).max()
    )
    with pytest.raises(ValueError, match="threshold"):
        integrate(rate, np.zeros(rate.n), limits=Limits(cycles=4e6), method=Euler(0.0))

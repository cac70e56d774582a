import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wearlab.life import stiffness
from wearlab.life.euler import zigzag
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits


def reference(rate, cycles):
    result = solve_ivp(
        lambda _, y: rate(y),
        (0, cycles),
        np.zeros(rate.n),
        method="Radau",
        rtol=1e-8,
        atol=1e-17,
    )
    rate.count = 0
    return result.y[:, -1]


@pytest.mark.parametrize(
    ("name", "cycles"), [("Sharing", 4e7), ("Sharing", 4e8), ("LineContact", 4e6)]
)
def test_tolerance_bounds_the_error_and_the_estimate_covers_it(toys, name, cycles):
    rate = getattr(toys, name)()
    exact = reference(rate, cycles)
    for tolerance in (1e-2, 1e-3, 1e-4):
        life = integrate(
            rate,
            np.zeros(rate.n),
            limits=Limits(cycles=cycles),
            tolerance=tolerance,
            scale=1e-7,
        )
        error = np.abs(life.depth[-1] - exact).max()
        assert life.end_reason == "cycles"
        assert life.cycle[-1] == cycles
        assert error < tolerance * exact.max()
        assert 0.5 * error < life.accumulated_error[-1] < 2.0 * tolerance * exact.max()


def test_estimate_is_not_idle(toys):
    rate = toys.Sharing()
    exact = reference(rate, 4e7)
    life = integrate(rate, np.zeros(rate.n), limits=Limits(cycles=4e7), scale=1e-7)
    assert life.accumulated_error[-1] < 20.0 * np.abs(life.depth[-1] - exact).max()


def test_error_falls_with_tolerance_as_second_order_promises(toys):
    rate = toys.LineContact()
    exact = reference(rate, 2e6)
    found = []
    for tolerance in (1e-2, 1e-4):
        life = integrate(
            rate,
            np.zeros(rate.n),
            limits=Limits(cycles=2e6),
            tolerance=tolerance,
            scale=1e-7,
        )
        found.append(
            (life.count_rate_evaluations, np.abs(life.depth[-1] - exact).max())
        )
    (few, large), (many, small) = found
    assert small < large / 10.0
    assert (
        many < 12 * few
    )  # a hundredfold tolerance: ten times the steps at order two, 100 at order one


def test_far_beyond_the_euler_limit_without_saw_tooth_and_cheaper(toys):
    rate = toys.LineContact()
    cycles, euler_limit = 4e7, 2.26e5
    life = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=cycles), tolerance=1e-2, scale=1e-7
    )
    assert np.diff(life.cycle).max() > 10.0 * euler_limit
    assert life.count_rate_evaluations < cycles / euler_limit
    assert not life.saw_tooth
    assert zigzag(life.rate[-1]) < 0.02


def test_constant_rate_is_static_archard(toys):
    wear = 1e-13 * np.abs(np.linspace(-1.0, 1.0, 30))
    life = integrate(lambda h: wear, np.zeros(30), limits=Limits(cycles=1e8))
    assert life.depth[-1] == pytest.approx(1e8 * wear, rel=1e-13, abs=0.0)
    assert life.count_steps < 6
    assert life.accumulated_error[-1] <= 1e-12 * life.depth[-1].max()


def test_depth_never_falls_and_is_never_negative(toys):
    rate = toys.LineContact()
    life = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=4e7), tolerance=3e-2, scale=1e-7
    )
    assert np.diff(life.depth, axis=0).min() >= 0.0


def test_the_two_methods_do_not_take_turns_in_vain(toys):
    """Where RKC2 can take no longer steps than the fourth order, it
    is left alone for a while.
    """
    rate = toys.LineContact()
    life = integrate(
        rate, np.zeros(rate.n), limits=Limits(cycles=4e7), tolerance=1e-3, scale=1e-7
    )
    assert (
        life.count_rejected < 8 and life.count_rate_evaluations < 350
    )  # else 13 and 450


def whirling(a, b):
    """Steady wear with a stiff deviation of three nodes whose eigenvalues are −a ± ib,
    driven off centre.
    """
    turn = (np.roll(np.eye(3), 1, axis=0) - np.roll(np.eye(3), -1, axis=0)) / np.sqrt(
        3.0
    )
    J = -a * (np.eye(3) - 1.0 / 3.0) + b * turn
    drive = 3e-13 * np.array([1.0, 0.0, -1.0])

    def rate(h):
        return 1e-12 / (1.0 + h.mean() / 2e-5) + J @ h + drive

    return rate


def test_complex_spectrum_stays_accurate_and_affordable():
    rate = whirling(3e-5, 1e-5)
    cycles = 3e7
    exact = solve_ivp(
        lambda _, y: rate(y),
        (0, cycles),
        np.zeros(3),
        method="Radau",
        rtol=1e-9,
        atol=1e-17,
    )
    life = integrate(
        rate, np.zeros(3), limits=Limits(cycles=cycles), tolerance=1e-3, scale=1e-8
    )
    assert np.abs(life.depth[-1] - exact.y[:, -1]).max() < 1e-3 * exact.y[:, -1].max()
    assert life.count_rate_evaluations < 750  # sharp damping needs 960


def test_accelerating_wear_amplifies_what_went_before():
    """r = r0 + λ h grows e-fold 4 times: an early error does too, and
    the estimate knows.
    """
    r0, growing, cycles = 1e-12, 4e-8, 1e8

    def rate(h):
        return r0 + growing * h

    life = integrate(rate, np.zeros(1), limits=Limits(cycles=cycles), tolerance=1e-3)
    exact = r0 / growing * np.expm1(growing * cycles)
    error = abs(life.depth[-1, 0] - exact)
    assert error < life.accumulated_error[-1] < 6.0 * error
    assert error < 1e-2 * exact


def test_branches_do_not_leak_through_rejected_tries():
    """A rate that remembers the deepest call: left there by a rejected try, it would
    wear too fast.
    """

    class Leaky:
        def __init__(self):
            self.deepest = 0.0

        def __call__(self, h):
            self.deepest = max(self.deepest, float(h[0]))
            return np.full(1, 1e-12 / (1.0 + (self.deepest / 1e-6) ** 2))

        def remember(self):
            return self.deepest

        def recall(self, memory):
            self.deepest = memory

    def honest(h):
        return 1e-12 / (1.0 + (h / 1e-6) ** 2)

    limits = Limits(depth=1e-5)
    leaky, plain = (
        integrate(rate, np.zeros(1), limits=limits) for rate in (Leaky(), honest)
    )
    assert plain.count_rejected > 0
    assert leaky.cycle[-1] == pytest.approx(plain.cycle[-1], rel=2e-3)
    exact = (1e-5 + 1e-5**3 / (3 * 1e-12)) / 1e-12
    assert plain.cycle[-1] == pytest.approx(exact, rel=1e-3)


def looked_at(monkeypatch):
    """Return the list that grows with every look at the spectrum."""
    looks = []
    original = stiffness.spectrum

    def look(rate, h, *arguments, **options):
        looks.append(float(h.max()))
        return original(rate, h, *arguments, **options)

    monkeypatch.setattr(stiffness, "spectrum", look)
    return looks


def test_a_short_mild_life_takes_two_steps_and_no_look_at_the_spectrum(
    toys, monkeypatch
):
    looks = looked_at(monkeypatch)
    rate = toys.Braking(length=2e-5)
    life = integrate(rate, [0.0], limits=Limits(depth=1e-5), tolerance=1e-2)
    assert (life.count_steps, life.count_rate_evaluations, looks) == (2, 10, [])
    assert life.cycle[-1] == pytest.approx(rate.life(1e-5), rel=1e-3)


def test_a_long_way_is_worth_a_look_as_soon_as_a_step_tells(toys, monkeypatch):
    looks = looked_at(monkeypatch)
    rate = toys.Sharing()
    integrate(rate, np.zeros(rate.n), limits=Limits(cycles=4e8), scale=1e-7)
    assert 0.0 < looks[0] < 1e-6 and 1 <= len(looks) < 8


def test_no_short_step_is_left_for_the_end(toys):
    rate = toys.Braking(length=5e-5)
    for cycles in np.geomspace(3e6, 3e8, 7):
        life = integrate(
            rate, [0.0], limits=Limits(cycles=float(cycles)), tolerance=1e-3
        )
        sizes = np.diff(life.cycle)
        assert len(sizes) == 1 or sizes[-1] > 0.3 * sizes.max()
        assert life.depth[-1, 0] == pytest.approx(rate.depth(cycles), rel=1e-3)


def test_the_trend_of_the_rate_says_where_the_limit_is_met(toys):
    """Braked wear passes the limit later than its rate says: the last
    step lands just beyond.
    """
    for length in (3e-6, 1e-5, 3e-5):
        rate = toys.Braking(length=length)
        life = integrate(rate, [0.0], limits=Limits(depth=1.2e-5), tolerance=3e-2)
        sizes = np.diff(life.cycle)
        assert len(sizes) == 1 or sizes[-1] > 0.25 * sizes[-2]

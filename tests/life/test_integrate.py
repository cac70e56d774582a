import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearlab.life.adaptive import Adaptive
from wearlab.life.euler import Euler, Fixed
from wearlab.life.history import worn
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits, Snapshots, StopWear
from wearlab.life.step import Node, Step, depth_at

METHODS = [Adaptive(), Euler(2e-7), Fixed(size=1e6)]


def test_life_at_a_depth_against_the_closed_form(toys):
    rate = toys.Braking()
    for tolerance in (1e-2, 1e-3, 1e-4):
        life = integrate(rate, [0.0], limits=Limits(depth=4e-4), tolerance=tolerance)
        error = abs(life.cycle[-1] - rate.life(4e-4))
        assert life.end_reason == "depth"
        assert life.depth[-1].max() == 4e-4
        assert error < tolerance * rate.life(4e-4)
        assert error < life.error_estimate_life < 3.0 * tolerance * rate.life(4e-4)


def test_depth_limit_looks_at_its_flank_only(toys):
    rate = toys.Sharing()
    flank = slice(rate.n // 3, 2 * rate.n // 3)
    life = integrate(
        rate, np.zeros(rate.n), limits=Limits(depth=5e-6, flank=flank), scale=1e-7
    )
    assert life.depth[-1][flank].max() == 5e-6
    assert life.depth[-1].max() > 5e-6


@pytest.mark.parametrize("method", METHODS)
def test_first_limit_counts(toys, method):
    rate = toys.Braking()
    by_depth = integrate(
        rate, [0.0], limits=Limits(cycles=1e9, depth=1e-5), method=method
    )
    by_cycles = integrate(
        rate, [0.0], limits=Limits(cycles=1e6, depth=1e-3), method=method
    )
    assert (by_depth.end_reason, by_cycles.end_reason) == ("depth", "cycles")
    assert by_depth.depth[-1, 0] == 1e-5
    assert by_cycles.cycle[-1] == 1e6


@pytest.mark.parametrize("method", METHODS)
def test_snapshots_change_nothing_bit_for_bit(toys, method):
    rate = toys.Sharing()
    limits = Limits(depth=4e-6)
    wanted = Snapshots(cycles=(0.0, 1.2345e6, 9.9e6, 1e99), depths=(1e-6, 3e-6))
    plain = integrate(rate, np.zeros(rate.n), limits=limits, method=method, scale=1e-7)
    asked = integrate(
        rate,
        np.zeros(rate.n),
        limits=limits,
        method=method,
        scale=1e-7,
        snapshots=wanted,
    )
    for name in ("cycle", "depth", "rate", "accumulated_error"):
        assert np.array_equal(getattr(plain, name), getattr(asked, name))
    assert np.array_equal(
        [step.error for step in plain.steps], [step.error for step in asked.steps]
    )
    assert plain.count_rate_evaluations == asked.count_rate_evaluations
    assert np.all(np.diff(asked.snapshot_cycle) > 0.0)
    assert len(asked.snapshot_cycle) == 5
    cycle, depth = asked.updates()
    assert (len(cycle), cycle[0], cycle[-1]) == (6, 0.0, plain.cycle[-1])
    assert np.array_equal(depth[-1], plain.depth[-1])
    assert np.array_equal(plain.updates()[0], plain.cycle)


def test_snapshots_are_as_exact_as_the_life(toys):
    rate = toys.Braking()
    wanted = Snapshots(cycles=(1e6, 7e6, 1.23e8), depths=(1e-6, 1e-5, 1e-4))
    life = integrate(
        rate, [0.0], limits=Limits(depth=2e-4), tolerance=1e-4, snapshots=wanted
    )
    assert life.snapshot_depth[:, 0] == pytest.approx(
        rate.depth(life.snapshot_cycle), rel=2e-4, abs=0.0
    )
    for depth in wanted.depths:
        assert np.abs(life.snapshot_depth[:, 0] / depth - 1.0).min() < 1e-12


def test_snapshot_on_a_limit_is_the_end_itself(toys):
    rate = toys.Braking()
    life = integrate(
        rate, [0.0], limits=Limits(cycles=1e7), snapshots=Snapshots(cycles=(1e7,))
    )
    assert np.array_equal(life.snapshot_depth[0], life.depth[-1])
    assert len(life.updates()[0]) == 2


@settings(max_examples=60, deadline=None)
@given(rise=st.floats(0, 1e-3), left=st.floats(0, 1e-2), right=st.floats(0, 1e-2))
def test_dense_output_never_falls_and_meets_its_ends(rise, left, right):
    a = np.array([1e-6])
    b = np.array([1e-6 + rise])
    step = Step(
        Node(3.0, a, a), Node(10.0, b, b), (np.array([left]), np.array([right])), a, 1.0
    )
    curve = np.array([depth_at(step, cycle)[0] for cycle in np.linspace(3.0, 10.0, 41)])
    assert (curve[0], curve[-1]) == (a[0], b[0])
    assert np.diff(curve).min() >= -1e-18


def test_dense_output_is_a_cubic_where_it_may_be():
    def h(n):
        return 1.0 + n + 0.3 * n**2 + 0.1 * n**3

    def slope(n):
        return 1.0 + 0.6 * n + 0.3 * n**2

    node = [Node(n, np.array([h(n)]), np.array([slope(n)])) for n in (1.0, 2.0)]
    step = Step(*node, (node[0].rate, node[1].rate), node[0].rate, 1.0)
    assert depth_at(step, 1.3)[0] == pytest.approx(h(1.3), rel=1e-14, abs=0.0)


def test_gears_that_cannot_run_end_the_life_where_they_stop(toys):
    """NUMERICS §5 row 16: everything before is kept."""
    rate = toys.Braking()

    def until_thin(h):
        if h.max() > 3e-5:
            raise StopWear("section vanished", "the tooth is 0 mm thick")
        return rate(h)

    for method in METHODS:
        life = integrate(until_thin, [0.0], limits=Limits(cycles=1e12), method=method)
        assert life.end_reason == "section vanished"
        assert life.end_detail == "the tooth is 0 mm thick"
        assert 3e-5 * (1 - 3e-3) < life.depth[-1].max() <= 3e-5
        assert life.cycle[-1] == pytest.approx(
            rate.life(life.depth[-1, 0]), rel=2e-2, abs=0.0
        )
        assert life.count_rate_evaluations < 600
    with pytest.raises(StopWear):
        integrate(until_thin, [1e-4], limits=Limits(cycles=1e9))


def test_nonsense_rates_end_or_raise():
    life = integrate(
        lambda h: np.where(h > 1e-6, np.nan, 1e-12), [0.0], limits=Limits(cycles=1e9)
    )
    assert life.end_reason == "wear rate not finite"
    assert life.depth[-1, 0] == pytest.approx(1e-6, rel=2e-3, abs=0.0)
    with pytest.raises(ValueError, match="negative"):
        integrate(lambda h: -1e-12 - 0.0 * h, [0.0], limits=Limits(cycles=1e9))
    with pytest.raises(ValueError, match="shape"):
        integrate(lambda h: np.zeros(3), [0.0], limits=Limits(cycles=1e9))


def test_no_wear_and_limits_already_met():
    still = integrate(lambda h: 0.0 * h, [1e-6, 0.0], limits=Limits(depth=1e-4))
    assert (still.end_reason, still.count_steps) == ("no wear", 0)
    still = integrate(lambda h: 0.0 * h, [1e-6, 0.0], limits=Limits(cycles=1e9))
    assert (still.end_reason, still.cycle[-1]) == ("cycles", 1e9)
    met = integrate(lambda h: 0.0 * h, [1e-4, 0.0], limits=Limits(depth=1e-4))
    assert (met.end_reason, met.cycle[-1]) == ("depth", 0.0)


@pytest.mark.parametrize(
    "limits", [Limits(), Limits(cycles=0.0), Limits(depth=-1e-6), Limits(cycles=np.nan)]
)
def test_impossible_limits_are_refused(limits):
    with pytest.raises(ValueError, match="limit"):
        integrate(lambda h: h, [0.0], limits=limits)


def test_work_is_bounded(toys):
    rate = toys.LineContact()
    life = integrate(
        rate,
        np.zeros(rate.n),
        limits=Limits(cycles=4e7),
        tolerance=1e-6,
        max_evaluations=30,
    )
    assert life.end_reason == "evaluation limit"
    assert rate.count == 30 and life.count_steps > 0


def test_the_work_of_the_rate_is_bounded(toys):
    class Working(toys.LineContact):
        @property
        def work(self):
            return 1000.0 + 7.0 * self.count

    rate = Working()
    life = integrate(
        rate,
        np.zeros(rate.n),
        limits=Limits(cycles=4e7),
        tolerance=1e-6,
        max_work=210.0,
    )
    assert life.end_reason == "work limit"
    assert rate.count == 30  # what was done before does not count
    assert life.count_steps > 0


def test_worn_flank_has_its_depth_and_the_shape_of_the_law(toys):
    rate = toys.Sharing()
    flank = slice(0, rate.n // 2)
    h = worn(rate, np.zeros(rate.n), {0: (flank, 3e-6)}, scale=1e-7)
    assert h[flank].max() == 3e-6
    assert not h[rate.n // 2 :].any()
    direct = integrate(
        rate, np.zeros(rate.n), limits=Limits(depth=3e-6, flank=flank), scale=1e-7
    )
    assert np.array_equal(h[flank], direct.depth[-1][flank])
    assert not worn(rate, np.zeros(rate.n), {0: (flank, 0.0)}).any()
    with pytest.raises(ValueError, match="cannot be worn"):
        worn(lambda h: 0.0 * h, np.zeros(3), {1: (slice(None), 1e-6)})

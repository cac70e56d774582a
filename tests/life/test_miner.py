import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearlab.life.loads.equivalent import equivalent_load

LOADS = st.lists(st.floats(0.0, 1e5), min_size=1, max_size=20)


def test_against_the_sum():
    load = np.array([0.0, 100.0, 300.0, 200.0])
    weight = np.array([1.0, 2.0, 3.0, 4.0])
    expected = ((2 * 100.0**6 + 3 * 300.0**6 + 4 * 200.0**6) / 10.0) ** (1 / 6)
    assert equivalent_load(load, 6.0, weight) == pytest.approx(
        expected, rel=1e-14, abs=0.0
    )
    assert equivalent_load(load, 1.0, weight) == pytest.approx(
        np.average(load, weights=weight), rel=1e-6, abs=0.0
    )


def test_steep_slopes_do_not_overflow_and_reach_the_maximum():
    load = np.array([1e5, 2e5, 3e5])
    assert equivalent_load(load, 1000.0) == pytest.approx(
        3e5 * 3 ** (-1 / 1000), rel=1e-12, abs=0.0
    )
    assert equivalent_load(np.zeros(5), 6.0) == 0.0


@given(LOADS, st.floats(1.0, 50.0))
def test_never_below_the_mean_nor_above_the_maximum(load, slope):
    found = equivalent_load(load, slope)
    assert np.mean(load) * (1 - 1e-12) <= found <= np.max(load) * (1 + 1e-12)


def test_equal_loads_are_their_own_equivalent_in_any_weighting():
    assert equivalent_load(
        np.full((3, 4), 340.0), 6.2, np.arange(1.0, 5.0)
    ) == pytest.approx(340.0, rel=1e-6, abs=0.0)


@pytest.mark.parametrize(
    ("load", "slope"), [([1.0], 0.5), ([1.0], np.nan), ([-1.0, 2.0], 6.0)]
)
def test_nonsense_is_refused(load, slope):
    with pytest.raises(ValueError, match=r"below|negative"):
        equivalent_load(load, slope)

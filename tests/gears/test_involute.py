import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearlab.gears.shifts import inverse_involute, involute
from wearlab.gears.specification import GearError


def test_tabulated_value():
    assert involute(math.radians(20)) == pytest.approx(0.014904383867, abs=1e-12)


@given(st.floats(1e-3, 1.5))
def test_inverse_undoes_the_involute_function(angle):
    assert inverse_involute(involute(angle)) == pytest.approx(angle, rel=1e-9)


def test_derivative_is_the_squared_tangent():
    step = 1e-5
    for angle in (0.2, 0.35, 0.6):
        slope = (involute(angle + step) - involute(angle - step)) / (2 * step)
        assert slope == pytest.approx(math.tan(angle) ** 2, rel=1e-7)


def test_negative_value_is_refused():
    assert inverse_involute(0.0) == 0.0
    with pytest.raises(GearError, match="give 0 or more"):
        inverse_involute(-0.001)

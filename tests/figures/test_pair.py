"""The history of one tooth pair, put together from the slots of a
mesh that lags behind the clock.
"""

import numpy as np
import pytest

from wearlab.figures.kinds.engagement import through_engagement

RATIO, PERIODS = 1.6, 3


@pytest.mark.parametrize("lag", [0.0, 0.3, 0.85])
@pytest.mark.parametrize("period", range(PERIODS))
def test_a_pair_is_followed_from_its_own_entry(lag: float, period: int):
    """Every value names the period in which its pair entered, and how long ago."""
    phase = np.linspace(0.0, 1.0, 20, endpoint=False)
    since = np.round(np.arange(PERIODS)[:, None] + phase - lag, 12)
    entered = np.floor(since)
    slots = np.empty((2, PERIODS, phase.size))
    for age in range(2):
        slots[1 - age] = 100.0 * ((entered - age) % PERIODS) + since - entered + age

    x, y = through_engagement(slots, phase, RATIO, lag, period)

    np.testing.assert_allclose(y, 100.0 * period + x, atol=1e-9)
    assert x[0] < 0.05 and x[-1] > RATIO - 0.05
    assert np.all(np.diff(x) > 0.0)

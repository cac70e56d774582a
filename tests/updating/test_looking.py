"""One more measurement, against the closed form of two normal laws."""

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study

from wearlab.updating.next_inspection import expected_width, virtual_inspection
from wearlab.updating.outcome import outcome


def test_a_measurement_of_what_ends_narrows_it_as_two_normal_laws_do():
    """rest = −value, both normal: the width after is 3.29/√(1/σ² + 1/sd²), whatever was measured."""
    rng = np.random.default_rng(0)
    value = 10.0 + rng.standard_normal(20_000)
    for sd in (0.5, 1.0, 3.0):
        found = expected_width(value, 100.0 - value, np.full(20_000, sd), rng)
        assert found == pytest.approx(3.2897 / np.sqrt(1.0 + 1.0 / sd**2), rel=0.03)


def test_later_and_better_looks_are_worth_more():
    cycles = np.array([1e5, 2e5])
    seen = (observed(cycles, 1.3 * RATE * cycles, ErrorModel(4e-4)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen)
    one = outcome(asked, (history(seen),), np.zeros(1, np.intp))
    found = virtual_inspection(one, np.random.default_rng(0))["expected_width"].values
    assert (found[0] <= found[1]).all() and (found[1] <= found[2]).all()
    assert found[1, -1] < 0.5 * found[1, 0] and found.max() < 1.1
    assert len(blocks(seen)) == 1

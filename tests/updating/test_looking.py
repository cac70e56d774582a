"""One more measurement, against the closed form of two normal laws."""

from dataclasses import replace

import numpy as np
import pytest
from made import RATE, ErrorModel, blocks, history, observed, study

from wearlab.updating.answers import outcome_of
from wearlab.updating.decision import expected_width, virtual_inspection


def test_a_measurement_of_what_ends_narrows_it_as_two_normal_laws_do():
    """rest = −value, both normal: the width after is 3.29/√(1/σ² +
    1/sd²), whatever was measured.
    """
    rng = np.random.default_rng(0)
    value = 10.0 + rng.standard_normal(20_000)
    for sd in (0.5, 1.0, 3.0):
        found = expected_width(value, 100.0 - value, np.full(20_000, sd), rng)
        assert found == pytest.approx(3.2897 / np.sqrt(1.0 + 1.0 / sd**2), rel=0.03)


def test_later_and_better_looks_are_worth_more():
    cycles = np.array([1e5, 2e5])
    seen = (observed(cycles, 1.3 * RATE * cycles, ErrorModel(4e-4)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen)
    one = outcome_of(asked, (history(seen),))
    found = virtual_inspection(one, np.random.default_rng(0))["expected_width"].values
    assert (found[0] <= found[1]).all() and (found[1] <= found[2]).all()
    assert found[1, -1] < 0.5 * found[1, 0] and found.max() < 1.1
    assert len(blocks(seen)) == 1


def conjugate_width(cycles, look, sd, offset):
    """Return the width of ln k's interval after one more look over that now: linear
    wear, normal laws.
    """
    slopes = RATE * cycles
    slope = RATE * look
    now = np.sum(slopes**2) / (sd**2 + offset**2)
    return np.sqrt(now / (now + slope**2 / (sd**2 + offset**2)))


@pytest.mark.parametrize("offset", [0.0, 2e-3])
def test_an_offset_common_to_an_inspection_counts(offset):
    """Had been left out: a width of 0.085 was promised where brute force has 0.818."""
    cycles = np.array([4e5, 6e5])
    sd = 2e-4
    seen = (observed(cycles, 1.3 * RATE * cycles, ErrorModel(sd, 0.0, offset)),)
    asked = study({"lognormal": {"median": 1.0, "cov": 14.0}}, seen, draws=4000)
    one = outcome_of(asked, (history(seen),))
    found = virtual_inspection(one, np.random.default_rng(0))
    early = one.answer.life(np.array([0.01]))[
        0
    ]  # later the remaining lives that have ended are all 0
    assert (found["look"].values < early).sum() >= 3
    for k, look in enumerate(found["look"].values[found["look"].values < early]):
        exact = conjugate_width(cycles, look, sd, offset)
        assert found["expected_width"].values[1, k] == pytest.approx(exact, abs=0.03)


def test_a_column_of_errors_makes_no_nan():
    cycles = np.array([4e5, 6e5])
    one = replace(
        observed(cycles, 1.3 * RATE * cycles, ErrorModel(None)), sd=np.full(2, 4e-4)
    )
    asked = study({"lognormal": {"median": 1.0, "cov": 14.0}}, (one,), draws=2000)
    found = virtual_inspection(
        outcome_of(asked, (history((one,)),)), np.random.default_rng(0)
    )
    assert (
        np.isfinite(found["expected_width"].values).all()
        and found["expected_width"].max() < 1.03
    )


def test_a_measurement_loses_no_information_with_few_runs():
    """Said so with few stored draws: widths above 1."""
    cycles = np.array([4e5, 6e5])
    seen = (observed(cycles, 1.3 * RATE * cycles, ErrorModel(1e-3)),)
    runs = tuple(
        history(seen, rate=RATE * f, run=str(f)) for f in np.linspace(0.9, 1.1, 12)
    )
    asked = study({"lognormal": {"median": 1.0, "cov": 14.0}}, seen, draws=2000)
    found = virtual_inspection(outcome_of(asked, runs), np.random.default_rng(0))
    assert found["expected_width"].max() < 1.03


def test_no_look_is_advised_before_it_is_known_which_file_is_wrong():
    """Was promised a twentieth of the width, by the instrument that
    may be the wrong one.
    """
    cycle = np.array([5e5])
    ones = [
        observed(cycle, RATE * f * cycle, ErrorModel(1e-4), number=n)
        for n, f in ((1, 1.0), (2, 1.2))
    ]
    asked = study({"lognormal": {"median": 1.0, "cov": 14.0}}, ones, draws=300)
    one = outcome_of(asked, (history(ones),))
    assert virtual_inspection(one, np.random.default_rng(0)) is None

"""ISO 1328-1:1995 against numbers worked out by hand, and against its own rules."""

import pytest

from wearlab.gears.iso import allowed
from wearlab.gears.specification import GearError


@pytest.mark.parametrize(
    "diameter, ratio, total, tooth",
    [(45e-3, 1.411, 39, 18), (0.1, 1.411, 46, 20), (0.225, 1.683, 54, 19)],
)
def test_the_class_that_a_campaign_had_worked_out_by_hand(
    diameter, ratio, total, tooth
):
    """Class 6 of NGW11-6, as campaigns/planetary_life_distribution.toml tells it (19.55
    µm there is 19).
    """
    found = allowed(6, 2.25e-3, diameter, ratio)
    assert found.total_composite == pytest.approx(1e-6 * total)
    assert found.tooth_composite == pytest.approx(1e-6 * tooth)


def test_two_classes_double_what_is_allowed():
    fine = allowed(7, 0.005, 0.2, 1.6)
    coarse = allowed(9, 0.005, 0.2, 1.6)
    for one, other in zip(fine, coarse, strict=True):
        assert other == pytest.approx(2.0 * one, rel=0.03)  # rounding to micrometres


def test_equal_within_a_range():
    """The standard has ranges of module and diameter, not formulas of them: 130 and 270
    mm are one.
    """
    assert allowed(5, 2.1e-3, 0.13, 1.5) == allowed(5, 3.4e-3, 0.27, 1.5)


@pytest.mark.parametrize(
    "q, module, diameter, why",
    [(13, 3e-3, 0.1, "0 to 12"), (6, 0.1, 0.1, "module"), (6, 3e-3, 11.0, "diameter")],
)
def test_beyond_the_standard(q, module, diameter, why):
    with pytest.raises(GearError, match=why):
        allowed(q, module, diameter, 1.5)

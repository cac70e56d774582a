import math

import pytest

from wearlab.gears.shifts import operating_position
from wearlab.gears.specification import Basics, GearError

W23 = Basics(0.00225)


def test_wang_2023_sun_planet():
    position = operating_position((20, 29), (0.35, None), W23, 0.0565)
    assert math.degrees(position.working_pressure_angle) == pytest.approx(
        23.534, abs=5e-4
    )
    assert sum(position.shifts) == pytest.approx(0.664, abs=5e-4)
    assert position.shifts[0] == 0.35
    assert position.assumed == ()


def test_centre_distance_and_shifts_are_inverse_to_each_other():
    given = operating_position((20, 29), (0.2, 0.3), W23)
    back = operating_position((20, 29), (None, 0.3), W23, given.centre_distance)
    assert back.shifts[0] == pytest.approx(0.2, abs=1e-12)
    assert back.working_pressure_angle == pytest.approx(
        given.working_pressure_angle, rel=1e-13
    )


def test_absent_shifts_are_split_in_halves_and_flagged():
    position = operating_position((20, 29), (None, None), W23, 0.0565)
    assert position.shifts[0] == position.shifts[1]
    assert "split in halves" in position.assumed[0]


def test_standard_distance_needs_no_shift_and_no_flag():
    position = operating_position((20, 29), (None, None), W23)
    assert position.centre_distance == pytest.approx(0.055125, rel=1e-14)
    assert position.working_pressure_angle == pytest.approx(math.radians(20), rel=1e-13)
    assert position.tip_alteration == pytest.approx(0.0, abs=1e-12)
    given = operating_position((20, 29), (None, None), W23, 0.055125)
    assert given.assumed == ()


def test_tip_alteration_keeps_the_standard_clearance():
    position = operating_position((20, 29), (0.35, 0.3), W23)
    a = position.centre_distance
    m = W23.module
    tip = m * (20 / 2 + 0.35 + 1 + position.tip_alteration)
    root = m * (29 / 2 + 0.3 - 1.25)
    assert position.tip_alteration < 0
    assert a - tip - root == pytest.approx(0.25 * m, rel=1e-10)


def test_refusals():
    with pytest.raises(
        GearError, match="no involute contact: the centre distance 51 mm"
    ):
        operating_position((20, 29), (None, None), W23, 0.051)
    with pytest.raises(
        GearError,
        match=r"sum of the profile shifts is 0\.4000, but .* 56\.5 mm needs 0\.664",
    ):
        operating_position((20, 29), (0.1, 0.3), W23, 0.0565)
    rounded = operating_position((20, 29), (0.35, 0.314), W23, 0.0565)
    assert rounded.shifts == (0.35, 0.314)


def test_teeth_closer_than_without_backlash_lose_what_their_tips_would_lack():
    """DIN 3960: k = (a − a_d)/m − Σx of the centre distance given, d_a = m (z + 2 x + 2
    + 2 k).
    """
    rack = Basics(3e-3)
    rounded = operating_position((19, 57), (0.35, -0.1), rack, 0.1145)
    assert rounded.tip_alteration == pytest.approx(
        (114.5 - 114.0) / 3 - 0.25, abs=1e-12
    )
    free = operating_position((19, 57), (0.35, -0.1), rack)
    farther = operating_position((19, 57), (0.35, -0.1), rack, 0.115)
    assert farther.tip_alteration == free.tip_alteration

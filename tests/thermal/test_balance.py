"""The temperatures that friction holds: closed forms, runaway, and no start value."""

import numpy as np
import pytest

from wearlab.materials.over_temperature import (
    OutsideTable,
    TemperatureCurve,
    check_table,
    held,
)
from wearlab.thermal.balance import (
    HeatBalance,
    NoSteadyTemperature,
    RunawayPower,
    TemperatureLimit,
    fixed_point,
)

RISE = 28.0634
"""Of the flank of the worked example with a constant coefficient of friction [K]."""


def growing(c):
    """Power over its value at the surroundings: friction grows by c a kelvin."""
    return lambda power: 1.0 + c * RISE * power


@pytest.mark.parametrize(("c", "rise"), [(0.004, 31.6120), (0.012, 42.3127)])
def test_friction_that_grows_with_warmth(c, rise):
    assert RISE * fixed_point(growing(c)) == pytest.approx(rise, rel=2e-6)


@pytest.mark.parametrize("c", [0.01, 0.03, 0.0356])
def test_the_closed_form_up_to_the_runaway(c):
    assert RISE * fixed_point(growing(c)) == pytest.approx(
        RISE / (1.0 - c * RISE), rel=1e-7
    )


@pytest.mark.parametrize("c", [0.035634, 0.04, 0.2])
def test_runaway(c):
    with pytest.raises(RunawayPower):
        fixed_point(growing(c))


def test_no_runaway_is_looked_for_beyond_what_is_known():
    """A fixed point above the highest power is none; the loss there is told."""
    with pytest.raises(RunawayPower) as told:
        fixed_point(growing(0.03), highest=2.0)
    assert told.value.power == 2.0
    assert told.value.loss == pytest.approx(1.0 + 0.03 * RISE * 2.0)


def test_the_lesser_of_two_fixed_points():
    """Friction that rises fast above 3 W: the one from cold is taken."""

    def loss(power):
        return 1.0 + 0.1 * power + 0.02 * power**3

    found = fixed_point(loss)
    roots = np.roots([0.02, 0.0, -0.9, 1.0])
    positive = sorted(root.real for root in roots if root.real > 0)
    assert len(positive) == 2
    assert found == pytest.approx(positive[0], rel=1e-10)


def test_a_loss_that_falls():
    assert fixed_point(lambda power: 5.0 * np.exp(-power)) == pytest.approx(
        1.3267246652422002, rel=1e-10
    )
    assert fixed_point(lambda power: 0.0) == 0.0


def test_what_is_nearest_ends_it():
    resistance = np.array([[0.0, 0.0], [1.0, 5.0]])
    limits = (
        TemperatureLimit("gear", 1, 0, 400.0, "a table"),
        TemperatureLimit("gear", 1, 1, 373.15, "the service temperature"),
        TemperatureLimit("pinion", 0, 1, 293.2, "a table"),
    )
    balance = HeatBalance(293.15, resistance, limits)
    assert balance.nearest_limit == limits[1]
    with pytest.raises(NoSteadyTemperature, match="flank of gear would pass 100 °C"):
        balance.steady_power(lambda temperature: 16.5)
    assert balance.steady_power(lambda temperature: 15.5) == 15.5
    assert balance.temperatures(15.5)[1] == pytest.approx([308.65, 370.65])


def test_tables_are_straight_between_and_end():
    curve = TemperatureCurve((293.15, 333.15, 373.15), (2.9, 1.9, 1.1))
    assert [curve.at(t) for t in curve.temperature] == [2.9, 1.9, 1.1]
    assert curve.at(353.15) == pytest.approx(1.5)
    for outside in (293.1, 373.2):
        with pytest.raises(OutsideTable, match="from 20 °C to 100 °C"):
            curve.at(outside)
    assert held(3.0).at(1e4) == 3.0


@pytest.mark.parametrize(
    ("temperature", "value", "match"),
    [
        ((1.0, 2.0), (1.0,), "one value for each"),
        ((1.0,), (1.0,), "two rows"),
        ((2.0, 1.0), (1.0, 1.0), "ascend"),
        ((1.0, 1.0), (1.0, 2.0), "ascend"),
    ],
)
def test_what_is_no_table(temperature, value, match):
    with pytest.raises(ValueError, match=match):
        check_table(temperature, value)


@pytest.mark.parametrize("noise", [1e-9, 1e-7, 1e-6])
def test_a_loss_with_noise_settles_within_it(noise):
    """Contact of whole outlines has some: thirty looks, or a division by zero before.

    The loss jumps down where it meets the power, so that no power is its own loss.
    """
    looked_at = []

    def loss(power):
        looked_at.append(power)
        jump = noise if power < 5.0 else -noise
        return 5.0 + 0.01 * (power - 5.0) + jump

    assert fixed_point(loss) == pytest.approx(5.0, abs=3.0 * noise)
    assert len(looked_at) <= 10
    assert looked_at[-1] == pytest.approx(5.0, abs=3.0 * noise)

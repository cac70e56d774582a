"""The callback of least cost is the equation of motion in one smooth segment."""

import ctypes

import numpy as np
import pytest

from wearlab.accuracy.equation import motion_callback, motion_of, motion_within
from wearlab.accuracy.steady import steady

DOUBLES = ctypes.POINTER(ctypes.c_double)


def called(callback, time, y, arguments=(0.0, 0.0, 0.0)):
    function = ctypes.CFUNCTYPE(None, DOUBLES, ctypes.c_double, DOUBLES, DOUBLES)(
        callback.address
    )
    out = np.empty_like(y)
    given = np.array(arguments)
    function(
        *(one.ctypes.data_as(DOUBLES) for one in (out,)),
        time,
        *(x.ctypes.data_as(DOUBLES) for x in (y, given)),
    )
    return out


def states(n, seed=7):
    return (
        np.random.default_rng(seed).normal(size=(30, 2 * n))
        * np.r_[np.full(n, 8e-6), np.full(n, 0.05)]
    )


@pytest.mark.parametrize("scene", ["separating", "planetary"])
def test_callback_is_the_equation_of_motion(scene, request):
    given = steady(request.getfixturevalue(scene)).motion()
    landing = motion_callback(given)
    random = np.random.default_rng(1)
    for y in states(len(given.push)):
        segment = int(random.integers(len(given.first_cell) - 1))
        cells = given.first_cell[segment], given.first_cell[segment + 1]
        low = given.breaks[segment]
        high = given.breaks[segment + 1]
        local = (
            random.choice([0.0, 1.0, random.uniform()]) * (high - low) * given.period
        )  # ends too
        inside = min(
            max(local, 1e-9 * given.period), (high - low - 1e-9) * given.period
        )
        expected = motion_of(low * given.period + inside, y, given)
        found = called(landing, local, y, (*cells, low))
        np.testing.assert_allclose(
            found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max()
        )


def test_at_a_jump_the_segment_asked_for_decides(problem):
    given = problem.motion()
    callback = motion_callback(given)
    y = np.r_[np.zeros(len(given.push) - 1), 2e-5, np.zeros(len(given.push))]
    sides = []
    for segment, local in ((0, given.breaks[1] * given.period), (1, 0.0)):
        cells = int(given.first_cell[segment]), int(given.first_cell[segment + 1])
        sides.append(called(callback, local, y, (*cells, given.breaks[segment])))
        held = motion_within(given.breaks[1] * given.period, y, given, *cells)
        np.testing.assert_allclose(sides[-1], held, rtol=1e-9)
    assert np.abs(sides[0] - sides[1]).max() > 1e-2 * np.abs(sides[0]).max()

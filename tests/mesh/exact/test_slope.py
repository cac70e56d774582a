"""The slope of wear in a tooth's own axes against the outlines of
worn and unworn flanks.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from wearlab.mesh.exact.flank import local_points, wear_slope, worn_flank


def outline(flanks, gear, depth):
    """Return the outline of a flank in the tooth's axes, by rising x."""
    pair = flanks.pair
    grid = flanks.grid
    flank = worn_flank(flanks.layouts[gear], depth)
    position = np.unique(grid.position)[1:-1]
    gamma, radius, _ = local_points(pair, gear, flank, position)
    x = radius * np.cos(gamma)
    y = radius * np.sin(gamma)
    order = np.argsort(x)
    return x[order], y[order], position[order]


def test_it_is_the_slope_of_what_is_missing_across_the_tooth(flanks, make):
    """Y23 Eqs. 19 and 22: y = g(x) − h of a tooth, g(x) + h of a ring's space."""
    wear = make.smooth_wear(flanks, 4e-6)
    grid = flanks.grid
    for gear in (0, 1):
        x0, y0, _ = outline(flanks, gear, 0.0 * wear[gear])
        x, y, position = outline(flanks, gear, wear[gear])
        sign = -1.0 if flanks.pair.gears[gear].internal else 1.0
        missing = sign * (CubicSpline(x0, y0)(x) - y)
        expected = CubicSpline(x, missing)(x, 1)
        found = np.interp(
            position, grid.position, wear_slope(flanks.pair, gear, grid, wear[gear])
        )
        inside = slice(8, -8)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[inside], expected[inside], atol=0.01 * scale)
        assert scale > 1e-4


def test_no_wear_has_no_slope_and_steps_have_two_sides(flanks):
    grid = flanks.grid
    assert not wear_slope(flanks.pair, 0, grid, np.zeros((3, len(grid.position)))).any()
    after = np.arange(len(grid.position)) > np.argmin(np.diff(grid.position))
    level, step = (
        wear_slope(flanks.pair, 0, grid, depth)
        for depth in (np.full(len(after), 1e-6), 1e-6 + 2e-6 * after)
    )
    np.testing.assert_allclose(step, np.where(after, 3.0, 1.0) * level, rtol=1e-9)

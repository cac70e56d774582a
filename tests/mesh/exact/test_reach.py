"""How far deflected teeth would touch beyond A and E, to first order in wear, against
the exact search.
"""

import numpy as np
import pytest
from exact_extension import Deflections, extension

from wearlab.mesh.exact.flank import OverhangingFlank
from wearlab.mesh.exact.gaps import WornFlanks, reach_beyond
from wearlab.mesh.profile import profile_grid

PAIRS = ["external", "internal", "internal, ring drives"]


def wear_of(grid, depth):
    """Wear that is deepest at both ends, more at A, with a step where one pair begins
    to carry alone.
    """
    s = grid.position
    shape = (s / np.abs(s).max()) ** 2 * np.where(s < 0.0, 1.0, 0.6)
    shape[np.abs(s) < 0.2 * np.abs(s).max()] *= 0.5
    return depth * np.stack([shape, 0.7 * shape])


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("depth", [0.0, 2e-6, 2e-5])
@pytest.mark.parametrize("deflection", [1e-6, 1e-5, 6e-5])
def test_it_reaches_as_far_as_the_exact_search_says(make, name, depth, deflection):
    pair = make.pairs[name]
    grid = profile_grid(pair, 151)
    wear = wear_of(grid, depth)
    flanks = WornFlanks(pair, grid, np.zeros_like(wear))
    exact = extension(flanks, wear, Deflections(deflection, 0.5 * deflection))
    found = reach_beyond(pair, grid.position, wear, (deflection, 0.5 * deflection))
    first_order = (
        1e-3 + 50.0 * depth
    )  # at 20 µm a thousandth of a base pitch, as the scan itself
    np.testing.assert_allclose(found, exact, atol=first_order * pair.base_pitch)
    if depth == 0.0:
        assert min(found) > 0.0


def test_a_flank_that_overhangs_is_refused(make):
    pair = make.pairs["external"]
    grid = profile_grid(pair, 151)
    depth = np.zeros((2, len(grid.position)))
    depth[0, 40:] = 1e-3  # a step down over one interval, steeper than it is long
    with pytest.raises(OverhangingFlank):
        reach_beyond(pair, grid.position, depth, (1e-5, 1e-5))

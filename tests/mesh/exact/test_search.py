"""The search for the smallest gap against gaps of very many points, for wear that
curves either way.
"""

import numpy as np
import pytest

from wearlab.compiled import jit
from wearlab.mesh.exact.flank import interval_of, shift_at
from wearlab.mesh.exact.kinematics import corner_gap, excess_reach, rotation_gap
from wearlab.mesh.exact.minimum_gap import minimum_gap


@jit
def of_very_many_points(driving, driven, x, s):
    """The smallest gap of points s of the driving flank and of all
    corners of the driven one.
    """
    found = np.full(len(x), np.inf)
    for i in range(len(x)):
        for point in s:
            w = shift_at(driving, interval_of(driving, point), point)[0]
            found[i] = min(found[i], rotation_gap(driving, driven, x[i], point, w)[0])
        for k in range(len(driving.start)):  # both sides of steps
            for end in range(2):
                at = driving.start[k] + end * driving.width[k]
                w = driving.shift[k, end]
                found[i] = min(found[i], rotation_gap(driving, driven, x[i], at, w)[0])
        for p in range(len(driven.piece) - 1):
            for k, end in ((driven.piece[p], 0), (driven.piece[p + 1] - 1, 1)):
                at = driven.start[k] + end * driven.width[k]
                reach = driven.reached[k, end]
                for q in range(len(driving.piece) - 1):
                    first = driving.piece[q]
                    last = driving.piece[q + 1] - 1
                    a = driving.start[first]
                    b = driving.start[last] + driving.width[last]
                    w_a = driving.shift[first, 0]
                    w_b = driving.shift[last, 1]
                    f_a = excess_reach(driving, driven, x[i], a, w_a, reach)
                    f_b = excess_reach(driving, driven, x[i], b, w_b, reach)
                    gap = corner_gap(
                        driving, driven, x[i], at, reach, first, last, f_a, f_b
                    )[0]
                    found[i] = min(found[i], gap)
    return found


def worn_shapes(flanks, make):
    """Wear over its depth of every kind: smooth, in steps at B and D,
    hollow, and in waves.
    """
    s = flanks.grid.position
    smooth = make.smooth_wear(flanks, 1.0)
    stretch = np.concatenate([[0], np.cumsum(np.diff(s) == 0.0)])
    return {
        "smooth": smooth,
        "steps": smooth * np.where(stretch % 2 == 0, 0.55, 1.0),
        "hollow": np.stack([np.exp(-((s / 2e-3) ** 2)), np.zeros_like(s)]),
        "mate hollow": np.stack([0.3 * smooth[0], np.exp(-((s / 1e-3) ** 2))]),
        "waves": smooth * (1.0 + 0.1 * np.sin(2000.0 * s)),
    }


@pytest.mark.parametrize("shape", ["smooth", "steps", "hollow", "mate hollow", "waves"])
@pytest.mark.parametrize("depth", [0.0, 1e-6, 10e-6, 100e-6])
def test_no_point_of_a_flank_touches_before_the_one_found(flanks, make, shape, depth):
    """Among points half a micrometre apart, beyond the path too, one
    is as near, none is nearer.
    """
    path = flanks.pair.path
    driving, driven = flanks.worn(depth * worn_shapes(flanks, make)[shape])
    x = np.linspace(path.A - 1e-3, path.E + 1e-3, 31)
    s = np.arange(driving.start[0], driving.start[-1] + driving.width[-1], 5e-7)
    found = minimum_gap(driving, driven, x).gap
    scanned = of_very_many_points(driving, driven, x, s)
    assert np.isfinite(found).sum() > 25
    assert np.all(found <= scanned + 1e-14)
    np.testing.assert_allclose(found, scanned, rtol=0, atol=3e-10)

"""Contacts from the trace of tangent points against a search over the whole flank."""

import numpy as np
import pytest

from wearlab.mesh.exact.kinematics import FlankContact
from wearlab.mesh.exact.minimum_gap import _search, minimum_gap
from wearlab.mesh.exact.trace import trace, traced_gap


def worn_shapes(flanks, make):
    """Wear over its depth of every kind: smooth, in steps at B and D, hollow, and in waves."""
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
def test_the_trace_finds_what_a_search_over_the_flank_does(flanks, make, shape, depth):
    """From tangent points or by search, beyond the path too: the same smallest gap, and where it is."""
    path = flanks.pair.path
    worn = flanks.worn(depth * worn_shapes(flanks, make)[shape])
    x = np.linspace(path.A - 1e-3, path.E + 1e-3, 301)
    found = minimum_gap(*worn, x)
    searched = FlankContact(*np.full((2, len(x)), np.nan), x, np.empty(len(x)))
    without = trace(*worn)._replace(usable=False)
    _search(*worn, without, x, searched.driving, searched.driven, searched.x_driven)
    np.testing.assert_allclose(found.gap, searched.gap, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.driving, searched.driving, rtol=0, atol=1e-7)


def test_smooth_flanks_are_never_searched(flanks, make):
    """The trace knows every contact of flanks that wear smoothly, and most of waves that stay convex."""
    inside = np.linspace(flanks.pair.path.A + 1e-6, flanks.pair.path.E - 1e-6, 99)
    for depth in (0.0, 1e-6, 30e-6):
        worn = flanks.worn(make.smooth_wear(flanks, depth))
        found, least = trace(*worn), (-worn[0].shift.max(), worn[1].shift.min())
        assert all(np.isfinite(traced_gap(found, *worn, least, x)[0]) for x in inside)
        assert found.grows.sum() > 0.9 * len(found.grows)

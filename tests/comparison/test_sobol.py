"""Sobol' indices: the closed form of Ishigami's function, and SciPy's own, from the
design of a campaign.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import sobol_indices as of_scipy
from scipy.stats import uniform

import wearlab as wl
from wearlab.campaign.axes import read_axes
from wearlab.comparison import CompareError
from wearlab.comparison.sobol import SobolWarning, indices

KEYS = (
    "wear.coefficient.factor",
    "operation.torque_fluctuation.amplitude",
    "numerics.tolerance",
)
FIRST = (
    0.31390519,
    0.44241114,
    0.0,
)  # a = 7, b = 0.1: V₁ = ½(1 + bπ⁴/5)², V₂ = a²/8, V₁₃ = 8b²π⁸/225
TOTAL = (0.55758886, 0.44241114, 0.24368366)


def ishigami(x):
    return np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def drawn(n):
    block = {key: {"uniform": [-np.pi, np.pi]} for key in KEYS}
    (axis,) = read_axes(
        [{**block, "sample": {"method": "sobol-indices", "n": n, "seed": 3}}]
    )
    inputs = [np.array(one.values) for one in axis.coordinates.values()]
    coordinates = {"sample": ("sample", list(axis.values), {"key": axis.key})}
    coordinates |= {
        name: ("sample", list(one.values), {"key": one.key})
        for name, one in axis.coordinates.items()
    }
    return xr.DataArray(ishigami(inputs), coordinates, ("sample",))


def test_ishigami():
    found = wl.sobol_indices(drawn(2048))
    assert found.first_order.values == pytest.approx(FIRST, abs=0.02)
    assert found.total_order.values == pytest.approx(TOTAL, abs=0.02)
    inside = (found.total_order_low <= TOTAL) & (TOTAL <= found.total_order_high)
    assert (
        inside.all()
        and found.key.values.tolist() == list(KEYS)
        and found.points == 2048
    )


def test_too_few_base_points_are_warned_of():
    with pytest.warns(
        SobolWarning,
        match=r"8 base points are too few.*95 % intervals of .* Raise sample.n",
    ):
        wl.sobol_indices(drawn(8))


def test_the_estimates_are_those_of_scipy():
    values = drawn(256).values.reshape(256, 5)
    theirs = of_scipy(
        func={
            "f_A": values[None, :, 0],
            "f_B": values[None, :, 1],
            "f_AB": values.T[2:, None],
        },
        n=256,
        dists=[uniform()] * 3,
    )
    assert indices(values) == pytest.approx(
        np.stack([theirs.first_order, theirs.total_order]), rel=1e-10
    )


def test_lost_runs_cost_their_base_points_only_and_other_dimensions_are_kept():
    result = drawn(512)
    both = xr.concat([result, 2.0 * result], "flank").assign_coords(
        flank=["pinion", "gear"]
    )
    both[0, 7] = np.nan
    with pytest.warns(SobolWarning) as caught:
        found = wl.sobol_indices(both)
    assert "1 of 512 base points (0.2 %) are left out" in str(caught[0].message)
    np.testing.assert_allclose(found.missing, [1 / 512, 0.0])
    assert found.points.values.tolist() == [511, 512] and found.first_order.dims == (
        "input",
        "flank",
    )
    assert found.first_order.sel(flank="pinion").values == pytest.approx(FIRST, abs=0.1)


def test_missing_lives_are_told_with_their_share():
    """Were left out in silence: a third of the base points, the longest lives."""
    lives = drawn(512)
    limited = lives.where(lives < np.quantile(lives, 0.9))
    with pytest.warns(SobolWarning) as caught:
        found = wl.sobol_indices(limited)
    first = str(caught[0].message)
    assert "10 % of the values are missing" in first and "wear.until" in first
    assert float(found.missing) == pytest.approx(1.0 - found.points / 512)
    assert 0.1 < float(found.missing) < 0.5


def test_what_was_not_drawn_for_it():
    with pytest.raises(CompareError, match="sobol-indices"):
        wl.sobol_indices(xr.DataArray(np.ones(4), dims="torque"))
    with pytest.raises(CompareError, match="no whole design"):
        wl.sobol_indices(drawn(4)[:-1])
    with pytest.raises(CompareError, match="1 of 4 base points"):
        wl.sobol_indices(drawn(4).where(drawn(4).sample < 5))

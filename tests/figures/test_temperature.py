"""Figures of gears that warm up: what they draw of a run."""

from types import SimpleNamespace

import numpy as np
import pytest
from warm_pair import warm_pair

import wearlab as wl
from wearlab.figures.kind import read
from wearlab.figures.plotting import plotted


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    scene = warm_pair(
        wear__until={"depth": "40 um"},
        wear__snapshots={"cycles": [1e6, 5e6]},
        gears__gear__tooth_thickness_allowance="-0.10 mm",
        gears__gear__material__service_temperature="60 degC",
    )
    folder = tmp_path_factory.mktemp("warm")
    return wl.run(scene, folder / "store").to_xarray()


def plot_of(grid, **wishes):
    return plotted(grid, read(SimpleNamespace(**wishes), 1, None))[0]


def test_temperature_and_wear_over_hours(grid):
    plot = plot_of(grid, kind="temperature-wear")
    warm, worn = plot.panels
    assert len(warm.curves) == 4 and len(worn.curves) == 2
    hottest = max(warm.curves, key=lambda curve: curve.y.max())
    assert hottest.y[0] == pytest.approx(48.0634, abs=1e-3)
    hours = grid["operating_hours"].values.ravel() / 3600.0
    assert hottest.x == pytest.approx(hours)
    assert max(curve.y.max() for curve in worn.curves) == pytest.approx(40.0)


def test_shares_of_the_limits(grid):
    (panel,) = plot_of(grid, kind="what-ends-it").panels
    wear, temperature, backlash = panel.curves
    assert wear.y[0] == 0.0 and wear.y[-1] == pytest.approx(1.0)
    assert temperature.y[0] == pytest.approx(28.0634 / 40.0, rel=1e-5)
    taken = -grid["thermal_backlash_change"].values.ravel()
    left = grid["warm_backlash"].values.ravel()
    assert backlash.y == pytest.approx(taken / (left + taken))
    assert np.all(np.diff(left) > 0.0)
    # the allowance of 0.1 mm, less what 3.99 K at the root take of it
    growth = 40e-3 * 1.2e-4 * 3.98679
    expected = 1e-4 / np.cos(np.radians(20.0)) * np.cos(np.radians(20.0))
    expected -= 2.0 * np.tan(np.radians(20.0)) * growth
    assert left[0] == pytest.approx(expected, rel=2e-3)

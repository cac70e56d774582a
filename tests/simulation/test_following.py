"""Results that follow from others: declared once, found in every run
that has what they need.
"""

import numpy as np
import xarray as xr

from wearlab.results import RESULTS
from wearlab.schema import VARIABLES
from wearlab.simulation.label import with_results


def test_a_run_gets_those_whose_needs_it_has():
    depth = xr.DataArray(
        [[[1.0, np.nan, 3.0]], [[2.0, 5.0, 4.0]]], dims=("update", "flank", "profile")
    )
    found = with_results(xr.Dataset({"wear_depth": depth}))
    assert found["max_wear_depth"].dims == VARIABLES["max_wear_depth"].dims
    np.testing.assert_array_equal(found["max_wear_depth"], [[3.0], [5.0]])
    assert found["max_wear_depth"].attrs["units"] == "m"
    assert "max_wear_depth" not in with_results(
        xr.Dataset({"cycle": ("update", [0.0])})
    )


def test_each_is_declared_by_its_file_alone():
    assert RESULTS and all(
        VARIABLES[name] is one.variable for name, one in RESULTS.items()
    )
    assert all(need in VARIABLES for one in RESULTS.values() for need in one.needs)

"""Two results of one scene: round-off and estimated errors are no difference."""

import numpy as np
import pytest
import xarray as xr

from wearlab.store.agreement import agreement


def run(factor=1.0, stiffness=1.0, **changes):
    data = {
        "wear_depth": (
            ("update",),
            factor * np.array([0.0, 1e-6, 4e-6]),
            {"units": "m"},
        ),
        "error_estimate_wear_depth": (("update",), np.array([0.0, 1e-9, 4e-9])),
        "mesh_stiffness": ((), stiffness * 3e8, {"units": "N m-1"}),
        "ste_noise": ((), 1e-22, {"units": "m"}),
        "end_reason": ((), "cycles"),
        "count_rates": ((), 12),
    }
    return xr.Dataset(data | changes)


@pytest.mark.parametrize(
    "theirs, is_same, text",
    [
        (run(), True, ""),
        (run(1.0 + 5e-15), True, ""),
        (run(1.001), True, "by up to 0.1 % (wear_depth)"),
        (run(1.01), False, "by up to 0.99 % (wear_depth)"),
        (run(stiffness=1.0015), True, "by up to 0.15 % (mesh_stiffness)"),
        (run(stiffness=1.1), False, "by up to 9.1 % (mesh_stiffness)"),
        (run(ste_noise=((), -3e-22, {"units": "m"})), True, ""),
        (run(count_rates=((), 13)), True, ""),
        (run(end_reason=((), "depth")), False, "end_reason has another text"),
        (
            run(mesh_stiffness=("phase", [3e8], {"units": "N m-1"})),
            False,
            "mesh_stiffness is one number here, 1 there",
        ),
        (
            run().drop_vars("ste_noise"),
            False,
            "ste_noise is there in one of them alone",
        ),
        (
            run(wear_depth=("update", [0.0, np.nan, 4e-6], {"units": "m"})),
            False,
            "wear_depth has no value at other places",
        ),
    ],
)
def test_by_how_much_results_differ(theirs, is_same, text):
    assert agreement(run(), theirs) == (is_same, text)


def test_without_estimates_more_than_round_off_is_a_difference():
    ours = run().drop_vars("error_estimate_wear_depth")
    theirs = run(1.0 + 1e-6).drop_vars("error_estimate_wear_depth")
    found = agreement(ours, theirs)
    assert not found.is_same and found.text == "by up to 0.0001 % (wear_depth)"

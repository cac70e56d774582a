"""The wear of a run between its stored states."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from wearlab.store.align import hermite, start_wear
from wearlab.store.files import StoreError

CYCLES = np.array([0.0, 1e6, 4e6])


def depth(n):
    """Depth that grows as a cubic over cycles, along three nodes of two flanks."""
    x = np.asarray(n, float)[..., None, None] / 1e6
    return (
        1e-6
        * (x - 0.1 * x**2 + 0.004 * x**3)
        * np.array([[1.0, 0.0, 2.0], [0.5, 0.0, 1.0]])
    )


def rate(n):
    x = np.asarray(n, float)[..., None, None] / 1e6
    return (
        1e-12
        * (1.0 - 0.2 * x + 0.012 * x**2)
        * np.array([[1.0, 0.0, 2.0], [0.5, 0.0, 1.0]])
    )


PARENT = xr.Dataset(
    {
        "wear_depth": (("update", "flank", "profile"), depth(CYCLES)),
        "wear_rate": (("update", "flank", "profile"), rate(CYCLES)),
        "life": ((), 4e6),
    },
    coords={
        "cycle": ("update", CYCLES),
        "flank": ["pinion", "gear"],
        "flank_side": ("flank", ["right", "right"]),
        "path_position": (
            ("flank", "profile"),
            np.array([[-1.0, 0.0, 2.0]] * 2) * 1e-3,
        ),
    },
)


def start(**given):
    return SimpleNamespace(
        **{"run": "a" * 20, "cycle": None, "life_fraction": None, **given}
    )


def test_a_stored_state_is_taken_as_it_is():
    found = start_wear(PARENT, start(cycle=1e6))
    assert (
        found.depth["gear"] == tuple(depth(1e6)[1])
        and found.error == 0.0
        and found.cycle == 1e6
    )
    assert found.side == {"pinion": "right", "gear": "right"}
    assert found.position["pinion"] == (-1e-3, 0.0, 2e-3)


def test_between_states_a_cubic_life_is_met_exactly():
    found = start_wear(PARENT, start(cycle=2.5e6))
    np.testing.assert_allclose(found.depth["pinion"], depth(2.5e6)[0], rtol=1e-12)
    assert 0.0 < found.error < 1e-7


def test_without_rates_it_is_linear_within_its_error():
    found = start_wear(PARENT.drop_vars("wear_rate"), start(cycle=2.5e6))
    mean = 0.5 * (depth(1e6) + depth(4e6))[0]
    np.testing.assert_allclose(found.depth["pinion"], mean)
    assert np.abs(mean - depth(2.5e6)[0]).max() < found.error


def test_a_fraction_of_the_life_and_the_last_state():
    assert start_wear(PARENT, start(life_fraction=0.25)).depth["gear"] == tuple(
        depth(1e6)[1]
    )
    assert start_wear(PARENT, start()).cycle == 4e6


def test_the_error_is_an_estimate_of_the_error():
    """Over a step of exp, at any place: never below the true error,
    not a hundred times above.
    """
    for t in (0.1, 0.5, 0.8):
        cubic, error = hermite(
            t, np.array([1.0]), np.array([np.e]), np.array([1.0]), np.array([np.e])
        )
        true = abs(float(cubic[0]) - np.exp(t))
        assert true < error < 100.0 * true


def test_what_cannot_be():
    for parent, asked, message in (
        (
            PARENT,
            start(cycle=5e6),
            "ends at cycle 4e\\+06: it has no wear at cycle 5e\\+06",
        ),
        (
            PARENT.drop_vars("life"),
            start(life_fraction=0.5),
            "did not reach the end of its life",
        ),
        (PARENT.drop_vars("wear_depth"), start(cycle=1.0), "holds no wear_depth"),
    ):
        with pytest.raises(StoreError, match=message):
            start_wear(parent, asked)

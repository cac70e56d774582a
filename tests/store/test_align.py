import numpy as np
import pytest
import xarray as xr
from fake_campaign import alter, sweep

from wearlab.store import StoreError
from wearlab.store.align import align


@pytest.fixture
def lives():
    """Two lives whose depth is 2 and 4 µm per million cycles.

    The second has three states and is padded.
    """
    cycle = np.array([[0.0, 1e6, 3e6, 4e6], [0.0, 1e6, 2e6, np.nan]])
    rate = np.array([2e-12, 4e-12])
    depth = rate[:, None, None] * cycle[..., None] * np.array([1.0, 0.5])
    return xr.Dataset(
        {
            "max_wear_depth": (("speed", "update", "flank"), depth, {"units": "m"}),
            "square": (("speed", "update"), cycle**2),
            "life": (("speed",), [5e6, np.nan]),
            "verdict": (("speed",), ["completed", "completed"]),
        },
        {
            "cycle": (("speed", "update"), cycle, {"units": "1"}),
            "speed": [800.0, 900.0],
            "flank": ["a", "b"],
        },
    )


def test_on_cycle(lives):
    found = align(lives, "cycle", [0.0, 1.5e6, 3e6])
    assert found.max_wear_depth.dims == ("speed", "cycle", "flank")
    np.testing.assert_allclose(found.max_wear_depth.isel(flank=0)[0], [0.0, 3e-6, 6e-6])
    np.testing.assert_allclose(
        found.max_wear_depth.isel(flank=1)[1], [0.0, 3e-6, np.nan]
    )
    assert found.square[0, 1] == 1e12 + 0.25 * (
        9e12 - 1e12
    )  # a straight line between two states
    assert (
        found.cycle.attrs["units"] == "1"
        and list(found.verdict.values) == ["completed"] * 2
    )


def test_on_cycles_that_all_runs_share(lives):
    """A grid then has one line of cycles, while its runs lie in pieces."""
    alike = lives.isel(speed=[0, 0]).assign_coords(speed=[800.0, 900.0])
    shared = alike.assign_coords(cycle=("update", alike.cycle.values[0])).chunk(speed=1)
    found = align(shared, "cycle", [0.0, 1.5e6])
    assert found.max_wear_depth.dims == ("speed", "cycle", "flank")
    np.testing.assert_allclose(found.max_wear_depth.isel(flank=0), [[0.0, 3e-6]] * 2)


def test_on_wear_depth(lives):
    found = align(lives, "wear_depth", [2e-6, 8e-6])
    np.testing.assert_allclose(found.cycle, [[1e6, 4e6], [0.5e6, 2e6]])
    assert found.wear_depth.attrs["units"] == "m"


def test_on_a_share_of_the_life(lives):
    found = align(lives, "life_fraction", [0.2, 0.8, 0.9])
    np.testing.assert_allclose(found.cycle[0], [1e6, 4e6, np.nan])
    assert np.isnan(found.cycle[1]).all()  # has no life


def test_values_are_chosen_where_none_are_given(lives):
    found = align(lives)
    assert (float(found.cycle[0]), float(found.cycle[-1]), found.sizes["cycle"]) == (
        0.0,
        4e6,
        65,
    )


def test_a_depth_that_does_not_grow_at_first(lives):
    lives["max_wear_depth"][0, 1] = 0.0
    found = align(lives.isel(speed=[0]), "wear_depth", [0.0, 3e-6])
    np.testing.assert_allclose(found.cycle[0], [0.0, 1.5e6])


@pytest.mark.parametrize(
    ("on", "at", "said"),
    [
        ("cycles", None, "'cycles' is not one of cycle, wear_depth, life_fraction"),
        ("cycle", [2.0, 1.0], "increasing"),
        ("cycle", [], "increasing"),
    ],
)
def test_what_cannot_be_aligned(lives, on, at, said):
    with pytest.raises(StoreError, match=said):
        align(lives, on, at)
    with pytest.raises(StoreError, match="no max_wear_depth"):
        align(lives.drop_vars("max_wear_depth"), "wear_depth")
    with pytest.raises(StoreError, match="no run reaches"):
        align(lives.isel(speed=[1]), "life_fraction")


def test_a_grid_stays_lazy_and_a_run_has_no_axes(fill):
    campaign = alter(sweep(3), 1, updates=5)
    store = fill(campaign)
    found = align(store.open(campaign), "cycle", [0.5e6, 3e6])
    assert found.wear_depth.chunks is not None
    first = found.wear_depth.isel(flank=0, profile=0).compute()
    np.testing.assert_allclose(
        first, [[805.0, np.nan], [905.0, 930.0], [1005.0, np.nan]]
    )
    run = align(store.run(campaign.cases[1].id), "cycle", [3e6])
    assert (
        run.wear_depth.dims == ("cycle", "flank", "profile")
        and run.wear_depth[0, 0, 0] == 930.0
    )


@pytest.fixture
def running_in():
    """Two lives that run in: h = h_end (1 − e^(−4n/N)) / (1 − e⁻⁴), few states."""
    life = np.array([1e7, 2e7])
    cycle = life[:, None] * np.array([0.0, 0.25, 1.0])
    shape = np.array([0.5, 1.0])[None, :, None] * np.linspace(0.2, 1.0, 3)
    scale = 4e-6 / (1.0 - np.exp(-4.0)) * shape[None]
    decay = np.exp(-4.0 * cycle / life[:, None])
    depth = scale * (1.0 - decay)[:, :, None, None]
    rate = scale * (4.0 / life)[:, None, None, None] * decay[:, :, None, None]
    dims = ("speed", "update", "flank", "profile")
    return xr.Dataset(
        {
            "wear_depth": (dims, depth, {"units": "m"}),
            "wear_rate": (dims, rate),
            "max_wear_depth": (dims[:3], depth.max(axis=3), {"units": "m"}),
            "life": (("speed",), life),
        },
        {"cycle": (("speed", "update"), cycle), "speed": [800.0, 900.0]},
    )


def exact(share):
    return 4e-6 * (1.0 - np.exp(-4.0 * share)) / (1.0 - np.exp(-4.0))


@pytest.mark.parametrize("chunks", [None, 1])
def test_depths_between_states_follow_the_stored_rates(running_in, chunks):
    """Was 30 % of the depth at 0.05 of the life: a straight line."""
    grid = running_in if chunks is None else running_in.chunk(speed=chunks)
    share = np.array([0.0, 0.05, 0.25, 0.6, 1.0])
    found = align(grid, "life_fraction", share)
    assert found.wear_depth.dims == ("speed", "life_fraction", "flank", "profile")
    largest = found.max_wear_depth.isel(flank=1)
    np.testing.assert_allclose(largest, [exact(share)] * 2, rtol=0.03)
    np.testing.assert_allclose(found.wear_depth.max("profile"), found.max_wear_depth)
    straight = align(grid.drop_vars("wear_rate"), "life_fraction", share)
    largest = straight.max_wear_depth.isel(flank=1)[:, 1:]
    off = np.abs(largest / exact(share[1:]) - 1.0)
    assert float(off.max()) > 0.15


def test_on_wear_depth_cycles_follow_the_stored_rates(running_in):
    share = np.array([0.05, 0.1, 0.4])
    found = align(running_in, "wear_depth", exact(share))
    assert "wear_depth" in found.dims
    np.testing.assert_allclose(found.cycle / found.life, [share] * 2, rtol=0.05)
    largest = found.max_wear_depth.isel(flank=1)
    np.testing.assert_allclose(largest, [exact(share)] * 2, rtol=1e-9)


def test_an_unknown_variable_is_refused(running_in):
    """Was left out without a word."""
    with pytest.raises(
        StoreError, match=r"no variable 'max_wear_rate'.*max_wear_depth"
    ):
        align(running_in, variables=["max_wear_depth", "max_wear_rate"])

import threading
from dataclasses import dataclass, replace

import dask
import fake_campaign
import numpy as np
import pytest
import xarray as xr
from fake_campaign import Axis, Campaign, Case, Scene, alter, sweep

from wearlab.campaign import Excluded
from wearlab.store import StoreError, reading


@dataclass(frozen=True)
class WithExcluded(Campaign):
    excluded: tuple = ()


def reads(monkeypatch):
    """Return a list that fills with every variable read from a file."""
    seen = []
    original = reading.read_variable

    def noted(path, name, sha256):
        seen.append(name)
        return original(path, name, sha256)

    monkeypatch.setattr(reading, "read_variable", noted)
    return seen


def test_sweep_axes_in_the_units_of_the_file(fill):
    campaign = sweep(3)
    grid = fill(campaign).open(campaign)
    assert grid.wear_depth.dims == ("speed", "update", "flank", "profile")
    assert grid.speed.attrs["units"] == "rpm"
    assert list(grid.speed.values) == [800.0, 900.0, 1000.0]
    assert grid.attrs["title"] == "five speeds"
    for case in campaign.cases:
        run = fake_campaign.dataset(case.scene)
        mine = grid.sel(speed=case.scene.speed)
        depth = mine.wear_depth.drop_vars(["speed", "update", "profile"]).compute()
        xr.testing.assert_equal(depth, run.wear_depth)
        assert mine.life == run.life
        assert mine.verdict == "completed"
        assert mine.run_id == case.id
    assert grid.wear_depth.attrs == {"units": "m", "display_units": "um"}


def test_opening_opens_no_file(fill, monkeypatch):
    campaign = sweep(3)
    store = fill(campaign)
    seen = reads(monkeypatch)
    grid = store.open(campaign)
    assert seen == []
    assert grid.wear_depth.chunks == ((1, 1, 1), (3,), (2,), (4,))
    grid.wear_depth.sel(speed=900).compute()
    assert seen.count("wear_depth") == 1


def test_cases_come_after_the_sweeps_and_base_first(fill):
    campaign = sweep(3, static=True)
    campaign = replace(campaign, cases=campaign.cases[::-1])
    grid = fill(campaign).open(campaign)
    assert grid.wear_depth.dims[:2] == ("speed", "case")
    assert list(grid.case.values) == ["base", "static"]


def test_an_unswept_case_is_broadcast_and_lacks_what_it_has_not(fill):
    campaign = sweep(3, static=True)
    grid = fill(campaign).open(campaign).sel(case="static").compute()
    static = fake_campaign.dataset(campaign.cases[-1].scene)
    depth = grid.wear_depth.isel(update=slice(0, 2))
    for speed in (800, 900, 1000):
        np.testing.assert_array_equal(depth.sel(speed=speed), static.wear_depth)
    assert len(set(grid.run_id.values)) == 1
    assert np.isnan(grid.dynamic_mesh_force).all()


def test_ragged_updates_are_padded(fill):
    campaign = alter(sweep(3), 1, updates=5)
    grid = fill(campaign).open(campaign).compute()
    assert list(grid.n_updates.values) == [3, 5, 3]
    assert np.isnan(grid.wear_depth.values[0, 3:]).all()
    assert np.isfinite(grid.wear_depth.values[0, :3]).all()
    assert np.isfinite(grid.wear_depth.values[1]).all()
    assert list(grid.cycle.values[1]) == [0, 1e6, 2e6, 3e6, 4e6]


@pytest.mark.parametrize("act, state", [("fail", "failed"), ("refuse", "refused")])
def test_points_without_data_are_nan_and_named(fill, act, state):
    campaign = alter(sweep(3), 1, act=act)
    grid = fill(campaign).open(campaign).compute()
    assert list(grid.status.values) == ["done", state, "done"]
    assert grid.attrs["missing"] == [f"speed=900: {state}"]
    assert np.isnan(grid.wear_depth.values[1]).all()
    assert np.isnan(grid.count_steps.values[1])
    assert grid.verdict.values[1] == ""
    assert list(grid.n_updates.values) == [3, 0, 3]


def test_points_never_computed_are_missing(fill):
    store = fill(sweep(2))
    grid = store.open(sweep(3))
    assert list(grid.status.values) == ["done", "done", "missing"]
    assert grid.attrs["missing"] == ["speed=1000: missing"]


def test_numbers_without_holes_keep_their_type(fill):
    grid = fill(sweep(2)).open(sweep(2)).compute()
    assert grid.count_steps.dtype == np.int64
    assert grid.converged.dtype == bool


def test_one_run_has_no_grid_dims(fill):
    campaign = Campaign((Case("base", Scene()),))
    grid = fill(campaign).open(campaign).compute()
    run = fake_campaign.dataset(Scene())
    xr.testing.assert_equal(grid[list(run)].drop_vars(["update", "profile"]), run)


def test_cases_without_sweeps_stand_alone(fill):
    campaign = Campaign(
        (Case("slow", Scene(speed=1.0)), Case("fast", Scene(speed=2.0)))
    )
    grid = fill(campaign).open(campaign)
    assert dict(grid.wear_depth.sizes)["case"] == 2
    assert grid.wear_depth.sel(case="fast")[0, 0, 0] == 2.0


def test_keys_that_advance_together_are_coordinates(fill):
    together = {"torque": Axis("torque", (300.0, 200.0), "N*m", "operation.torque")}
    campaign = sweep(2)
    campaign = replace(
        campaign, axes=(replace(campaign.axes[0], coordinates=together),)
    )
    grid = fill(campaign).open(campaign)
    assert grid.torque.dims == ("speed",)
    assert grid.torque.attrs["units"] == "N*m"
    assert grid.torque.sel(speed=900) == 200.0


def test_two_axes_with_a_point_left_out(fill):
    torque = Axis("torque", (100.0, 200.0), "N*m", "operation.torque")
    cases = tuple(
        Case("base", Scene(speed=10 * i + j), {"torque": j, "speed": i})
        for i in range(3)
        for j in range(2)
        if (i, j) != (2, 1)
    )
    campaign = Campaign(cases, (*sweep(3).axes, torque))
    grid = fill(campaign).open(campaign)
    assert grid.wear_depth.dims[:2] == ("speed", "torque")
    assert grid.status.values[2, 1] == ""
    assert grid.attrs["missing"] == []
    np.testing.assert_array_equal(
        grid.wear_depth[:, :, 0, 0, 0], [[0, 1], [10, 11], [20, np.nan]]
    )


def test_labels_place_values_by_name(fill, monkeypatch):
    """A run that has the flanks in another order, or only one, still
    lands under the right name.
    """
    original = fake_campaign.simulate

    def turned(scene):
        data = original(scene)
        if scene.speed == 900:
            return data.isel(flank=[1, 0])
        return data.isel(flank=[1]) if scene.speed == 1000 else data

    monkeypatch.setattr(fake_campaign, "simulate", turned)
    grid = fill(sweep(3)).open(sweep(3))
    assert list(grid.flank.values) == ["pinion", "gear"]
    first = grid.wear_depth[:, 0, :, 0].values
    np.testing.assert_array_equal(first, [[800, 801], [900, 901], [np.nan, 1001]])


def test_coordinates_that_all_runs_share_have_no_grid_dims(fill):
    grid = fill(sweep(3)).open(sweep(3))
    assert grid.characteristic_point.dims == ("profile",)
    assert list(grid.characteristic_point.values) == ["A", "C", "", "E"]
    assert grid.phase.dims == ("phase",)


def test_a_dimension_coordinate_that_differs_is_kept_beside(fill, monkeypatch):
    original = fake_campaign.simulate
    monkeypatch.setattr(
        fake_campaign,
        "simulate",
        lambda scene: (d := original(scene)).assign_coords(phase=d.phase + scene.speed),
    )
    grid = fill(sweep(2)).open(sweep(2))
    assert grid.phase_values.dims == ("speed", "phase")
    assert list(grid.phase_values[:, 0].values) == [800.0, 900.0]


def test_threads_read_safely(fill):
    """Many threads, garbage collected at the worst moments: no crash."""
    campaign = sweep(8)
    store = fill(campaign)
    with dask.config.set(scheduler="threads", num_workers=8):
        grids = [store.open(campaign) for _ in range(4)]
        results = []
        threads = [
            threading.Thread(target=lambda g=g: results.append(g.compute()))
            for g in grids
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for result in results:
        np.testing.assert_array_equal(
            result.wear_depth[:, 0, 0, 0], 800 + 100 * np.arange(8)
        )
    assert len(results) == 4


def test_a_store_without_the_campaign(fill, store):
    with pytest.raises(StoreError, match="there is no store here"):
        store.open(sweep(2))
    grid = fill(sweep(1)).open(alter(sweep(1), 0, speed=5.0))
    assert list(grid.status.values) == ["missing"]
    assert set(grid.data_vars) == {"status", "reason", "run_id", "n_updates"}


def test_points_without_data_say_why(fill):
    campaign = alter(alter(sweep(4), 1, act="fail"), 2, act="refuse")
    left_out = Excluded("base", {"speed": 3}, "speed > 1050 rpm")
    campaign = WithExcluded(campaign.cases[:3], campaign.axes, excluded=(left_out,))
    grid = fill(campaign).open(campaign)
    assert list(grid.status.values) == ["done", "failed", "refused", "excluded"]
    assert list(grid.reason.values)[::3] == ["", "speed > 1050 rpm"]
    assert grid.reason.values[1] == "FloatingPointError: the shooting did not converge"
    assert "contact ratio 0.93" in grid.reason.values[2]
    assert grid.attrs["missing"] == ["speed=900: failed", "speed=1000: refused"]


def test_a_file_of_another_length_is_refused(fill):
    campaign = sweep(2)
    store = fill(campaign)
    path = store.archive.files.path(campaign.cases[1].id)
    path.write_bytes(path.read_bytes() + b"\0")
    grid = store.open(campaign)
    assert np.isfinite(grid.wear_depth.isel(speed=0).compute()).all()
    with pytest.raises(StoreError, match=r"is not what was written.*wearlab verify"):
        grid.wear_depth.compute()
    path.unlink()
    with pytest.raises(StoreError, match="cannot be read"):
        grid.wear_depth.compute()


@pytest.mark.parametrize(
    "index",
    [
        np.s_[1, :, 0, 2],
        np.s_[-1, -1],
        np.s_[1:3, 0:2, :, ::2],
        np.s_[[2, 0], :, 1],
        np.s_[..., 1],
    ],
)
def test_any_part_of_a_grid_is_what_the_whole_has_there(fill, index):
    campaign = alter(sweep(4), 1, updates=5)
    grid = fill(campaign).open(campaign)
    np.testing.assert_array_equal(
        grid.wear_depth[index].compute(), grid.wear_depth.compute()[index]
    )


def test_a_grid_is_saved_as_it_is(fill, tmp_path):
    campaign = alter(sweep(3, static=True), 1, act="fail")
    grid = fill(campaign).open(campaign)
    whole = grid.compute()
    grid.to_netcdf(tmp_path / "grid.nc")
    with xr.open_dataset(tmp_path / "grid.nc") as saved:
        xr.testing.assert_equal(saved.load(), whole)
    pytest.importorskip("zarr")
    grid.to_zarr(tmp_path / "grid.zarr", mode="w", zarr_format=2)
    xr.testing.assert_equal(
        xr.open_zarr(tmp_path / "grid.zarr", mask_and_scale=False).compute(), whole
    )


def test_texts_of_runs_are_texts_and_need_no_file(fill, monkeypatch):
    campaign = alter(sweep(3, static=True), 1, act="fail")
    store = fill(campaign)
    seen = reads(monkeypatch)
    grid = store.open(campaign)
    assert {type(text) for text in grid.verdict.values.ravel()} == {str}
    assert set(grid.groupby("verdict").groups) == {"", "completed"}
    assert grid.verdict.str.startswith("comp").sum() == 5
    assert seen == []
    by_verdict = grid[["life", "verdict"]].groupby("verdict").mean()
    done = grid.life.where(grid.verdict == "completed").mean()
    assert by_verdict.life.sel(verdict="completed") == done


def test_one_text_of_a_lazy_variable_is_no_array(fill):
    store = fill(sweep(1))
    (run,) = store.archive.entries([sweep(1).cases[0].id]).values()
    file = reading.RunFile(str(store.archive.files.path(run.id)), run.sha256, 0)
    numbers = np.zeros(1, np.intp)
    text = reading.LazyVariable(
        "verdict", numbers, [file], {0: ()}, (), np.dtype(object), ""
    )
    assert isinstance(text[:1][0], str)


def test_grids_of_two_stores_are_concatenated(fill, tmp_path):
    """Each run keeps its own wear states, whatever the lengths of the others."""
    one = sweep(2)
    other = alter(sweep(3), 2, updates=5)
    grid = fill(other).open(other)
    both = xr.concat(
        [fill(one).open(one), grid.isel(speed=[2])],
        "speed",
        join="outer",
        coords="different",
        compat="equals",
    )
    np.testing.assert_array_equal(both.cycle.transpose("speed", "update"), grid.cycle)
    np.testing.assert_array_equal(both.wear_depth, grid.wear_depth)
    assert list(both["update"]) == [0, 1, 2, 3, 4] and list(both.n_updates) == [3, 3, 5]


def test_what_is_missing_does_not_flood(fill):
    grid = fill(sweep(1)).open(sweep(9))
    assert grid.attrs["missing"][0] == "speed=900: missing"
    assert (
        len(grid.attrs["missing"]) == 6
        and grid.attrs["missing"][-1] == "and 3 more, by status"
    )


def test_swept_keys_are_named(fill):
    campaign = sweep(2)
    axis = replace(campaign.axes[0], key="wear.coefficient.value")
    assert (
        fill(campaign).open(replace(campaign, axes=(axis,))).speed.attrs["long_name"]
        == "wear coefficient"
    )

"""One file per campaign: the grid, point by point, readable by
anybody, written run by run.
"""

import threading
import tracemalloc
import warnings
from dataclasses import replace

import dask
import netCDF4
import numpy as np
import pytest
import xarray as xr
from fake_campaign import Axis, Campaign, Case, Scene, sweep

from wearlab.store import StoreError
from wearlab.store.export import export, export_attributes


def two_axes() -> Campaign:
    """Two speeds by two lengths of life, the last point failing."""
    cases = [
        Case(
            "base",
            Scene(speed=v, updates=n, act="fail" if (i, j) == (1, 1) else "finish"),
            {"speed": i, "n": j},
        )
        for i, v in enumerate((800.0, 900.0))
        for j, n in enumerate((2, 4))
    ]
    return Campaign(
        tuple(cases), (Axis("speed", (800.0, 900.0), "rpm"), Axis("n", (2, 4)))
    )


def same(grid: xr.Dataset, found: xr.Dataset) -> None:
    grid = grid.compute(scheduler="synchronous")
    for name in grid.variables:
        a = grid[name].values
        b = found[name].values
        assert grid[name].dims == found[name].dims, name
        if a.dtype.kind in "OU":
            assert a.astype(object).tolist() == b.astype(object).tolist(), name
        else:
            np.testing.assert_array_equal(a, b, str(name))
        units = grid[name].attrs.get("units")
        assert found[name].attrs.get("units") == units, name


@pytest.mark.parametrize(
    "campaign",
    [sweep(3, static=True), sweep(1), two_axes(), Campaign(sweep(1).cases[:1])],
)
def test_the_file_is_the_grid(campaign, fill, tmp_path):
    if not campaign.axes:
        campaign = replace(campaign, cases=(replace(campaign.cases[0], position={}),))
    store = fill(campaign)
    told = []
    export(campaign, store, tmp_path / "out.nc", told.append)
    with xr.open_dataset(tmp_path / "out.nc") as found:
        same(store.open(campaign), found.load())
    done = {i for i, e in store.archive.entries().items() if e.state == "done"}
    assert set(told) == done
    assert [path.name for path in tmp_path.iterdir() if path.name != "store"] == [
        "out.nc"
    ]


def test_readable_with_netcdf4_alone(fill, tmp_path):
    campaign = replace(sweep(2, static=True), title="five speeds µ")
    object.__setattr__(
        campaign,
        "metadata",
        {"author": "Ada", "orcid": "https://orcid.org/0", "licence": "CC-BY-4.0"},
    )
    store = fill(replace(campaign, cases=(*campaign.cases[:1], campaign.cases[2])))
    export(campaign, store, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert file.Conventions == "CF-1.11, ACDD-1.3" and file.title == "five speeds µ"
        assert (
            file.creator_name == "Ada"
            and file.creator_url
            and file.license == "CC-BY-4.0"
        )
        assert file.references.startswith("doi:") and "sources abc" in file.source
        assert file.missing == "speed=900, case=base: missing"
        assert file["speed"].units == "rpm" and file["wear_depth"].units == "m"
        assert file["wear_depth"].filters()["zlib"] and file["wear_depth"].chunking()[
            :2
        ] == [1, 1]
        assert (
            file["run_id"][0, 0] == campaign.cases[0].id
            and file["status"][1, 0] == "missing"
        )
        assert '"speed": 800.0' in str(file["scene"][0, 0])
        assert str(file["scene"][1, 0]) == ""
        assert np.isnan(file["wear_depth"][1, 0].filled(np.nan)).all()


def test_a_file_names_whom_the_campaign_names_and_invents_nobody(fill, tmp_path):
    """ACDD 1.3; who is no part of an id, which runs it holds is."""
    campaign = sweep(2)
    nobody = export_attributes(campaign, store := fill(campaign))
    asked = {
        "creator_name",
        "creator_email",
        "publisher_name",
        "project",
        "acknowledgement",
        "license",
    }
    assert (
        not asked & set(nobody)
        and nobody["processing_level"] == "model output: computed, not measured"
    )
    who = {
        "author": "A; B",
        "email": "a@b.org",
        "publisher": "P",
        "project": "Q",
        "acknowledgement": "R",
    }
    object.__setattr__(named := sweep(2), "metadata", who | {"licence": "CC0-1.0"})
    somebody = export_attributes(named, store)
    assert [somebody[key] for key in sorted(asked)] == [
        "R",
        "a@b.org",
        "A; B",
        "CC0-1.0",
        "Q",
        "P",
    ]
    assert nobody["id"] == somebody["id"] != export_attributes(sweep(1), store)["id"]


def test_the_same_store_gives_the_same_content(fill, tmp_path):
    store = fill(sweep(2))
    one = export(sweep(2), store, tmp_path / "a.nc")
    two = export(sweep(2), store, tmp_path / "b.nc")
    xr.testing.assert_identical(xr.load_dataset(one), xr.load_dataset(two))


def test_memory_holds_one_run(fill, tmp_path):
    few = replace(sweep(2, updates=4000), title=str(2))
    many = replace(sweep(10, updates=4000), title=str(10))
    store = fill(many)
    peaks = []
    for campaign in (few, few, many):  # the first warms imports up
        tracemalloc.start()
        export(campaign, store, tmp_path / "out.nc")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    run = store.run(many.cases[0].id).nbytes
    assert peaks[2] - peaks[1] < 2 * run


def test_one_thread_reads_while_the_file_is_open(fill, tmp_path, monkeypatch):
    """Two files of HDF5 open in one process, one read by dask's
    threads, have crashed it.
    """
    from wearlab.store import reading

    threads = []

    def noted(path, name, sha256):
        threads.append(threading.get_ident())
        return read_variable(path, name, sha256)

    read_variable = reading.read_variable
    monkeypatch.setattr(reading, "read_variable", noted)
    with dask.config.set(scheduler="threads"):
        export(two_axes(), fill(two_axes()), tmp_path / "out.nc")
    assert threads and set(threads) == {threading.get_ident()}


def test_zarr(fill, tmp_path):
    pytest.importorskip("zarr")
    store = fill(two_axes())
    export(two_axes(), store, tmp_path / "out.zarr")
    with xr.open_zarr(tmp_path / "out.zarr", chunks=None) as found:
        scenes = [
            store.archive.entries([i])[i].scene if i else ""
            for i in found["run_id"].values.ravel()
        ]
        assert found["scene"].values.ravel().tolist() == scenes and any(scenes)
        same(store.open(two_axes()), found.load())
        assert found.attrs["Conventions"] == "CF-1.11, ACDD-1.3"


@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_texts_survive_what_xarray_does_with_two_exports(fill, tmp_path, ending):
    """A width kept with a text would cut a longer one: "überlast" became "ü"."""
    pytest.importorskip("zarr")
    opened = xr.open_zarr if ending == "zarr" else xr.open_dataset
    pieces = []
    for label in ("ü", "überlast"):
        campaign = Campaign((Case(label, Scene(speed=800.0), {"case": 0}),))
        campaign = replace(campaign, axes=(Axis("case", (label,)),))
        path = export(campaign, fill(campaign), tmp_path / f"{len(pieces)}.{ending}")
        pieces.append(opened(path).load())

    joined = xr.concat(pieces, "case", data_vars="all", join="outer")
    again = tmp_path / f"joined.{ending}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names of dimensions, of consolidation
        getattr(joined, "to_zarr" if ending == "zarr" else "to_netcdf")(again)
    assert [str(label) for label in opened(again)["case"].values] == ["ü", "überlast"]


def test_nothing_half_written_remains(fill, tmp_path):
    store = fill(sweep(2))
    path = store.archive.files.path(sweep(2).cases[1].id)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(StoreError, match="is not what was written"):
        export(sweep(2), store, tmp_path / "out.nc")
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(StoreError, match="cannot be written"):
        export(sweep(1), store, tmp_path / "file" / "out.nc")
    assert {path.name for path in tmp_path.iterdir()} == {"store", "file"}

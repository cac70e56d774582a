"""Runs read for an update: the arrays of their files, checked, with the catalogue's dims and labels."""

import made_up
import numpy as np
import pytest
import xarray as xr

from wearlab.store import Store, StoreError
from wearlab.updating.run_curves import read_runs, variables_of

NAMES = ("cycle", "max_wear_depth", "wear_depth", "no such variable")


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "store")
    store.create()
    made_up.put(store, "a" * 20, made_up.run(800.0))
    made_up.put(store, "b" * 20, None)
    yield store
    store.close()


def test_what_is_read_is_what_the_dataset_has(store):
    found = read_runs(store, ["a" * 20, "b" * 20, "c" * 20], NAMES)
    assert list(found) == ["a" * 20]
    run, whole = found["a" * 20], variables_of(store.run("a" * 20))
    assert "no such variable" not in run
    for name in NAMES[:-1]:
        np.testing.assert_array_equal(run[name].values, whole[name].values)
        assert (run[name].dims, run[name].labels) == (whole[name].dims, whole[name].labels)


def test_an_altered_file_is_refused(store):
    path = store.files.path("a" * 20)
    image = bytearray(path.read_bytes())
    image[len(image) // 2] ^= 1
    path.write_bytes(image)
    with pytest.raises(StoreError, match="is not what was written"):
        read_runs(store, ["a" * 20], NAMES)


def test_places_and_largest_values_are_those_of_xarray():
    data = xr.Dataset(
        {"h": (("update", "flank"), [[1.0, np.nan], [np.nan, np.nan], [2.0, 3.0]])},
        {"flank": ["pinion", "gear"]},
    )
    one = variables_of(data)["h"]
    np.testing.assert_array_equal(one.largest("flank").values, data.h.max("flank"))
    np.testing.assert_array_equal(one.at("flank", 1).values, data.h.sel(flank="gear"))
    assert one.at("flank", 1).dims == ("update",)
    assert one.at("flank", [1]).dims == ("update", "flank")
    assert one.known("flank") == ["pinion", "gear"]
    assert one.known("update") == [0, 1, 2]

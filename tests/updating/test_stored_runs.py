"""Runs read for an update: the arrays of their files, checked, with the catalogue's
dims and labels.
"""

import made_up
import numpy as np
import pytest

from wearlab.store import Store, StoreError
from wearlab.updating.run_curves import read_runs

NAMES = ("cycle", "max_wear_depth", "wear_depth", "no such variable")


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "store")
    store.archive.create()
    made_up.put(store, "a" * 20, made_up.run(800.0))
    made_up.put(store, "b" * 20, None)
    yield store
    store.close()


def test_what_is_read_is_what_the_dataset_has(store):
    found = read_runs(store, ["a" * 20, "b" * 20, "c" * 20], NAMES)
    assert list(found) == ["a" * 20]
    run = found["a" * 20]
    whole = store.run("a" * 20)
    assert "no such variable" not in run
    for name in NAMES[:-1]:
        np.testing.assert_array_equal(run[name].values, whole[name].values)
        labels = [dim for dim in whole[name].dims if dim in whole.coords]
        assert run[name].dims == whole[name].dims
        assert [dim for dim in run[name].dims if dim in run.coords] == labels
        assert all(
            run[dim].values.tolist() == whole[dim].values.tolist() for dim in labels
        )


def test_an_altered_file_is_refused(store):
    path = store.archive.files.path("a" * 20)
    image = bytearray(path.read_bytes())
    image[len(image) // 2] ^= 1
    path.write_bytes(image)
    with pytest.raises(StoreError, match="is not what was written"):
        read_runs(store, ["a" * 20], NAMES)

import hashlib
import io
import json

import fake_campaign
import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr

from wearlab.store import StoreError
from wearlab.store.description import describe
from wearlab.store.netcdf import sealed, to_image
from wearlab.store.reading import read_run, read_variable

DATA = fake_campaign.dataset(fake_campaign.Scene())


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.nc"
    path.write_bytes(to_image(DATA)[0])
    return path


def test_a_file_is_no_longer_than_its_content():
    data = xr.Dataset(
        {"a": ("x", np.arange(9.0)), "b": ("y", np.arange(20_000) % 7)},
        {"t": ("x", ["m"] * 9)},
    )
    image, _ = to_image(data)
    assert h5py.File(io.BytesIO(image), "r").id.get_filesize() == len(image)
    with netCDF4.Dataset("memory", memory=image) as file:
        assert file["a"][:].tolist() == list(range(9)) and file["b"][-1] == 19_999 % 7
        assert file["t"][:].tolist() == ["m"] * 9


def test_tables_of_texts_are_read_again(tmp_path):
    """They are no echo of one another, however many: a stranger's file is asked for
    what each takes.
    """
    words = np.array([[f"word {i} {j}" for j in range(30)] for i in range(40)], object)
    data = xr.Dataset(
        {"words": (("x", "y"), words), "one": ((), "α" * 400_000)}, attrs={"a": "µ"}
    )
    path = tmp_path / "run.nc"
    path.write_bytes(to_image(data)[0])
    xr.testing.assert_equal(read_run(path), data)


def test_an_image_is_the_dataset(file):
    xr.testing.assert_identical(read_run(file), sealed(DATA))
    file.unlink()  # closed: nothing holds it


def test_the_hash_is_that_of_the_bytes():
    image, sha256 = to_image(DATA)
    assert hashlib.sha256(image).hexdigest() == sha256


def test_readable_without_xarray():
    with netCDF4.Dataset("memory", memory=to_image(DATA)[0]) as file:
        assert file["wear_depth"].dtype == np.float64
        assert file["wear_depth"].chunking() == "contiguous"
        assert file["wear_depth"].units == "m" and np.isnan(
            file["wear_depth"]._FillValue
        )
        assert "cycle" in file["wear_depth"].coordinates.split()
        assert list(file["flank"][:]) == ["pinion", "gear"]


def test_arrays_carry_checksums_but_for_tiny_ones():
    """HDF5 needs 2 kB to keep a chunk: sixty arrays with less in them
    made a run a third larger.
    """
    data = xr.Dataset(
        {"whole": ("x", np.arange(1024.0)), "tiny": ("y", np.arange(100.0))}
    )
    image, _ = to_image(data)
    with netCDF4.Dataset("memory", memory=image) as file:
        assert (
            file["whole"].filters()["fletcher32"]
            and not file["whole"].filters()["zlib"]
        )
        assert (
            file["whole"].chunking() == [1024]
            and file["tiny"].chunking() == "contiguous"
        )
    damaged = bytearray(image)
    damaged[image.index(np.arange(1024.0).tobytes()) + 800] ^= 1
    with (
        netCDF4.Dataset("memory", memory=bytes(damaged)) as file,
        pytest.raises(RuntimeError),
    ):
        file["whole"][:]


def test_large_variables_are_deflated_and_read_again(tmp_path):
    values = (np.arange(40_000.0) % 7).reshape(4, 10_000)
    data = xr.Dataset({"large": (("a", "b"), values)})
    image = to_image(data)[0]
    (tmp_path / "large.nc").write_bytes(image)
    np.testing.assert_array_equal(read_run(tmp_path / "large.nc").large, values)
    with netCDF4.Dataset("memory", memory=image) as file:
        assert (
            file["large"].filters()["zlib"] is True
            and file["large"].filters()["complevel"] == 1
        )
        np.testing.assert_array_equal(file["large"][:], values)
    assert len(image) < 0.8 * values.nbytes


@pytest.mark.parametrize(
    "values",
    [
        *(
            np.array([1.5, np.nan, np.inf]),
            np.array([1, 2, 3]),
            np.array([True, False, True]),
        ),
        *(
            np.array(["Größe", "", "x"]),
            np.zeros(0),
            np.array(3.5),
            np.array("word"),
            np.array(True),
        ),
        np.arange(6, dtype=np.int32).reshape(2, 3).T,
    ],
)
def test_values_are_those_that_xarray_would_write(values, tmp_path):
    dims = tuple("abc"[: values.ndim])
    data = xr.Dataset(
        {"v": (dims, values, {"units": "m", "note": "µ"})}, attrs={"title": "Größe"}
    )
    (tmp_path / "ours.nc").write_bytes(to_image(data)[0])
    data.to_netcdf(tmp_path / "theirs.nc", engine="netcdf4")
    ours = read_run(tmp_path / "ours.nc")
    theirs = read_run(tmp_path / "theirs.nc")
    ours.attrs.pop("content_sha256", None)
    xr.testing.assert_identical(ours, theirs)
    assert ours.v.dtype == theirs.v.dtype


def test_one_variable_at_a_time(file):
    np.testing.assert_array_equal(
        read_variable(str(file), "wear_depth"), DATA.wear_depth
    )
    assert read_variable(str(file), "verdict") == "completed"
    assert read_variable(str(file), "life") == DATA.life


def test_a_file_replaced_is_read_anew(file):
    read_variable(str(file), "life")
    image, _ = to_image(DATA.assign(life=((), 42.0)))
    file.with_suffix(".new").write_bytes(image)
    file.with_suffix(".new").replace(file)
    assert read_variable(str(file), "life") == 42.0


def test_a_damaged_file_names_itself(file):
    file.write_bytes(file.read_bytes()[:1000])
    for read in (lambda: read_run(file), lambda: read_variable(str(file), "life")):
        with pytest.raises(StoreError, match=r"run\.nc.*wearlab verify"):
            read()


def test_the_description_is_plain_and_complete():
    description = describe(DATA)
    layout = json.loads(description["layout"])
    assert description["sizes"] == {"update": 3, "flank": 2, "profile": 4, "phase": 8}
    assert set(layout["variables"]) == set(map(str, DATA.variables))
    assert layout["variables"]["wear_depth"]["dims"] == ["update", "flank", "profile"]
    assert layout["variables"]["wear_depth"]["attrs"] == {
        "units": "m",
        "display_units": "um",
    }
    assert layout["labels"]["flank"] == ["pinion", "gear"]
    assert description["summary"]["life"] == float(DATA.life)
    assert description["summary"]["max_wear_depth"] == float(DATA.max_wear_depth.max())
    assert description["summary"]["error_estimate_wear"] == 1e-4
    assert description["summary"]["verdict"] == "completed"
    assert description["summary"]["converged"] is True


def test_what_is_not_finite_stays_json():
    summary = describe(
        DATA.assign(life=((), np.inf), max_wear_depth=DATA.max_wear_depth * np.nan)
    )["summary"]
    assert summary["life"] is None
    assert summary["max_wear_depth"] is None
    json.dump(summary, io.StringIO(), allow_nan=False)


def test_digests_tell_equal_coordinates_from_different_ones():
    other = describe(fake_campaign.dataset(fake_campaign.Scene(speed=5, updates=2)))[
        "digests"
    ]
    mine = describe(DATA)["digests"]
    assert mine["characteristic_point"] == other["characteristic_point"]
    assert mine["cycle"] != other["cycle"]

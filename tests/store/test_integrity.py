"""Content is compared with its hash at the first reading: a changed
file is never read in silence.
"""

import os
import random

import fake_campaign
import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from fake_campaign import sweep

from wearlab.store import StoreError, reading
from wearlab.store.description import describe
from wearlab.store.netcdf import to_image
from wearlab.store.reading import read_run, read_variable

DATA = fake_campaign.dataset(fake_campaign.Scene())


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.nc"
    image, sha256 = to_image(DATA)
    path.write_bytes(image)
    return path, sha256


def flip(path, bit):
    """Change one bit in place, leaving length, inode and time of
    modification as they are.
    """
    status = path.stat()
    with path.open("r+b") as opened:
        opened.seek(bit // 8)
        (byte,) = opened.read(1)
        opened.seek(bit // 8)
        opened.write(bytes([byte ^ 1 << bit % 8]))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def test_no_flipped_bit_is_read_in_silence(file):
    path, sha256 = file
    dice = random.Random(4)
    for _ in range(60):
        bit = dice.randrange(8 * path.stat().st_size)
        flip(path, bit)
        for read in (
            lambda: read_run(path, sha256),
            lambda: read_variable(str(path), "wear_depth", sha256),
        ):
            with pytest.raises(
                StoreError, match=r"is not what was written.*wearlab verify"
            ):
                read()
        flip(path, bit)
        np.testing.assert_array_equal(
            read_variable(str(path), "wear_depth", sha256), DATA.wear_depth
        )


def test_a_file_is_hashed_once_until_it_changes(file, monkeypatch):
    path, sha256 = file
    hashed = []
    original = reading.checked_bytes
    monkeypatch.setattr(
        reading,
        "checked_bytes",
        lambda *words: hashed.append(words) or original(*words),
    )
    for _ in range(3):
        read_variable(str(path), "life", sha256)
        read_variable(str(path), "verdict", sha256)
    assert len(hashed) == 1
    os.utime(path)
    read_variable(str(path), "life", sha256)
    assert len(hashed) == 2
    flip(path, 77)  # the time of modification is set back; that of the change cannot be
    with pytest.raises(StoreError, match="is not what was written"):
        read_variable(str(path), "life", sha256)
    with pytest.raises(StoreError, match="is not what was written"):
        read_variable(str(path), "life", sha256)


def test_every_way_to_read_a_run_looks(fill, tmp_path):
    from wearlab.store.export import export

    store = fill(sweep(2))
    case = sweep(2).cases[1]
    grid = store.open(sweep(2)).load()
    path = store.archive.files.path(case.id)
    flip(path, 8 * path.stat().st_size // 2)
    with pytest.raises(StoreError, match="is not what was written"):
        store.run(case.id)
    for name in grid.data_vars:
        if (
            grid[name].dims[:1] == ("speed",)
            and store.open(sweep(2))[name].chunks is not None
        ):
            with pytest.raises(StoreError, match="is not what was written"):
                store.open(sweep(2))[name].load()
    with pytest.raises(StoreError, match="is not what was written"):
        export(sweep(2), store, tmp_path / "out.nc")
    np.testing.assert_array_equal(
        store.open(sweep(2)).wear_depth[0], grid.wear_depth[0]
    )


# -- structures that no run has
# -----------------------------------------------------------------------------


def elsewhere(file, tmp_path):
    (tmp_path / "secret").write_bytes(b"0" * 80)
    file.create_dataset(
        "life", (10,), "f8", external=[(str(tmp_path / "secret"), 0, 80)]
    )


def virtual(file, tmp_path):
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("other.nc", "life", (3,))
    file.create_virtual_dataset("life", layout)


def soft(file, tmp_path):
    file["life"] = h5py.SoftLink("/nowhere")


def external(file, tmp_path):
    file["life"] = h5py.ExternalLink("other.nc", "life")


def circle(file, tmp_path):
    group = file.create_group("a")
    group["life"] = group


def deep(file, tmp_path):
    for _ in range(100):
        file = file.create_group("a")


def references(file, tmp_path):
    file.create_dataset("life", (1,), h5py.ref_dtype)[0] = file.ref


def compound(file, tmp_path):
    file["life"] = np.zeros(3, [("a", "f8"), ("b", "i4")])


def of_type(file, tmp_path):
    file["life"] = np.dtype("f8")


def ragged(file, tmp_path):
    file.create_dataset("life", (2,), h5py.vlen_dtype(np.float64))


@pytest.mark.parametrize(
    "make",
    [
        elsewhere,
        virtual,
        soft,
        external,
        circle,
        deep,
        references,
        compound,
        of_type,
        ragged,
    ],
)
def test_untrusted_structures_are_refused(tmp_path, make):
    path = tmp_path / "run.nc"
    with h5py.File(path, "w") as made:
        make(made, tmp_path)
    for read in (lambda: read_run(path), lambda: read_variable(str(path), "life")):
        with pytest.raises(StoreError) as caught:
            read()
        assert str(caught.value).startswith(str(path)) and len(str(caught.value)) < 400


def test_no_attribute_makes_a_reader_fall(tmp_path):
    """Attributes may say anything: what xarray would trip over ends in one message."""
    path = tmp_path / "run.nc"
    for name, value in (
        ("units", "fortnights since the flood"),
        ("scale_factor", "x"),
        ("_FillValue", np.array([1.0, 2.0])),
        ("coordinates", "life life life /etc/passwd"),
        ("calendar", "lunar"),
        ("dtype", "object"),
        ("missing_value", "none"),
        ("long_name", "\x00" * 100),
    ):
        with netCDF4.Dataset(path, "w") as made:
            made.createDimension("x", 3)
            variable = made.createVariable("life", "f8", ("x",))
            variable[:] = 1.0
            if name != "_FillValue":
                variable.setncattr(name, value)
        try:
            read_run(path)
        except StoreError as error:
            assert str(path) in str(error)
        read_variable(str(path), "life")


def test_a_sound_run_is_what_the_catalogue_says_whatever_the_order_in_memory():
    """A mean over another order of memory was told as altered by verify."""
    waves = 4e8 + 1e8 * np.random.default_rng(3).random((40, 3, 256))
    attributes = {"units": "N m-1"}
    means = []
    for order in ("C", "F"):
        values = np.asarray(waves, order=order)
        stiffness = (("update", "mesh", "phase"), values, attributes)
        described = describe(xr.Dataset({"mesh_stiffness": stiffness}))
        means.append(described["summary"]["mesh_stiffness_mean"])
    assert means[0] == means[1]

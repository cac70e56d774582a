"""The seal inside a file: unmoved by storing, broken by any change."""

import numpy as np
import pytest
import xarray as xr

from wearlab.store.netcdf import (
    SEAL,
    content_hash,
    is_intact,
    results_hash,
    sealed,
    to_image,
)

DATA = xr.Dataset(
    {
        "wear_depth": (
            ("update", "flank"),
            np.array([[0.0, 1e-6], [np.nan, -0.0]]),
            {"units": "m"},
        ),
        "count": ((), np.int64(3)),
        "verdict": ((), "completed µ"),
        "run_time_total": ((), 1.5),
    },
    coords={
        "flank": ["pinion", "gear"],
        "phase": ("phase", np.arange(4) / 4),
        "update": [0, 1],
    },
    attrs={
        "id": "abc",
        "parents": "",
        "model_version": "1",
        "date_created": "2026",
        "n": 3,
        "x": 0.1,
    },
)


def stored(data, tmp_path):
    (tmp_path / "run.nc").write_bytes(to_image(data)[0])
    return xr.load_dataset(tmp_path / "run.nc")


def test_storing_leaves_the_seal_intact(tmp_path):
    back = stored(DATA, tmp_path)
    assert back.attrs[SEAL] == content_hash(DATA)
    assert is_intact(back) is True
    assert is_intact(DATA) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.assign(count=((), np.int64(4))),
        lambda d: d.assign(verdict=((), "failed")),
        lambda d: d.assign_attrs(n=4),
        lambda d: d.assign_attrs(more="x"),
        lambda d: d.drop_vars("count"),
        lambda d: d.rename(count="counts"),
        lambda d: d.assign_coords(phase=d.phase + 1e-16 * np.arange(4)),
        lambda d: d.assign(wear_depth=d.wear_depth.assign_attrs(units="mm")),
        lambda d: d.assign(wear_depth=d.wear_depth * (1 + 1e-15)),
        lambda d: d.assign_coords(flank=["gear", "pinion"]),
    ],
)
def test_any_change_breaks_it(change, tmp_path):
    assert is_intact(change(stored(DATA, tmp_path))) is False


def test_results_are_the_same_whenever_they_were_computed():
    again = DATA.assign(run_time_total=((), 9.9)).assign_attrs(date_created="2027")
    assert content_hash(again) == content_hash(DATA)
    elsewhere = again.assign_attrs(machine="other")
    assert content_hash(elsewhere) != content_hash(DATA)
    assert results_hash(sealed(elsewhere)) == results_hash(DATA)
    assert results_hash(DATA.assign(count=((), np.int64(4)))) != results_hash(DATA)

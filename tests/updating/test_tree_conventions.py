"""Every group of an update holds under a checker that is not ours.

CF's checker knows no groups.
"""

import netCDF4
import pytest
import xarray as xr
from conventions import check
from test_fleet import ROWS, fleet

from wearlab.store import Store
from wearlab.store.updates import update_files
from wearlab.updating import update

pytest.importorskip("compliance_checker")


@pytest.mark.filterwarnings("ignore")
def test_groups_of_an_update_hold_to_conventions(campaign, store, tmp_path):
    tree = update(campaign, store, replay=True, check=2, progress=False)
    path = update_files(store).path(str(tree.attrs["id"]))
    assert {"calibration", "virtual_inspection"} < set(tree.children)
    held_to_conventions(tree, path, tmp_path)


def held_to_conventions(tree, path, tmp_path):
    check(path)
    for name in tree.children:
        with xr.open_dataset(path, group=name, decode_cf=False) as group:
            alone = group.load().assign_attrs(tree.attrs)
        kept = {
            str(key): {"_FillValue": one.attrs.pop("_FillValue", None)}
            for key, one in alone.variables.items()
        }
        alone.to_netcdf(tmp_path / f"{name}.nc", encoding=kept)
        check(tmp_path / f"{name}.nc")


@pytest.mark.filterwarnings("ignore")
def test_groups_of_a_fleet_hold_to_conventions(tmp_path):
    store = Store(tmp_path / "store")
    spoilt = ROWS.replace("B,2026-01-01,840,500", "B,2026-01-01,840,1500")
    tree = update(fleet(tmp_path, spoilt), store, replay=True, progress=False)
    path = update_files(store).path(str(tree.attrs["id"]))
    assert "predictions_without" in tree.children
    held_to_conventions(tree, path, tmp_path)


def test_every_variable_of_an_update_tells_its_unit_and_meaning(store, tree):
    with netCDF4.Dataset(update_files(store).path(str(tree.attrs["id"]))) as file:
        for name, group in file.groups.items():
            for key, variable in group.variables.items():
                assert "long_name" in variable.ncattrs(), f"{name}/{key}"
                assert "units" in variable.ncattrs() or variable.dtype is str, (
                    f"{name}/{key}"
                )
                assert not (
                    key in tree[name].coords and "_FillValue" in variable.ncattrs()
                ), f"{name}/{key}"

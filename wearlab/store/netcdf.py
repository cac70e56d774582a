"""A dataset as the bytes of a netCDF-4 file, written by the netCDF library itself.

xarray's writer takes three times as long: it writes each variable before it defines the next, and HDF5 then
brings its whole header up to date each time. Here everything is defined first. Conventions are xarray's.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.conventions import encode_dataset_coordinates

TINY = 4_096  # bytes below which a variable has no checksum of its own: HDF5 needs 2 kB to keep a chunk
SMALL = 65_536  # bytes up to which a variable is not deflated: that takes longer than to write what it saves
ONE_CHUNK = 4_194_304  # bytes up to which a variable is one chunk


def encoded(data: xr.Dataset | xr.DataTree) -> bytes:
    """Return the netCDF-4 file of a dataset, or of a tree of them with a group for each.

    Coordinates are named as CF asks, large variables are deflated.
    """
    with TemporaryDirectory(prefix="wearlab-") as folder:
        path = Path(folder) / "run.nc"
        with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
            file.set_fill_off()
            if isinstance(data, xr.Dataset):
                _write(file, data)
            else:
                for node in data.subtree:
                    group = file if node is data else file.createGroup(node.path)
                    _write(group, node.to_dataset(inherit=False))
        return path.read_bytes()


def _write(group: netCDF4.Dataset, dataset: xr.Dataset) -> None:
    """Write a dataset into a group: first all definitions, then the values."""
    variables, attributes = encode_dataset_coordinates(dataset)
    for dim, size in dataset.sizes.items():
        group.createDimension(str(dim), size)
    group.setncatts({str(name): value for name, value in attributes.items()})
    defined = [
        _defined(group, str(name), variable, name in dataset.coords) for name, variable in variables.items()
    ]
    for target, values in defined:
        target[...] = values


def _defined(
    file: netCDF4.Dataset, name: str, variable: xr.Variable, coordinate: bool
) -> tuple[netCDF4.Variable, Any]:
    """Define a variable and return it with the values to be written; CF lets no coordinate have a filling."""
    values, attributes = _plain(np.asarray(variable.values), dict(variable.attrs))
    kind: Any = str if values.dtype == object else values.dtype
    filled = np.nan if values.dtype.kind == "f" and not coordinate else None
    dims = tuple(map(str, variable.dims))
    target = file.createVariable(name, kind, dims, fill_value=filled, **_storage(values))
    target.set_auto_maskandscale(False)
    target.setncatts({str(key): value for key, value in attributes.items()})
    return target, values if values.ndim or values.dtype != object else values.item()


def _plain(values: NDArray[Any], attributes: dict[Any, Any]) -> tuple[NDArray[Any], dict[Any, Any]]:
    """Return values of a type that netCDF has; what they were is told by an attribute."""
    if values.dtype.kind in "OUS":
        return values.astype(str).astype(object), attributes
    if values.dtype.kind == "b":
        return values.astype(np.int8), attributes | {"dtype": "bool"}
    return values, attributes


def _storage(values: NDArray[Any]) -> dict[str, Any]:
    """Return how HDF5 keeps an array: in chunks with a checksum unless tiny, deflated when large."""
    if not values.ndim or values.dtype == object or values.nbytes < TINY:
        return {}
    if values.nbytes <= SMALL:
        return {"fletcher32": True, "chunksizes": values.shape}
    chunks = {"chunksizes": values.shape} if values.nbytes <= ONE_CHUNK else {}
    return {"fletcher32": True, "zlib": True, "complevel": 1, **chunks}

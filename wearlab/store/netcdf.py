"""A dataset as the bytes of a netCDF-4 file, written by the netCDF library itself.

xarray's writer takes three times as long: it writes each variable before it defines the next, and HDF5 then
brings its whole header up to date each time. Here everything is defined first, in memory: no temporary folder
is needed, which may be full. Conventions are xarray's.
"""

from collections.abc import Mapping
from typing import Any

import h5py
import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

BEGUN = 1_024  # bytes of a file in memory, which grows
TINY = 4_096  # bytes below which a variable has no checksum of its own: HDF5 needs 2 kB to keep a chunk
SMALL = 65_536  # bytes up to which a variable is not deflated: that takes longer than to write what it saves
ONE_CHUNK = 4_194_304  # bytes up to which a variable is one chunk


def encoded(data: xr.Dataset | xr.DataTree) -> bytes:
    """Return the netCDF-4 file of a dataset, or of a tree of them with a group for each.

    Coordinates are named as CF asks, large variables are deflated.
    """
    file = netCDF4.Dataset("run.nc", "w", memory=BEGUN, format="NETCDF4")
    try:
        file.set_fill_off()
        if isinstance(data, xr.Dataset):
            _write(file, data)
        else:
            for node in data.subtree:
                group = file if node is data else file.createGroup(node.path)
                _write(group, node.to_dataset(inherit=False))
    except BaseException:
        file.close()
        raise
    return _without_reserve(file.close())


def _without_reserve(image: memoryview) -> bytes:
    """Return a file without the room that HDF5 had taken for more, as HDF5 itself hands it out."""
    file = h5py.h5f.open_file_image(bytes(image))
    try:
        return bytes(file.get_file_image())
    finally:
        file.close()


def _write(group: netCDF4.Dataset, dataset: xr.Dataset) -> None:
    """Write a dataset into a group: first all definitions, then the values."""
    for dim, size in dataset.sizes.items():
        group.createDimension(str(dim), size)
    beside, alone = _named_coordinates(dataset)
    group.setncatts({str(name): value for name, value in dataset.attrs.items()} | alone)
    defined = [
        _defined(group, str(name), variable, beside.get(str(name), {}), name in dataset.coords)
        for name, variable in dataset.variables.items()
    ]
    for target, values in defined:
        target[...] = values


def _named_coordinates(dataset: xr.Dataset) -> tuple[Mapping[str, dict[str, str]], dict[str, str]]:
    """Return the attribute ``coordinates`` of each variable, as CF has it, and that of the whole dataset.

    A variable names the coordinates along its dims that are not dims themselves; what no variable names, the
    dataset does, as xarray has it.
    """
    along = {
        str(name): frozenset(values.dims)
        for name, values in sorted(dataset.coords.items(), key=lambda item: str(item[0]))
        if name not in dataset.dims
    }
    named: dict[str, dict[str, str]] = {}
    left = set(along)
    for name, variable in dataset.variables.items():
        if name in along or name in variable.dims:
            continue
        dims = frozenset(variable.dims)
        coordinates = [known_name for known_name, its in along.items() if its <= dims]
        if coordinates:
            named[str(name)] = {"coordinates": " ".join(coordinates)}
            left.difference_update(coordinates)
    return named, {"coordinates": " ".join(sorted(left))} if left else {}


def _defined(
    file: netCDF4.Dataset, name: str, variable: xr.Variable, more: Mapping[str, str], coordinate: bool
) -> tuple[netCDF4.Variable, Any]:
    """Define a variable and return it with the values to be written; CF lets no coordinate have a filling."""
    values, attributes = _plain(np.asarray(variable.values), {**variable.attrs, **more})
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

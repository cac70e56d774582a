"""A dataset as the bytes of a netCDF-4 file, written by the netCDF library itself.

xarray's writer takes three times as long: it writes each variable before it defines the next, and HDF5 then
brings its whole header up to date each time. Here everything is defined first. Conventions are xarray's.
"""

from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.conventions import encode_dataset_coordinates

SMALL = 65_536  # bytes up to which a variable is not deflated: that takes longer than to write what it saves
GROWTH = 65_536  # bytes by which a file in memory grows
ONE_CHUNK = 4_194_304  # bytes up to which a variable is one chunk


def encoded(dataset: xr.Dataset) -> bytes:
    """Return the netCDF-4 file of a dataset, coordinates named as CF asks, large variables deflated."""
    variables, attributes = encode_dataset_coordinates(dataset)
    file = netCDF4.Dataset("run.nc", "w", format="NETCDF4", memory=GROWTH)
    file.set_fill_off()
    for dim, size in dataset.sizes.items():
        file.createDimension(str(dim), size)
    file.setncatts({str(name): value for name, value in attributes.items()})
    defined = [
        _defined(file, str(name), variable, name in dataset.coords) for name, variable in variables.items()
    ]
    for target, values in defined:
        _write(target, values)
    return _trimmed(bytes(file.close()))


def _trimmed(image: bytes) -> bytes:
    """Return a file without the room in memory that it has not filled, by the end that its head names.

    HDF5 rounds a file in memory up to 64 kB, a tenth of a static run, and tells nobody how much is used;
    the field "end of file address" of its superblock does.
    """
    version, width = image[8], image[9]
    end = int.from_bytes(image[28:36], "little")
    return image[:end] if version in (2, 3) and width == 8 and 0 < end < len(image) else image


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


def _write(target: netCDF4.Variable, values: Any) -> None:
    """Write all of a variable; numbers by the library's inner call, for slicing takes five times as long."""
    if target.dtype is str or not values.size:
        target[...] = values
    else:
        rank = values.ndim
        target._put(np.ascontiguousarray(values), [0] * rank, list(values.shape), [1] * rank)


def _plain(values: NDArray[Any], attributes: dict[Any, Any]) -> tuple[NDArray[Any], dict[Any, Any]]:
    """Return values of a type that netCDF has; what they were is told by an attribute."""
    if values.dtype.kind in "OUS":
        return values.astype(str).astype(object), attributes
    if values.dtype.kind == "b":
        return values.astype(np.int8), attributes | {"dtype": "bool"}
    return values, attributes


def _storage(values: NDArray[Any]) -> dict[str, Any]:
    """Return how HDF5 keeps an array: with a checksum, which only chunks can have; deflated when large."""
    if not values.ndim or not values.size or values.dtype == object:
        return {}
    if values.nbytes <= SMALL:
        return {"fletcher32": True, "chunksizes": values.shape}
    chunks = {"chunksizes": values.shape} if values.nbytes <= ONE_CHUNK else {}
    return {"fletcher32": True, "zlib": True, "complevel": 1, **chunks}

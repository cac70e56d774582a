"""A dataset as the bytes of a netCDF-4 file, with the checksum of its content inside.

What a file says can so be checked without any catalogue. It is written by the netCDF library itself.

xarray's writer takes three times as long: it writes each variable before it defines the next, and HDF5 then
brings its whole header up to date each time. Here everything is defined first, in memory: no temporary folder
is needed, which may be full. Conventions are xarray's.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr
    from numpy.typing import NDArray

BEGUN = 1_024  # bytes of a file in memory, which grows
TINY = 4_096  # bytes below which a variable has no checksum of its own: HDF5 needs 2 kB to keep a chunk
SMALL = 65_536  # bytes up to which a variable is not deflated: that takes longer than to write what it saves
ONE_CHUNK = 4_194_304  # bytes up to which a variable is one chunk
SEAL = "content_sha256"
PASSING = ("run_time_", "date_", "history")  # another time each time the same run is computed
CIRCUMSTANCES = ("machine", "packages", "commit", "dirty", "source_hash", "wearlab_version", "source")


def to_image(dataset: "xr.Dataset") -> tuple[bytes, str]:
    """Return the netCDF-4 file of a dataset, sealed, and its SHA-256."""
    image = encoded(sealed(dataset))
    return image, hashlib.sha256(image).hexdigest()


def encoded(data: "xr.Dataset | xr.DataTree") -> bytes:
    """Return the netCDF-4 file of a dataset, or of a tree of them with a group for each.

    Coordinates are named as CF asks, large variables are deflated.
    """
    import netCDF4
    import xarray as xr

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
    import h5py

    file = h5py.h5f.open_file_image(bytes(image))
    try:
        return bytes(file.get_file_image())
    finally:
        file.close()


def _write(group: "netCDF4.Dataset", dataset: "xr.Dataset") -> None:
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


def _named_coordinates(dataset: "xr.Dataset") -> tuple[Mapping[str, dict[str, str]], dict[str, str]]:
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
    file: "netCDF4.Dataset", name: str, variable: "xr.Variable", more: Mapping[str, str], coordinate: bool
) -> "tuple[netCDF4.Variable, Any]":
    """Define a variable and return it with the values to be written; CF lets no coordinate have a filling."""
    values, attributes = _plain(np.asarray(variable.values), {**variable.attrs, **more})
    kind: Any = str if values.dtype == object else values.dtype
    filled = np.nan if values.dtype.kind == "f" and not coordinate else None
    dims = tuple(map(str, variable.dims))
    target = file.createVariable(name, kind, dims, fill_value=filled, **_storage(values))
    target.set_auto_maskandscale(False)
    target.setncatts({str(key): value for key, value in attributes.items()})
    return target, values if values.ndim or values.dtype != object else values.item()


def _plain(values: "NDArray[Any]", attributes: dict[Any, Any]) -> "tuple[NDArray[Any], dict[Any, Any]]":
    """Return values of a type that netCDF has; what they were is told by an attribute."""
    if values.dtype.kind in "OUS":
        return values.astype(str).astype(object), attributes
    if values.dtype.kind == "b":
        return values.astype(np.int8), attributes | {"dtype": "bool"}
    return values, attributes


def _storage(values: "NDArray[Any]") -> dict[str, Any]:
    """Return how HDF5 keeps an array: in chunks with a checksum unless tiny, deflated when large."""
    if not values.ndim or values.dtype == object or values.nbytes < TINY:
        return {}
    if values.nbytes <= SMALL:
        return {"fletcher32": True, "chunksizes": values.shape}
    chunks = {"chunksizes": values.shape} if values.nbytes <= ONE_CHUNK else {}
    return {"fletcher32": True, "zlib": True, "complevel": 1, **chunks}


def sealed(dataset: "xr.Dataset") -> "xr.Dataset":
    """Return a dataset with the hash of its content among its attributes."""
    return dataset.assign_attrs({SEAL: content_hash(dataset)})


def is_intact(dataset: "xr.Dataset") -> bool | None:
    """Say whether a dataset is what was sealed; None when it bears no seal."""
    seal = dataset.attrs.get(SEAL)
    return None if seal is None else seal == content_hash(dataset)


def content_hash(dataset: "xr.Dataset") -> str:
    """Return the SHA-256 over every variable's name, dims, values and attributes, and the global attributes.

    Numbers are hashed as little-endian bytes of their stored type, texts as JSON: the hash does not depend on
    compression or on the version of the file format. Run times and dates are left out: the same run computed
    twice by the same code bears the same seal.
    """
    names = (name for name in map(str, dataset.variables) if not name.startswith(PASSING))
    attributes = (name for name in map(str, dataset.attrs) if not name.startswith((SEAL, *PASSING)))
    return _hash(dataset, names, attributes)


def results_hash(dataset: "xr.Dataset") -> str:
    """Return the SHA-256 over what a scene determines, whenever and wherever it was computed."""
    names = (name for name in map(str, dataset.variables) if not name.startswith(PASSING))
    attributes = (name for name in map(str, dataset.attrs) if not _is_circumstance(name))
    return _hash(dataset, names, attributes)


def _is_circumstance(name: str) -> bool:
    return name == SEAL or name in CIRCUMSTANCES or name.startswith(PASSING)


def _hash(dataset: "xr.Dataset", names: Iterable[str], attributes: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for name in sorted(names):
        variable = dataset.variables[name]
        digest.update(_json([name, list(variable.dims), list(variable.shape), _listed(variable.attrs)]))
        digest.update(_bytes(np.asarray(variable.values)))
    digest.update(_json({name: _listed(dataset.attrs[name]) for name in sorted(attributes)}))
    return digest.hexdigest()


def _bytes(values: Any) -> bytes:
    if values.dtype.kind in "OUS":
        return _json(values.tolist())
    stored = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return values.dtype.kind.encode() + bytes(np.ascontiguousarray(stored).data)


def _listed(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _listed(inner) for key, inner in sorted(value.items())}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_listed(inner) for inner in value]
    return value


def _json(value: Any) -> bytes:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=str).encode()

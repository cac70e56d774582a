"""A dataset as the bytes of a netCDF file, and back; used where HDF5 may run: in workers and in readers.

netCDF4 crashes when two threads enter it, so every reading goes through xarray's own locks.
"""

import hashlib
import json
import math
import threading
from array import array
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import NetCDF4DataStore
from xarray.backends.locks import HDF5_LOCK, NETCDFC_LOCK

from wearlab.store.bounds import refuse_links, refuse_oversized
from wearlab.store.errors import StoreError
from wearlab.store.netcdf import SMALL, encoded
from wearlab.store.seal import sealed

OPEN_FILES = 32
LIFE = "update"
AT_STATES = frozenset((LIFE, "flank", "mesh", "member"))
ALONG_PHASE = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")
CODE = ("commit", "model_version")
PARENT_CYCLE = "parent_cycle"

_one_door = threading.RLock()
_files: dict[tuple[str, int, int, int], netCDF4.Dataset] = {}  # open files, the one used last at the end


class Description(NamedTuple):
    """What the catalogue records of a dataset, so that a grid opens without opening files.

    Parameters
    ----------
    sizes : length of each dimension
    layout : JSON: per variable its dims, dtype, attributes, whether it is a coordinate; labels of dimensions
    digests : hash of the values of each coordinate
    summary : scalar results; the largest of each result at a wear state; of some along the phase the
        smallest, largest and mean; the code that made it
    histories : each result at the wear states, smallest and largest where there are several; float64
    places : where the values of each variable, by name, stand in the file; uint32, 0 where that is not known
    """

    sizes: dict[str, int]
    layout: str
    digests: dict[str, str]
    summary: dict[str, Any]
    histories: dict[str, bytes]
    places: bytes


def to_image(dataset: xr.Dataset) -> tuple[bytes, str]:
    """Return the netCDF-4 file of a dataset, sealed, and its SHA-256."""
    image = encoded(sealed(dataset))
    return image, hashlib.sha256(image).hexdigest()


def load(path: Path) -> xr.Dataset:
    """Read a whole run into memory and close its file.

    Raises
    ------
    StoreError : the file is absent, damaged, a link, or claims more than it can hold
    """
    refuse_links(path)
    with _one_door:
        try:
            with _Opened(path) as file:
                refuse_oversized(path, sum(_claimed(variable) for variable in file.variables.values()))
                return xr.open_dataset(NetCDF4DataStore(file)).load()
        except (OSError, RuntimeError, ValueError) as error:
            raise StoreError(f"{path}: cannot be read ({error}); try 'wearlab verify'") from error


class _Opened:
    """A file opened for a moment, the only time in this process: netCDF crashes when one of two is closed."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> netCDF4.Dataset:
        with NETCDFC_LOCK, HDF5_LOCK:
            for key in [key for key in _files if key[0] == str(self.path)]:
                _files.pop(key).close()
            self.file = netCDF4.Dataset(self.path)
        return self.file

    def __exit__(self, *error: object) -> None:
        with NETCDFC_LOCK, HDF5_LOCK:
            self.file.close()


def _claimed(variable: netCDF4.Variable) -> int:
    """Return the bytes of a variable's values; of texts, those of their references."""
    return math.prod(variable.shape) * (16 if variable.dtype is str else variable.dtype.itemsize)


def read_variable(path: str, name: str) -> NDArray[Any]:
    """Read one variable of a run, safely from any thread."""
    refuse_links(path)
    with _one_door, NETCDFC_LOCK, HDF5_LOCK:
        try:
            variable = _open(path).variables[name]
            refuse_oversized(path, _claimed(variable))
            return np.asarray(variable[...])
        except (OSError, RuntimeError, KeyError) as error:
            raise StoreError(f"{path}: {name} cannot be read ({error}); try 'wearlab verify'") from error


def _open(path: str) -> netCDF4.Dataset:
    """Return the open file, kept among the last few: opening costs more than reading a variable.

    Called under the lock only. A file that is put out is closed here and now: left to the garbage collector,
    it would be closed in some thread that does not hold the lock, and crash the process.
    """
    status = Path(path).stat()
    key = (path, status.st_mtime_ns, status.st_size, status.st_ino)
    file = _files.pop(key, None) or netCDF4.Dataset(path)
    file.set_auto_maskandscale(False)
    _files[key] = file
    while len(_files) > OPEN_FILES:
        _files.pop(next(iter(_files))).close()
    return file


def describe(dataset: xr.Dataset, image: bytes = b"") -> Description:
    """Return sizes, layout, summary and histories of a run, and where its values stand in its file."""
    variables = {
        str(name): {
            "dims": list(variable.dims),
            "dtype": "str" if variable.dtype.kind in "OUS" else variable.dtype.str,
            "attrs": {str(key): plain(value) for key, value in variable.attrs.items()},
            "coordinate": name in dataset.coords,
        }
        for name, variable in dataset.variables.items()
    }
    labels = {str(dim): dataset[dim].values.tolist() for dim in dataset.dims if dim in dataset.coords}
    layout = json.dumps({"variables": variables, "labels": labels}, sort_keys=True)
    digests = {str(name): _digest(values) for name, values in dataset.coords.items()}
    sizes = {str(dim): n for dim, n in dataset.sizes.items()}
    return Description(sizes, layout, digests, *_results(dataset), _places(dataset, image))


def _places(dataset: xr.Dataset, image: bytes) -> bytes:
    """Return where each variable's bytes stand in a file image, by name."""
    found: dict[str, int] = {}
    at = 0
    for name, variable in dataset.variables.items():
        values = variable.values
        plain = values.dtype.kind in "fiub" and values.dtype.isnative and 0 < values.nbytes <= SMALL
        offset = -1
        if plain and image:
            raw = np.ascontiguousarray(values).tobytes()
            offset = image.find(raw, at)  # they stand in the order of writing
            at = max(at, offset)
        found[str(name)] = max(offset, 0)
    return array("I", [found[name] for name in sorted(found)]).tobytes() if image else b""


def _digest(values: xr.DataArray) -> str:
    data = values.values
    content = repr(data.tolist()).encode() if data.dtype.kind in "OUS" else data.tobytes()
    return hashlib.sha256(repr((values.dims, values.shape)).encode() + content).hexdigest()[:16]


def _results(dataset: xr.Dataset) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return summary and histories."""
    summary: dict[str, Any] = {name: str(dataset.attrs[name]) for name in CODE if name in dataset.attrs}
    with suppress(KeyError, ValueError, TypeError):
        summary[PARENT_CYCLE] = plain(float(dataset.attrs[PARENT_CYCLE]))
    histories: dict[str, bytes] = {}
    for name, variable in dataset.variables.items():
        if variable.ndim == 0:
            summary[str(name)] = plain(variable.values)
        elif variable.dtype.kind not in "fiu":
            continue
        elif AT_STATES.issuperset(variable.dims):
            values = np.asarray(variable.values, float)
            summary[str(name)] = plain(_largest(values, np.fmax))
            if variable.dims[0] == LIFE:
                histories[str(name)] = _history(values)
        elif name in ALONG_PHASE:
            values = variable.values
            summary |= {
                f"{name}_min": plain(_largest(values, np.fmin)),
                f"{name}_mean": plain(np.mean(values)),
            }
            summary[f"{name}_max"] = plain(_largest(values, np.fmax))
    return summary, histories


def _largest(values: NDArray[Any], choose: Any) -> Any:
    return choose.reduce(values, axis=None) if values.size else math.nan


def _history(values: NDArray[np.float64]) -> bytes:
    """Return the values at each wear state; the lowest, then the highest, where there are several."""
    if values.ndim == 1:
        return values.tobytes()
    flat = values.reshape(len(values), -1)
    return np.concatenate([np.fmin.reduce(flat, axis=1), np.fmax.reduce(flat, axis=1)]).tobytes()


def plain(value: Any) -> Any:
    """Return a value that JSON can hold; what is not finite becomes None."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)

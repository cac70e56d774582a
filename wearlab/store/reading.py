"""Runs read from their files: a whole one as a dataset, or one variable of it; checked before it is believed.

A whole run is read by netCDF4, which crashes when two threads enter it: that goes through xarray's own locks.
One variable is read by h5py, which does not list a whole file to find it: 0.3 ms instead of 6. Closing a file
closes whatever another thread has open in the same file, so one thread reads at a time.
"""

import math
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import NetCDF4DataStore
from xarray.backends.locks import HDF5_LOCK, NETCDFC_LOCK

from wearlab.store import touch
from wearlab.store.bounds import refuse_oversized
from wearlab.store.errors import StoreError
from wearlab.store.strange import refuse_strange

_one_door = threading.RLock()


def read_run(path: Path, sha256: str | None = None) -> xr.Dataset:
    """Read a whole run into memory.

    Parameters
    ----------
    path : its file
    sha256 : hash that its bytes must have [not asked]

    Raises
    ------
    StoreError : the file is absent, altered, damaged, a link, or claims more than it can hold
    """
    image = touch.content(path, sha256)
    with _one_door:
        refuse_strange(path, image)
    with _one_door, NETCDFC_LOCK, HDF5_LOCK:
        try:
            file = netCDF4.Dataset(path.name, memory=image)
        except Exception as error:
            raise _unreadable(path, error) from error
    try:
        refuse_oversized(path, sum(_claimed(variable) for variable in file.variables.values()), len(image))
        with _one_door:
            dataset = xr.open_dataset(NetCDF4DataStore(file)).load()
            dataset.encoding["source"] = str(path)
            return dataset
    except Exception as error:  # whatever xarray makes of a stranger's attributes
        raise error if isinstance(error, StoreError) else _unreadable(path, error) from error
    finally:
        with _one_door, NETCDFC_LOCK, HDF5_LOCK:
            file.close()


def _claimed(variable: netCDF4.Variable) -> int:
    """Return the bytes of a variable's values; of texts, those of their references."""
    return math.prod(variable.shape) * (16 if variable.dtype is str else variable.dtype.itemsize)


def read_variable(path: str, name: str, sha256: str | None = None) -> NDArray[Any]:
    """Read one variable of a run, safely from any thread.

    Parameters
    ----------
    path, name : file and variable
    sha256 : hash that the file's bytes must have [not asked]

    Raises
    ------
    StoreError : the file is gone, altered or damaged, or has no such variable of numbers or texts
    """
    return read_variables(path, (name,), sha256)[name]


def read_variables(path: str, names: Iterable[str], sha256: str | None = None) -> dict[str, NDArray[Any]]:
    """Read some variables of a run, its file opened once, safely from any thread.

    Parameters
    ----------
    path, names : file and variables
    sha256 : hash that the file's bytes must have [not asked]

    Raises
    ------
    StoreError : the file is gone, altered or damaged, or has no such variable of numbers or texts
    """
    source = touch.source(path, sha256)
    variables: dict[str, NDArray[Any]] = {}
    name = ""
    try:
        with _one_door, h5py.File(source, "r", locking=False) as file:
            for name in names:
                variables[name] = _values(file, path, name)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        if isinstance(error, StoreError):
            raise
        raise StoreError(f"{path}: {name} cannot be read ({error}); try 'wearlab verify'") from error
    return variables


def _values(file: h5py.File, path: str, name: str) -> NDArray[Any]:
    """Return a variable's values; whatever HDF5 opens for it is closed with the file.

    HDF5 is asked itself, without the objects that h5py makes of every answer: a third of the time.
    """
    key = name.encode()
    hard = key in file.id and file.id.links.get_info(key).type == h5py.h5l.TYPE_HARD
    dataset = h5py.h5o.open(file.id, key) if hard else None
    if not isinstance(dataset, h5py.h5d.DatasetID) or _leads_elsewhere(dataset):
        raise StoreError(f"{path}: {name} is no variable of this file")
    dtype = dataset.dtype
    refuse_oversized(path, math.prod(dataset.shape) * dtype.itemsize)
    if h5py.check_string_dtype(dtype) is not None:
        return np.asarray(h5py.Dataset(dataset).asstr()[()], object)
    if dtype.kind not in "biuf" or dtype.subdtype is not None:
        raise StoreError(f"{path}: {name} holds neither numbers nor texts")
    values = np.empty(dataset.shape, dtype)
    if values.size:
        dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, values)
    return values


def _leads_elsewhere(variable: h5py.h5d.DatasetID) -> bool:
    """Say whether the values lie in other files."""
    made = variable.get_create_plist()
    return made.get_external_count() > 0 or made.get_layout() == h5py.h5d.VIRTUAL


def _unreadable(path: Path, error: Exception) -> StoreError:
    return StoreError(f"{path}: cannot be read ({str(error)[:300]}); try 'wearlab verify'")

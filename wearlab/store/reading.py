"""Runs read from their files, after their hash, structure and size were checked.

A whole run is read by netCDF4, which crashes when two threads enter it: that goes
through xarray's own locks. One variable is read by h5py, which does not list a whole
file to find it: 0.3 ms instead of 6. Closing a file closes whatever another thread has
open in the same file, so one thread reads at a time. HDF5 is asked itself, without the
objects that h5py makes of every answer: a quarter of the time.
"""

import hashlib
import io
import math
import os
import sqlite3
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import NetCDF4DataStore
from xarray.backends.locks import HDF5_LOCK, NETCDFC_LOCK

from wearlab.files import regular
from wearlab.store import netcdf, remote
from wearlab.store.files import StoreError, readable, refuse_links, refuse_oversized

Stamp = tuple[int, int, int, int, str]
"""By what a file is known again, and the hash that was found then."""
TEXT_BYTES = 16  # that refer to a text of any length
MAX_FOLDERS = 4
"""Folders above a run's file among which that of its store is."""
_sound: dict[str, Stamp] = {}


def checked_bytes(path: str | Path, sha256: str | None) -> bytes:
    """Return all bytes of a run's file, compared with its hash.

    Without a hash as they are.

    Parameters
    ----------
    path : of the file
    sha256 : hash that its bytes must have [not asked]

    Raises
    ------
    StoreError : the file is gone, a link, or not what was written
    """
    refuse_links(path)
    status, document = _read(path)
    if sha256 not in (None, hashlib.sha256(document).hexdigest()) and remote.fetch(
        Path(path)
    ):
        status, document = _read(path)  # it was computed again where it comes from
    if sha256 is not None:
        if hashlib.sha256(document).hexdigest() != sha256:
            _sound.pop(str(path), None)
            if _is_recorded(Path(path), hashlib.sha256(document).hexdigest()):
                raise StoreError(
                    f"{path}: the run was computed anew after this was opened; open "
                    "the campaign again"
                )
            reason = (
                "is not what was written: its bytes do not have the recorded hash "
                f"{sha256[:12]}…"
            )
            remedy = (
                "'wearlab verify' names all such files, 'wearlab run' computes anew "
                "what is removed"
            )
            raise StoreError(f"{path}: {reason}; {remedy}")
        _sound[str(path)] = _mark(status, sha256)
    return document


def _is_recorded(path: Path, sha256: str) -> bool:
    """Say whether the store's catalogue has this hash for a run's file by now."""
    for folder in path.absolute().parents[:MAX_FOLDERS]:
        catalogue = folder / "catalogue.sqlite"
        if not catalogue.is_file():
            continue
        with suppress(sqlite3.Error):
            address = f"{catalogue.as_uri()}?mode=ro"
            with closing(sqlite3.connect(address, uri=True)) as connection:
                row = connection.execute(
                    "SELECT sha256 FROM runs WHERE id = ?", (path.stem,)
                ).fetchone()
                return row is not None and row[0] == sha256
    return False


def _read(path: str | Path) -> tuple[os.stat_result, bytes]:
    try:
        if not os.path.exists(path):
            remote.fetch(Path(path))
        with regular(path) as file:
            return os.fstat(file.fileno()), file.read()
    except OSError as error:
        reason = error.strerror or error
        raise StoreError(
            f"{path}: cannot be read ({reason}); try 'wearlab verify'"
        ) from error


def checked_source(path: str, sha256: str | None) -> str | io.BytesIO:
    """Return where a run is read from.

    Its checked bytes at the first reading, later the file itself.

    Parameters
    ----------
    path : of the file
    sha256 : hash that its bytes must have [not asked]

    Raises
    ------
    StoreError : as of `checked_bytes`
    """
    with suppress(OSError):
        if _sound.get(path) == _mark(os.lstat(path), sha256 or ""):
            refuse_links(path)
            return path
    return io.BytesIO(checked_bytes(path, sha256))


def _mark(status: os.stat_result, sha256: str) -> Stamp:
    return (
        status.st_size,
        status.st_mtime_ns,
        status.st_ctime_ns,
        status.st_ino,
        sha256,
    )


_one_door = threading.RLock()


def read_run(path: Path, sha256: str | None = None) -> xr.Dataset:
    """Read a whole run into memory.

    Parameters
    ----------
    path : its file
    sha256 : hash that its bytes must have [not asked]

    Raises
    ------
    StoreError : the file is absent, altered, damaged, a link, or claims more than it
        can hold
    """
    image = checked_bytes(path, sha256)
    with readable(f"{path}:"), _one_door, _opened(path, image) as file:
        dataset = xr.open_dataset(NetCDF4DataStore(file)).load()
    dataset.encoding["source"] = str(path)
    return dataset


def read_groups(path: Path, sha256: str | None = None) -> xr.DataTree:
    """Read a file with groups into memory, checked as a run's file is.

    Parameters
    ----------
    path : its file
    sha256 : hash that its bytes must have [not asked]

    Raises
    ------
    StoreError : the file is absent, altered, damaged, a link, holds what no wearlab
        writes, or claims more than it can hold
    """
    image = checked_bytes(path, sha256)
    datasets: dict[str, xr.Dataset] = {}
    with readable(f"{path}:"), _one_door, _opened(path, image) as file:
        for name, group in _groups(file):
            datasets[name] = xr.open_dataset(NetCDF4DataStore(group)).load()
        return xr.DataTree.from_dict(datasets)


@contextmanager
def _opened(path: Path, image: bytes) -> Iterator[Any]:
    """Open a netCDF file in memory, after its structure and its size were checked.

    Parameters
    ----------
    path : its name, for messages
    image : its bytes

    Raises
    ------
    StoreError : it holds what no wearlab writes, or claims more than it can hold
    """
    netcdf.refuse_untrusted(path, image)
    with NETCDFC_LOCK, HDF5_LOCK:  # of a file in memory xarray asks for none
        file = netCDF4.Dataset(path.name, memory=image)
    with closing(file):
        claimed = sum(
            math.prod(variable.shape) * _item_bytes(variable)
            for _, group in _groups(file)
            for variable in group.variables.values()
        )
        refuse_oversized(path, claimed, len(image))
        yield file


def _groups(file: Any) -> Iterator[tuple[str, Any]]:
    """Yield a file and all its groups, with their paths."""
    yield file.path, file
    for group in file.groups.values():
        yield from _groups(group)


def _item_bytes(variable: Any) -> int:
    """Return the bytes of one value of a netCDF variable in memory."""
    if variable.dtype is str:
        return TEXT_BYTES
    return int(variable.dtype.itemsize)


def read_variable(path: str, name: str, sha256: str | None = None) -> NDArray[Any]:
    """Read one variable of a run, safely from any thread.

    Parameters
    ----------
    path, name : file and variable
    sha256 : hash that the file's bytes must have [not asked]

    Raises
    ------
    StoreError : the file is gone, altered or damaged, or has no such variable of
        numbers or texts
    """
    return read_variables(path, (name,), sha256)[name]


def read_variables(
    path: str, names: Iterable[str], sha256: str | None = None
) -> dict[str, NDArray[Any]]:
    """Read some variables of a run, its file opened once, safely from any thread.

    Parameters
    ----------
    path, names : file and variables
    sha256 : hash that the file's bytes must have [not asked]

    Raises
    ------
    StoreError : the file is gone, altered or damaged, or has no such variable of
        numbers or texts
    """
    source = checked_source(path, sha256)
    with readable(f"{path}:"), _one_door, h5py.File(source, "r", locking=False) as file:
        return {name: _values(file, path, name) for name in names}


def _values(file: h5py.File, path: str, name: str) -> NDArray[Any]:
    """Return a variable's values; whatever HDF5 opens for it is closed with the file.

    HDF5 is asked itself, without the objects that h5py makes of every answer: a third
    of the time.
    """
    with readable(f"{path}: {name}"):
        key = name.encode()
        hard = False
        with suppress(KeyError):
            hard = file.id.links.get_info(key).type == h5py.h5l.TYPE_HARD
        dataset = h5py.h5o.open(file.id, key) if hard else None
        if not isinstance(dataset, h5py.h5d.DatasetID) or netcdf.leads_elsewhere(
            dataset.get_create_plist()
        ):
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


class RunGroup(NamedTuple):
    """Runs that are alike: the same variables, the same lengths.

    Parameters
    ----------
    sizes : length of each dimension
    variables : dims, dtype and attributes of each variable
    labels : labels of dimensions
    """

    sizes: Mapping[str, int]
    variables: Mapping[str, dict[str, Any]]
    labels: Mapping[str, list[Any]]


class RunFile(NamedTuple):
    """The file of one run.

    Parameters
    ----------
    path, sha256 : the file and the recorded hash of its bytes
    group : what the run is like
    """

    path: str
    sha256: str | None
    group: int


@dataclass(frozen=True, repr=False)
class LazyVariable:
    """An array over grid and run dims.

    Indexing it by slices reads the points that the slices hold.

    Parameters
    ----------
    name : of the variable
    numbers : number of the run at each grid point, −1 where there is none (grid shape)
    files : the runs
    places : per group, where its values go along each run dim (None: from 0 on)
    padded : lengths of the run dims
    dtype, fill : of the result
    """

    name: str
    numbers: NDArray[np.intp]
    files: Sequence[RunFile]
    places: Mapping[int, tuple[list[int] | None, ...]]
    padded: tuple[int, ...]
    dtype: np.dtype[Any]
    fill: Any

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of grid and run dims."""
        return self.numbers.shape + self.padded

    @property
    def ndim(self) -> int:
        """Number of grid and run dims."""
        return len(self.shape)

    def __getitem__(self, index: Any) -> NDArray[Any]:
        """Return the values in a block of points.

        A slice or a number for each dim.
        """
        index = index if isinstance(index, tuple) else (index,)
        numbers = np.asarray(self.numbers[index[: self.numbers.ndim]])
        result = np.full(numbers.shape + self.padded, self.fill, self.dtype)
        for point in np.ndindex(numbers.shape):
            number = int(numbers[point])
            if (
                number >= 0
                and (places := self.places.get(self.files[number].group)) is not None
            ):
                values = read_variable(
                    self.files[number].path, self.name, self.files[number].sha256
                )
                along = zip(values.shape, places, strict=True)
                where = np.ix_(
                    *(
                        np.arange(n) if place is None else np.asarray(place)
                        for n, place in along
                    )
                )
                # a 0-d array of texts would stand in an object array as an array
                result[(*point, *where)] = values[()]
        return np.asarray(
            result[(slice(None),) * numbers.ndim + index[self.numbers.ndim :]]
        )

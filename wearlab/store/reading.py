"""Runs read from their files, checked before they are believed: their hash, their structure, their size.

A whole run is read by netCDF4, which crashes when two threads enter it: that goes through xarray's own locks.
One variable is read by h5py, which does not list a whole file to find it: 0.3 ms instead of 6. Closing a file
closes whatever another thread has open in the same file, so one thread reads at a time. HDF5 is asked itself,
without the objects that h5py makes of every answer: a quarter of the time.
"""

import hashlib
import io
import math
import os
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import netCDF4
import numpy as np
import xarray as xr
from h5py import h5a, h5d, h5g, h5o, h5s, h5t, h5z
from numpy.typing import NDArray
from xarray.backends import NetCDF4DataStore
from xarray.backends.locks import HDF5_LOCK, NETCDFC_LOCK

from wearlab.store import remote
from wearlab.store.files import HARMLESS, StoreError, refuse_links, refuse_oversized

MOST = 5_000  # variables and groups of one file
MOST_ATTRIBUTES = 500  # of one variable or group
MOST_DIMS = 32  # of a variable, as HDF5 has it
DIMENSIONS = b"DIMENSION_LIST"  # lists a variable's dimensions
DEEPEST = 8  # groups within groups
FILTERS = (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE, h5z.FILTER_FLETCHER32)  # each once, in any order
FLOATS = {4: (31, 23, 8, 0, 23), 8: (63, 52, 11, 0, 52)}  # sign, exponent, its bits, mantissa, its bits


def refuse_untrusted(path: Path, image: bytes) -> None:
    """Refuse a file whose structure no run has: it would lead elsewhere, in circles, or fill the memory.

    Parameters
    ----------
    path : its name, for the message
    image : its bytes

    Raises
    ------
    StoreError : it has links, values in other files, groups within themselves, types of its own, or texts and
        chunks that are far larger when read
    """
    try:
        with h5py.File(io.BytesIO(image), "r") as file:
            _Walk(path, len(image), file.id).enter(h5g.open(file.id, b"/"), "", 0)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        if isinstance(error, StoreError):
            raise
        raise StoreError(f"{path}: cannot be read ({error}); try 'wearlab verify'") from error


class _Walk:
    """One look at everything that a file holds.

    Parameters
    ----------
    path, size : the file and its bytes: no text in it is longer
    file : the file
    """

    def __init__(self, path: Path, size: int, file: Any) -> None:
        self.path, self.size = path, size
        self.seen: dict[Any, str] = {}
        self.left = max(HARMLESS, 20 * size)  # bytes that texts may still take
        self.reference = 8 + file.get_create_plist().get_sizes()[0]  # bytes: a length, an address, a number

    def refuse(self, where: str, reason: str) -> None:
        raise StoreError(f"{self.path}: {where[:80] or '/'} {reason}; not read")

    def enter(self, group: Any, where: str, depth: int) -> None:
        """Look at a group and all that it holds."""
        self.attributes(group, where)
        for key in group:
            self.visit(group, key, f"{where}/{key.decode(errors='replace')}", depth)

    def visit(self, group: Any, key: bytes, where: str, depth: int) -> None:
        if group.links.get_info(key).type != h5py.h5l.TYPE_HARD:
            self.refuse(where, "is a link to elsewhere")
        entry = h5o.open(group, key)
        information = h5o.get_info(entry)
        address = (information.fileno, information.addr)
        if address in self.seen or len(self.seen) >= MOST or depth >= DEEPEST:
            known = address in self.seen
            self.refuse(where, f"is {self.seen[address]} once more" if known else "is one of too many")
        self.seen[address] = where
        if isinstance(entry, h5g.GroupID):
            self.enter(entry, where, depth + 1)
        elif isinstance(entry, h5d.DatasetID):
            self.variable(entry, where)
        else:
            self.refuse(where, "is a type and no variable")

    def variable(self, dataset: Any, where: str) -> None:
        made, kind = dataset.get_create_plist(), dataset.get_type()
        layout = made.get_layout()
        if layout == h5d.VIRTUAL or made.get_external_count():
            self.refuse(where, "has its values in other files")
        if not _is_plain(kind):
            self.refuse(where, "holds neither numbers, as a run has them, nor texts")
        if layout == h5d.CHUNKED:
            self.chunks(made, kind.get_size(), where)
        self.attributes(dataset, where)
        if _is_text(kind):
            self.texts(dataset, where)

    def chunks(self, made: Any, width: int, where: str) -> None:
        """Refuse filters that no run has, and chunks that are far larger than the file."""
        refuse_oversized(self.path, math.prod(made.get_chunk()) * width, self.size)
        used = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
        if len(used) > len(set(used)) or not set(used) <= set(FILTERS):
            self.refuse(where, "is stored by other filters than a run")

    def attributes(self, entry: Any, where: str) -> None:
        """Read the texts of attributes: of all others HDF5 tells the size."""
        count = h5a.get_num_attrs(entry)
        if count > MOST_ATTRIBUTES:
            self.refuse(where, f"has {count} attributes")
        names: list[bytes] = []

        def note(name: bytes, about: Any) -> None:
            usual = name == DIMENSIONS and about.data_size <= MOST_DIMS * self.reference
            if not usual and about.data_size % self.reference == 0:
                names.append(name)

        h5a.iterate(entry, note, info=True)
        for name in names:
            attribute = h5a.open(entry, name)
            kind, many = attribute.get_type(), math.prod(attribute.shape)
            if _is_long(kind) and many > 1 and many * self.size > HARMLESS:
                self.refuse(where, "has lists that may be far larger than the file")
            if _is_text(kind):
                texts = np.empty(attribute.shape, attribute.dtype)
                attribute.read(texts)
                self.spend(texts, where)

    def texts(self, entry: Any, where: str) -> None:
        """Read texts of any length a few at a time, until they take more than they may."""
        space, shape = entry.get_space(), entry.shape
        count, some = math.prod(shape), max(1, HARMLESS // self.size)
        for at in range(0, count, some):
            places = np.arange(at, min(at + some, count))
            if shape:
                space.select_elements(np.stack(np.unravel_index(places, shape), axis=1))
            texts = np.empty(len(places), entry.dtype)
            entry.read(h5s.create_simple(texts.shape), space, texts)
            self.spend(texts, where)

    def spend(self, texts: NDArray[Any], where: str) -> None:
        self.left -= sum(map(len, texts.flat))
        if self.left < 0:
            self.refuse(where, "has texts that are far larger than the file")


def _is_plain(kind: Any) -> bool:
    """Say whether a type is of texts, or of numbers that netCDF knows: of others it dies."""
    match kind.get_class():
        case h5t.STRING:
            return True
        case h5t.FLOAT:
            return bool(FLOATS.get(kind.get_size()) == kind.get_fields())
        case h5t.INTEGER:
            return bool(kind.get_size() in (1, 2, 4, 8) and kind.get_precision() == 8 * kind.get_size())
    return False


def _is_text(kind: Any) -> bool:
    """Say whether values of a type are texts of any length."""
    return bool(kind.get_class() == h5t.STRING and kind.is_variable_str())


def _is_long(kind: Any) -> bool:
    """Say whether values of a type are of any length, and so stand elsewhere in the file."""
    return kind.get_class() == h5t.VLEN or _is_text(kind)


class Stamp(NamedTuple):
    """By what a file is known again, and the hash that was found then."""

    size: int
    modified: int
    changed: int
    inode: int
    sha256: str


_sound: dict[str, Stamp] = {}


def checked_bytes(path: str | Path, sha256: str | None) -> bytes:
    """Return all bytes of a run's file, compared with its hash; without a hash as they are.

    Raises
    ------
    StoreError : the file is gone, a link, or not what was written
    """
    refuse_links(path)
    status, document = _read(path)
    if sha256 not in (None, hashlib.sha256(document).hexdigest()) and remote.fetch(Path(path)):
        status, document = _read(path)  # it was computed again where it comes from
    if sha256 is not None:
        if hashlib.sha256(document).hexdigest() != sha256:
            _sound.pop(str(path), None)
            raise StoreError(
                f"{path}: is not what was written: its bytes do not have the recorded hash {sha256[:12]}…; "
                "'wearlab verify' names all such files, 'wearlab run' computes anew what is removed"
            )
        _sound[str(path)] = _mark(status, sha256)
    return document


def _read(path: str | Path) -> tuple[os.stat_result, bytes]:
    try:
        if not os.path.exists(path):
            remote.fetch(Path(path))
        with open(path, "rb") as file:
            return os.fstat(file.fileno()), file.read()
    except OSError as error:
        reason = error.strerror or error
        raise StoreError(f"{path}: cannot be read ({reason}); try 'wearlab verify'") from error


def checked_source(path: str, sha256: str | None) -> str | io.BytesIO:
    """Return where a run is read from: its checked bytes at the first reading, later the file itself.

    Raises
    ------
    StoreError : as of `checked_bytes`
    """
    try:
        seen = _mark(os.lstat(path), sha256 or "")
    except OSError:
        seen = None
    if seen is not None and _sound.get(path) == seen:
        refuse_links(path)
        return path
    return io.BytesIO(checked_bytes(path, sha256))


def _mark(status: os.stat_result, sha256: str) -> Stamp:
    return Stamp(status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino, sha256)


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
    image = checked_bytes(path, sha256)
    with _one_door:
        refuse_untrusted(path, image)
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
    source = checked_source(path, sha256)
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
    try:
        hard = file.id.links.get_info(key).type == h5py.h5l.TYPE_HARD
    except KeyError:
        hard = False
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

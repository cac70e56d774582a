"""A run as the bytes of a netCDF-4 file: written, its content sealed.

Refused where no run looks so.

What a file says can so be checked without any catalogue. xarray defines and encodes it,
by its conventions.

xarray alone takes three times as long: it writes each variable before it defines the
next, and HDF5 then brings its whole header up to date each time. Here everything is
defined first, in memory: no temporary folder is needed, which may be full.
"""

import hashlib
import io
import json
import math
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5o, h5s, h5t, h5z
from numpy.typing import NDArray

from wearlab.store.files import HARMLESS, StoreError, readable, refuse_oversized

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

BEGUN = 1_024  # bytes of a file in memory, which grows
# bytes below which a variable has no checksum of its own: HDF5 needs 2 kB to keep a
# chunk
TINY = 4_096
# bytes up to which a variable is not deflated: that takes longer than to write what it
# saves
SMALL = 65_536
ONE_CHUNK = 4_194_304  # bytes up to which a variable is one chunk
HASHED_AT_ONCE = 262_144  # bytes of a variable
TEXT_KINDS = "OUST"  # of numpy: T is text of any width, as Zarr gives it
SEAL = "content_sha256"
PASSING = (
    "run_time_",
    "date_",
    "history",
)  # another time each time the same run is computed
CIRCUMSTANCES = (
    "machine",
    "packages",
    "commit",
    "dirty",
    "source_hash",
    "wearlab_version",
    "source",
    "warnings",
)


def to_image(dataset: "xr.Dataset") -> tuple[bytes, str]:
    """Return the netCDF-4 file of a dataset, sealed, and its SHA-256.

    Parameters
    ----------
    dataset : a run
    """
    image = encoded(sealed(dataset))
    return image, hashlib.sha256(image).hexdigest()


def encoded(data: "xr.Dataset | xr.DataTree") -> bytes:
    """Return the netCDF-4 file of a dataset, or of a tree with a group for each.

    Coordinates are named as CF asks, large variables are deflated.

    Parameters
    ----------
    data : a dataset, or a tree of datasets
    """
    import netCDF4
    import xarray as xr

    parts = {"/": data} if isinstance(data, xr.Dataset) else datasets_of(data)
    file = netCDF4.Dataset("run.nc", "w", memory=BEGUN, format="NETCDF4")
    try:
        file.set_fill_off()
        for path, dataset in parts.items():
            _write(file if path == "/" else file.createGroup(path), dataset)
    except BaseException:
        file.close()
        raise
    # without the room that HDF5 had taken for more, as HDF5 itself hands it out
    with closing(h5py.h5f.open_file_image(bytes(file.close()))) as image:
        return bytes(image.get_file_image())


def datasets_of(tree: "xr.DataTree") -> "dict[str, xr.Dataset]":
    """Return what each group of a tree holds itself, by its path.

    Parameters
    ----------
    tree : such as an update
    """
    return {node.path: node.to_dataset(inherit=False) for node in tree.subtree}


def _write(group: "netCDF4.Dataset", dataset: "xr.Dataset") -> None:
    """Write a dataset into a group: first all definitions, then the values."""
    from xarray.backends import NetCDF4DataStore

    later: list[tuple[Any, Any]] = []  # what xarray would write at once
    writer = SimpleNamespace(
        add=lambda source, target, region=None: later.append((target, source))
    )
    encoding = {
        name: _storage(variable.values) for name, variable in dataset.variables.items()
    }
    for name in dataset.coords:  # CF lets none have a filling
        encoding[name]["_FillValue"] = None
    dataset.dump_to_store(NetCDF4DataStore(group), writer=writer, encoding=encoding)
    for target, values in later:
        target[...] = values


def _storage(values: "NDArray[Any]") -> dict[str, Any]:
    """Return how HDF5 keeps an array.

    In chunks with a checksum unless tiny, deflated when large.
    """
    if not values.ndim or values.dtype.kind in "OUS" or values.nbytes < TINY:
        return {}
    deflated = {"zlib": True, "complevel": 1} if values.nbytes > SMALL else {}
    chunks = {"chunksizes": values.shape} if values.nbytes <= ONE_CHUNK else {}
    return {"fletcher32": True, **deflated, **chunks}


def sealed(dataset: "xr.Dataset") -> "xr.Dataset":
    """Return a dataset with the hash of its content among its attributes."""
    return dataset.assign_attrs({SEAL: content_hash(dataset)})


def is_intact(dataset: "xr.Dataset") -> bool | None:
    """Say whether a dataset is what was sealed; None when it bears no seal.

    Parameters
    ----------
    dataset : as it was read
    """
    seal = dataset.attrs.get(SEAL)
    return None if seal is None else seal == content_hash(dataset)


def content_hash(dataset: "xr.Dataset", ignored: tuple[str, ...] = ()) -> str:
    """Return the SHA-256 over the content of a dataset.

    Over every variable's name, dims, values and attributes, and the global
    attributes.

    Numbers are hashed as little-endian bytes of their stored type, texts as JSON: the
    hash does not depend on compression or on the version of the file format. Run times
    and dates are left out: the same run computed twice by the same code bears the same
    seal. Left out too are attributes whose names begin as ``ignored``.

    Parameters
    ----------
    dataset : any
    ignored : beginnings of names of attributes that do not count
    """
    digest = hashlib.sha256()
    for name in sorted(
        name for name in map(str, dataset.variables) if not name.startswith(PASSING)
    ):
        variable = dataset.variables[name]
        digest.update(
            _json([name, list(variable.dims), list(variable.shape), variable.attrs])
        )
        if variable.dtype.kind in TEXT_KINDS:
            digest.update(_json(np.asarray(variable.values).tolist()))
            continue
        digest.update(variable.dtype.kind.encode())
        for values in _parts(variable):
            stored = values.astype(values.dtype.newbyteorder("<"), copy=False)
            digest.update(bytes(np.ascontiguousarray(stored).data))
    left_out = (SEAL, *PASSING, *ignored)
    attributes = {
        str(name): value
        for name, value in dataset.attrs.items()
        if not str(name).startswith(left_out)
    }
    digest.update(_json(attributes))
    return digest.hexdigest()


def _parts(variable: "xr.Variable") -> "Iterator[NDArray[Any]]":
    """Yield the values of a variable in their order, some at a time."""
    if variable.nbytes <= HASHED_AT_ONCE or not variable.ndim:
        yield np.asarray(variable.values)
        return
    count = max(1, HASHED_AT_ONCE * variable.shape[0] // variable.nbytes)
    for first in range(0, variable.shape[0], count):
        yield np.asarray(variable[first : first + count].values)


def results_hash(dataset: "xr.Dataset") -> str:
    """Return the SHA-256 over what a scene determines.

    Whenever and wherever it was computed.

    Parameters
    ----------
    dataset : a run
    """
    return content_hash(dataset, CIRCUMSTANCES)


def _json(value: Any) -> bytes:
    def plain(inner: Any) -> Any:
        return (
            inner.tolist() if isinstance(inner, np.ndarray | np.generic) else str(inner)
        )

    text = json.dumps(
        value, ensure_ascii=False, separators=(",", ":"), sort_keys=True, default=plain
    )
    return text.encode()


MOST = 5_000  # variables and groups of one file
MAX_ATTRIBUTES = 500  # of one variable or group
MAX_DIMS = 32  # of a variable, as HDF5 has it
DIMENSIONS = b"DIMENSION_LIST"  # lists a variable's dimensions
DEEPEST = 8  # groups within groups
FILTERS = (
    h5z.FILTER_SHUFFLE,
    h5z.FILTER_DEFLATE,
    h5z.FILTER_FLETCHER32,
)  # each once, in any order
FLOATS = {
    4: (31, 23, 8, 0, 23),
    8: (63, 52, 11, 0, 52),
}  # sign, exponent, its bits, mantissa, its bits


def refuse_untrusted(path: Path, image: bytes) -> None:
    """Refuse a file whose structure no run has.

    It would lead elsewhere, in circles, or fill the memory.

    Parameters
    ----------
    path : its name, for the message
    image : its bytes

    Raises
    ------
    StoreError : it has links, values in other files, groups within themselves, types of
        its own, or texts and chunks that are far larger when read
    """
    with readable(f"{path}:"), h5py.File(io.BytesIO(image), "r") as file:
        _Walk(path, len(image), file.id).group(h5g.open(file.id, b"/"), "", 0)


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
        self.reference = (
            8 + file.get_create_plist().get_sizes()[0]
        )  # bytes: a length, an address, a number

    def refuse(self, where: str, reason: str) -> None:
        raise StoreError(f"{self.path}: {where[:80] or '/'} {reason}; not read")

    def group(self, group: Any, where: str, depth: int) -> None:
        """Look at a group and all that it holds."""
        self.attributes(group, where)
        for key in group:
            inside = f"{where}/{key.decode(errors='replace')}"
            if group.links.get_info(key).type != h5py.h5l.TYPE_HARD:
                self.refuse(inside, "is a link to elsewhere")
            entry = h5o.open(group, key)
            information = h5o.get_info(entry)
            address = (information.fileno, information.addr)
            if address in self.seen:
                self.refuse(inside, f"is {self.seen[address]} once more")
            if len(self.seen) >= MOST or depth >= DEEPEST:
                self.refuse(inside, "is one of too many")
            self.seen[address] = inside
            if isinstance(entry, h5g.GroupID):
                self.group(entry, inside, depth + 1)
            elif isinstance(entry, h5d.DatasetID):
                self.variable(entry, inside)
            else:
                self.refuse(inside, "is a type and no variable")

    def variable(self, dataset: Any, where: str) -> None:
        properties = dataset.get_create_plist()
        kind = dataset.get_type()
        if leads_elsewhere(properties):
            self.refuse(where, "has its values in other files")
        if not _is_plain(kind):
            self.refuse(where, "holds neither numbers, as a run has them, nor texts")
        if properties.get_layout() == h5d.CHUNKED:
            refuse_oversized(
                self.path,
                math.prod(properties.get_chunk()) * kind.get_size(),
                self.size,
            )
            used = [
                properties.get_filter(number)[0]
                for number in range(properties.get_nfilters())
            ]
            if len(used) > len(set(used)) or not set(used) <= set(FILTERS):
                self.refuse(where, "is stored by other filters than a run")
        self.attributes(dataset, where)
        if _is_text(kind):
            self.texts(dataset, where)

    def attributes(self, entry: Any, where: str) -> None:
        """Read the texts of attributes: of all others HDF5 tells the size."""
        if (count := h5a.get_num_attrs(entry)) > MAX_ATTRIBUTES:
            self.refuse(where, f"has {count} attributes")
        information: dict[bytes, Any] = {}
        h5a.iterate(entry, information.__setitem__, info=True)
        for name, details in information.items():
            usual = (
                name == DIMENSIONS and details.data_size <= MAX_DIMS * self.reference
            )
            if usual or details.data_size % self.reference:
                continue
            attribute = h5a.open(entry, name)
            if attribute.shape is None:  # an empty text
                continue
            kind = attribute.get_type()
            count = math.prod(attribute.shape)
            is_long = kind.get_class() == h5t.VLEN or _is_text(
                kind
            )  # its values stand elsewhere in the file
            if is_long and count > 1 and count * self.size > HARMLESS:
                self.refuse(where, "has lists that may be far larger than the file")
            if _is_text(kind):
                texts = np.empty(attribute.shape, attribute.dtype)
                attribute.read(texts)
                self.spend(texts, where)

    def texts(self, entry: Any, where: str) -> None:
        """Read texts of any length a few at a time.

        Until they take more than they may.
        """
        space = entry.get_space()
        shape = entry.shape
        count = math.prod(shape)
        batch_size = max(1, HARMLESS // self.size)
        for first in range(0, count, batch_size):
            places = np.arange(first, min(first + batch_size, count))
            if shape:
                space.select_elements(np.stack(np.unravel_index(places, shape), axis=1))
            texts = np.empty(len(places), entry.dtype)
            entry.read(h5s.create_simple(texts.shape), space, texts)
            self.spend(texts, where)

    def spend(self, texts: NDArray[Any], where: str) -> None:
        self.left -= sum(map(len, texts.flat))
        if self.left < 0:
            self.refuse(where, "has texts that are far larger than the file")


def leads_elsewhere(properties: Any) -> bool:
    """Say whether a variable that is made so has its values in other files."""
    return bool(
        properties.get_layout() == h5d.VIRTUAL or properties.get_external_count() > 0
    )


def _is_plain(kind: Any) -> bool:
    """Say whether a type is of texts, or of numbers that netCDF knows.

    It aborts the process at others.
    """
    form = kind.get_class()
    size = kind.get_size()
    if form == h5t.INTEGER:
        return bool(size in (1, 2, 4, 8) and kind.get_precision() == 8 * size)
    return bool(
        form == h5t.STRING
        or (form == h5t.FLOAT and FLOATS.get(size) == kind.get_fields())
    )


def _is_text(kind: Any) -> bool:
    """Say whether values of a type are texts of any length."""
    return bool(kind.get_class() == h5t.STRING and kind.is_variable_str())

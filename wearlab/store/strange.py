"""What a file of a stranger may not hold: values that lie in other files, circles, types of its own, echoes.

HDF5 is asked itself, without the objects that h5py makes of every answer: a quarter of the time.
"""

import io
import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5o, h5s, h5t, h5z
from numpy.typing import NDArray

from wearlab.store.bounds import HARMLESS, refuse_oversized
from wearlab.store.errors import StoreError

MOST = 5_000  # variables and groups of one file
MOST_ATTRIBUTES = 500  # of one variable or group
MOST_DIMS = 32  # of a variable, as HDF5 has it
DIMENSIONS = b"DIMENSION_LIST"  # lists a variable's dimensions
DEEPEST = 8  # groups within groups
FILTERS = (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE, h5z.FILTER_FLETCHER32)  # each once, in any order
FLOATS = {4: (31, 23, 8, 0, 23), 8: (63, 52, 11, 0, 52)}  # sign, exponent, its bits, mantissa, its bits


def refuse_strange(path: Path, image: bytes) -> None:
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

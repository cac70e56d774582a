"""What a file of a stranger may not hold: values that lie in other files, circles, types of its own, echoes.

HDF5 is asked itself, without the objects that h5py makes of every answer: a quarter of the time.
"""

import io
import math
from pathlib import Path
from typing import Any

import h5py
from h5py import h5a, h5d, h5g, h5o, h5t, h5z

from wearlab.store.bounds import HARMLESS, refuse_oversized
from wearlab.store.errors import StoreError

MOST = 5_000  # variables and groups of one file
MOST_ATTRIBUTES = 500  # of one variable or group
MOST_DIMS = 32  # of a variable, as HDF5 has it
DEEPEST = 8  # groups within groups
FILTERS = (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE, h5z.FILTER_FLETCHER32)  # each once, in any order
FLOATS = {4: (31, 23, 8, 0, 23), 8: (63, 52, 11, 0, 52)}  # sign, exponent, its bits, mantissa, its bits
HEAP = b"GCOL"  # begins what holds texts of any length, and lists


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
            _Walk(path, len(image), _largest_in_heaps(image)).enter(h5g.open(file.id, b"/"), "", 0)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        if isinstance(error, StoreError):
            raise
        raise StoreError(f"{path}: cannot be read ({error}); try 'wearlab verify'") from error


def _largest_in_heaps(image: bytes) -> int:
    """Return the bytes of the largest thing that anything of variable length can refer to, at least."""
    largest, at = 0, image.find(HEAP)
    while at >= 0:
        largest = max(largest, _largest_in_heap(image, at, int.from_bytes(image[at + 8 : at + 16], "little")))
        at = image.find(HEAP, at + 4)
    return largest


def _largest_in_heap(image: bytes, at: int, length: int) -> int:
    """Return the bytes of the largest object of one heap: before each stand its number and its length."""
    end, largest, at = min(at + length, len(image)), 0, at + 16
    while at + 16 <= end:
        number, size = image[at : at + 2], int.from_bytes(image[at + 8 : at + 16], "little")
        if number == b"\0\0":
            break
        largest = max(largest, size)
        at += 16 + size + -size % 8
    return largest


class _Walk:
    """One look at everything that a file holds.

    Parameters
    ----------
    path, size : the file and its bytes
    largest : bytes of the largest text or list
    """

    def __init__(self, path: Path, size: int, largest: int) -> None:
        self.path, self.size, self.largest = path, size, largest
        self.seen: dict[Any, str] = {}
        self.left = max(HARMLESS, 20 * size)  # bytes that texts may still take
        self.echoes = largest * (size // 16) > self.left
        """Whether texts could take more, were each of sixteen bytes to refer to the largest."""

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
        if self.echoes and _is_long(kind):
            self.texts(dataset, where)

    def chunks(self, made: Any, width: int, where: str) -> None:
        """Refuse filters that no run has, and chunks that are far larger than the file."""
        refuse_oversized(self.path, math.prod(made.get_chunk()) * width, self.size)
        used = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
        if len(used) > len(set(used)) or not set(used) <= set(FILTERS):
            self.refuse(where, "is stored by other filters than a run")

    def attributes(self, entry: Any, where: str) -> None:
        count = h5a.get_num_attrs(entry)
        if count > MOST_ATTRIBUTES:
            self.refuse(where, f"has {count} attributes")
        for number in range(count) if self.echoes else ():
            attribute = h5a.open(entry, index=number)
            kind, many = attribute.get_type(), math.prod(attribute.shape)
            if not _is_long(kind):
                continue
            if many == 1 and kind.get_class() == h5t.STRING:
                holder = h5py.Group(entry) if isinstance(entry, h5g.GroupID) else h5py.Dataset(entry)
                self.spend(len(holder.attrs[attribute.name]), where)
            elif many > MOST_DIMS:  # what names the dimensions has fewer
                self.spend(many * self.largest, where)

    def texts(self, entry: Any, where: str) -> None:
        """Read texts of any length a few at a time, until they take more than they may."""
        variable, count = h5py.Dataset(entry), math.prod(entry.shape)
        if len(entry.shape) != 1 or count * self.largest <= HARMLESS:
            self.spend(count * self.largest, where)
            return
        some = max(1, HARMLESS // self.largest)
        for at in range(0, count, some):
            self.spend(sum(map(len, variable[at : at + some])), where)

    def spend(self, size: int, where: str) -> None:
        self.left -= size
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


def _is_long(kind: Any) -> bool:
    """Say whether values of a type are of any length, and so stand elsewhere in the file."""
    return kind.get_class() == h5t.VLEN or (kind.get_class() == h5t.STRING and kind.is_variable_str())

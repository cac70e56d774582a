"""What a file of a stranger may not hold: values that lie in other files, circles, types of its own."""

import io
from pathlib import Path
from typing import Any

import h5py

from wearlab.store.errors import StoreError

MOST = 20_000  # variables and groups of one file
DEEPEST = 8  # groups within groups
NUMBERS_AND_TEXTS = "biufSO"  # kinds of values; texts of any length are objects to h5py


def refuse_strange(path: Path, image: bytes) -> None:
    """Refuse a file whose structure no run has: it would lead a reader elsewhere, or round in circles.

    Parameters
    ----------
    path : its name, for the message
    image : its bytes

    Raises
    ------
    StoreError : it has links, values in other files, groups within themselves, or types of its own
    """
    try:
        with h5py.File(io.BytesIO(image), "r") as file:
            _walk(file, path, {}, 0)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        if isinstance(error, StoreError):
            raise
        raise StoreError(f"{path}: cannot be read ({error}); try 'wearlab verify'") from error


def _walk(group: Any, path: Path, seen: dict[int, str], depth: int) -> None:
    for name in group:
        where = f"{group.name.rstrip('/')}/{name}"[:80]
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise StoreError(f"{path}: {where} is a link to elsewhere; not read")
        one = group[name]
        address = h5py.h5o.get_info(one.id).addr
        if address in seen or len(seen) >= MOST or depth >= DEEPEST:
            reason = f"is {seen[address]} once more" if address in seen else "is one of too many"
            raise StoreError(f"{path}: {where} {reason}; not read")
        seen[address] = where
        if isinstance(one, h5py.Group):
            _walk(one, path, seen, depth + 1)
        elif not isinstance(one, h5py.Dataset):
            raise StoreError(f"{path}: {where} is a type and no variable; not read")
        elif one.external or one.is_virtual:
            raise StoreError(f"{path}: {where} has its values in other files; not read")
        elif one.dtype.kind not in NUMBERS_AND_TEXTS or _is_no_text(one.dtype):
            raise StoreError(f"{path}: {where} holds neither numbers nor texts; not read")


def _is_no_text(dtype: Any) -> bool:
    return dtype.kind == "O" and h5py.check_string_dtype(dtype) is None

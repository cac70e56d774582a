"""What a store from a stranger may not do: lead out of its folder, or claim more than its files can hold."""

import os
import re
from pathlib import Path

from wearlab.store.errors import StoreError

HARMLESS = 64_000_000  # bytes that any file may claim
DENSEST = 2_000  # bytes of values in one byte of a file: no more than a thousand can be deflated into it
LARGEST = 4_000_000_000  # bytes that a file may claim beyond twenty times its own
NUMBER = re.compile(r"[<>|=]?[biuf][1248]")


def refuse_links(path: str | Path) -> None:
    """Refuse a run's path where it, its folder, or the folder of all runs is a link.

    Raises
    ------
    StoreError : one is
    """
    folder = os.path.dirname(path)
    for place in (path, folder, os.path.dirname(folder)):
        if os.path.islink(place):
            raise StoreError(f"{place}: is a link; a store reads and writes its own files only")


def refuse_oversized(path: str | Path, claimed: int, size: int | None = None) -> None:
    """Refuse a file that claims to hold far more than its bytes can: reading it would fill the memory.

    Parameters
    ----------
    path : the file
    claimed : bytes of its values
    size : bytes of the file [asked of the file system]

    Raises
    ------
    StoreError : it does
    """
    if size is None:
        try:
            size = os.stat(path).st_size
        except OSError:
            size = 0
    if claimed > max(HARMLESS, min(DENSEST * size, LARGEST), 20 * size):
        raise StoreError(f"{path}: claims {claimed:.3g} bytes of values in a file of {size} bytes; not read")


def number_type(text: str) -> str:
    """Return the name of a type of numbers, as the catalogue has it.

    Raises
    ------
    StoreError : it is none
    """
    if not NUMBER.fullmatch(text):
        raise StoreError(
            f"the catalogue names {text[:40]!r} as a type of numbers; 'wearlab reindex' mends it"
        )
    return text

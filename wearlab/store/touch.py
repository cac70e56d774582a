"""A run's file is compared with its recorded hash the first time a process reads it, and when it has changed.

What was found sound is remembered by size, times and inode: reading a run again costs one look at these.
"""

import hashlib
import io
import os
from pathlib import Path
from typing import NamedTuple

from wearlab.store.bounds import refuse_links
from wearlab.store.errors import StoreError
from wearlab.store.remote import fetch


class Stamp(NamedTuple):
    """By what a file is known again, and the hash that was found then."""

    size: int
    modified: int
    changed: int
    inode: int
    sha256: str


_known: dict[str, Stamp] = {}


def content(path: str | Path, sha256: str | None) -> bytes:
    """Return all bytes of a run's file, compared with its hash; without a hash as they are.

    Raises
    ------
    StoreError : the file is gone, a link, or not what was written
    """
    refuse_links(path)
    status, document = _read(path)
    if sha256 not in (None, hashlib.sha256(document).hexdigest()) and fetch(Path(path)):
        status, document = _read(path)  # it was computed again where it comes from
    if sha256 is not None:
        if hashlib.sha256(document).hexdigest() != sha256:
            _known.pop(str(path), None)
            raise StoreError(
                f"{path}: is not what was written: its bytes do not have the recorded hash {sha256[:12]}…; "
                "'wearlab verify' names all such files, 'wearlab run' computes anew what is removed"
            )
        _known[str(path)] = _mark(status, sha256)
    return document


def _read(path: str | Path) -> tuple[os.stat_result, bytes]:
    try:
        if not os.path.exists(path):
            fetch(Path(path))
        with open(path, "rb") as file:
            return os.fstat(file.fileno()), file.read()
    except OSError as error:
        reason = error.strerror or error
        raise StoreError(f"{path}: cannot be read ({reason}); try 'wearlab verify'") from error


def source(path: str, sha256: str | None) -> str | io.BytesIO:
    """Return where a run is read from: its checked bytes at first touch, later the file itself.

    Raises
    ------
    StoreError : as of `content`
    """
    try:
        seen = _mark(os.lstat(path), sha256 or "")
    except OSError:
        seen = None
    if seen is not None and _known.get(path) == seen:
        refuse_links(path)
        return path
    return io.BytesIO(content(path, sha256))


def _mark(status: os.stat_result, sha256: str) -> Stamp:
    return Stamp(status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino, sha256)

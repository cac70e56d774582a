"""Bounded reading of files that users name, and the folder of compiled code."""

import atexit
import json
import logging
import math
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp
from typing import Any

OTHERS = stat.S_IRWXG | stat.S_IRWXO


def cache_folder() -> Path:
    """Return ``WEARLAB_CACHE``, or ``~/.cache/wearlab`` where that is not set."""
    return Path(
        os.environ.get("WEARLAB_CACHE") or Path.home() / ".cache" / "wearlab"
    ).absolute()


def writable(folder: Path) -> Path:
    """Return the folder, or a temporary one where that cannot be written.

    The temporary folder belongs to this process and its children. Another user's cache
    is never taken, because compiled code from it would be run.

    Parameters
    ----------
    folder : an existing folder
    """
    _close_to_others(folder)
    if not os.environ.get("WEARLAB_CACHE"):
        _close_to_others(cache_folder())
    try:
        with TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        temporary = Path(mkdtemp(prefix="wearlab-cache-"))
        atexit.register(_remove, temporary, os.getpid())
        os.environ["WEARLAB_CACHE"] = str(temporary)
        logging.getLogger("wearlab").warning(
            "%s: cannot be written (%s): every command compiles anew; set "
            "WEARLAB_CACHE to a folder of yours",
            folder.parent,
            error.strerror or error,
        )
        return temporary


def _close_to_others(folder: Path) -> None:
    """Let nobody else read or write a folder of this user: its code would be run."""
    with suppress(OSError, AttributeError):  # some systems have no such modes
        status = folder.stat()
        if status.st_uid == os.getuid() and status.st_mode & OTHERS:
            folder.chmod(stat.S_IMODE(status.st_mode) & ~OTHERS)


def _remove(folder: Path, owner: int) -> None:
    """Remove a folder when the process that made it ends, not when a child ends."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def regular(path: str | Path) -> Iterator[BufferedReader]:
    """Open a file to read its bytes; a pipe or a device is refused without waiting.

    Parameters
    ----------
    path : the file

    Raises
    ------
    OSError : it cannot be read, or is no regular file
    """
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    with open(descriptor, "rb") as file:
        if not is_regular(descriptor):
            raise OSError(0, "not a file", str(path))
        yield file


def is_regular(path: str | Path | int) -> bool:
    """Say whether a path or a descriptor is of a regular file.

    Parameters
    ----------
    path : that exists
    """
    return stat.S_ISREG(os.stat(path).st_mode)


def finite_json(text: str) -> Any:
    """Return what a text of JSON holds, of a depth and of numbers that can be read.

    Parameters
    ----------
    text : that anybody may have written

    Raises
    ------
    ValueError : it is no JSON, nested too deep, or a number in it is too large

    >>> finite_json('{"width": 1e999}')
    Traceback (most recent call last):
    ...
    ValueError: 1e999 is too large a number
    """
    try:
        return json.loads(text, parse_float=_finite)
    except RecursionError:
        raise ValueError("tables within tables, too deep to be read") from None


def _finite(digits: str) -> float:
    number = float(digits)
    if math.isinf(number):
        raise ValueError(f"{digits[:20]} is too large a number")
    return number


def read_regular(path: str | Path, largest: float = math.inf) -> bytes:
    """Return a file's bytes.

    What only looks like a file (``/proc/kmsg``) neither hangs nor fills the memory.

    Parameters
    ----------
    path : the file
    largest : bytes that it may have [any]

    Raises
    ------
    OSError : it cannot be read, is no regular file, is larger, or has more in it than
        its size says
    """
    with regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > largest:
            message = f"{size} bytes are more than the {largest} of such a file"
            raise OSError(0, message, str(path))

        parts = []
        remaining = size + 1  # one byte more than the file has by its size
        while remaining and (part := file.read(remaining)):
            parts.append(part)
            remaining -= len(part)

    if remaining == 0:
        raise OSError(0, "not a file of a size that can be told", str(path))
    return b"".join(parts)

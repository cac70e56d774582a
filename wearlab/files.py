"""Bounded reading of files that users name, and the folder of compiled code."""

import atexit
import logging
import os
import shutil
import stat
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp


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


def _remove(folder: Path, owner: int) -> None:
    """Remove a folder when the process that made it ends, not when a child ends."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def read_regular(path: str | Path, largest: int) -> bytes:
    """Return a file's bytes.

    What only looks like a file (``/proc/kmsg``) neither hangs nor fills the memory.

    Parameters
    ----------
    path : the file
    largest : bytes that it may have

    Raises
    ------
    OSError : it cannot be read, is no regular file, is larger, or has more in it than
        its size says
    """
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    with open(descriptor, "rb", buffering=0) as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(0, "not a file", str(path))

        size = status.st_size
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

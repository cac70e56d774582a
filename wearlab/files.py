"""Files and folders: bounded reading of what people name, and the folder of compiled code and copies."""

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
    """Return the folder, or one of this process and its children alone where it cannot be written.

    Another user's cache is never taken: compiled code is run.
    """
    try:
        with TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        own = Path(mkdtemp(prefix="wearlab-cache-"))
        atexit.register(_drop, own, os.getpid())
        os.environ["WEARLAB_CACHE"] = str(own)
        logging.getLogger("wearlab").warning(
            "%s: cannot be written (%s): every command compiles anew; set "
            "WEARLAB_CACHE to a folder of yours",
            folder.parent,
            error.strerror or error,
        )
        return own


def _drop(folder: Path, owner: int) -> None:
    """Remove a folder when the process that made it leaves, not when a child of it does."""
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
    descriptor = os.open(
        path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    )
    with open(descriptor, "rb", buffering=0) as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(0, "not a file", str(path))
        if status.st_size > largest:
            raise OSError(
                0,
                f"{status.st_size} bytes are more than the {largest} of such a file",
                str(path),
            )
        parts = []
        left = status.st_size + 1
        while left and (part := file.read(left)):
            parts.append(part)
            left -= len(part)
    if left == 0:
        raise OSError(0, "not a file of a size that can be told", str(path))
    return b"".join(parts)

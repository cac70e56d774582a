"""Files that people name are read whole or refused: regular ones of a bounded size, no device or pipe."""

import os
import stat
from pathlib import Path


def read_regular(path: str | Path, largest: int) -> bytes:
    """Return a file's bytes; what only looks like a file (``/proc/kmsg``) neither hangs nor fills the memory.

    Parameters
    ----------
    path : the file
    largest : bytes that it may have

    Raises
    ------
    OSError : it cannot be read, is no regular file, is larger, or has more in it than its size says
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(descriptor, "rb", buffering=0) as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(0, "not a file", str(path))
        if status.st_size > largest:
            raise OSError(0, f"{status.st_size} bytes are more than the {largest} of such a file", str(path))
        parts, left = [], status.st_size + 1
        while left and (part := file.read(left)):
            parts.append(part)
            left -= len(part)
    if left == 0:
        raise OSError(0, "not a file of a size that can be told", str(path))
    return b"".join(parts)

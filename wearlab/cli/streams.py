"""Standard streams that were closed, are full, or whose reader has gone: no command fails because of them."""

import errno
import os
import sys
from contextlib import suppress

STANDARD = ("stdin", "stdout", "stderr")
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""What the system says of an output that takes no more."""


def fill_closed() -> None:
    """Let streams that this process was begun without (``>&-``) lead nowhere.

    A number that stays free is given to the next file that is opened: what a library prints would go into it.
    """
    for number, name in enumerate(STANDARD):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if number == 0 else "w", encoding="utf-8"))


def nowhere(stream: object) -> None:
    """Drop what a stream holds back and whatever comes, so that Python does not complain when it leaves."""
    with suppress(OSError, ValueError, AttributeError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())  # type: ignore[attr-defined]
        os.close(sink)

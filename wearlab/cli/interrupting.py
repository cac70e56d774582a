"""Ctrl-C: once, and the work ends in order; twice, and it ends at once. The store survives either."""

import os
import signal
import threading
from types import FrameType

from wearlab.cli.output import Status

SECOND = b"wearlab: interrupted twice: stopped at once; finished runs are kept, run again to continue\n"


def at_once_when_twice() -> None:
    """Let a second Ctrl-C end this process without any farewell.

    Whatever is written at that moment appears whole or not at all, and workers go when their parent does.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    first = signal.getsignal(signal.SIGINT)
    if first is not signal.default_int_handler:
        return  # somebody else decides here
    signal.signal(signal.SIGINT, _first)


def _first(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGINT, _second)
    raise KeyboardInterrupt


def _second(number: int, frame: FrameType | None) -> None:
    os.write(2, SECOND)
    os._exit(Status.INTERRUPTED)

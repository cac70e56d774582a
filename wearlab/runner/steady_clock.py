"""A clock for dask that only goes forward: the wall clock as it was at first, and the seconds since.

Dask and Tornado time what they wait for by the wall clock. Where that is set back by an hour while a campaign
runs, no message leaves a process for an hour.
"""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_wall = time.time
_BEGUN = time.time() - time.monotonic()


def steady() -> float:
    """Return the seconds since 1970 [s], as if nobody had set the wall clock since this process began."""
    return _BEGUN + time.monotonic()


@contextmanager
def steady_dask() -> Iterator[None]:
    """Let dask and Tornado ask the steady clock in this process."""
    changed = _changed()
    try:
        yield
    finally:
        for holder, name, before in changed:
            setattr(holder, name, before)


def _changed() -> list[tuple[Any, str, Any]]:
    """Give every module of dask.distributed that holds the wall clock the steady one; return what was."""
    from tornado.ioloop import IOLoop

    changed: list[tuple[Any, str, Any]] = [(IOLoop, "time", IOLoop.time)]
    IOLoop.time = lambda self: steady()  # type: ignore[method-assign]
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "distributed" and getattr(module, "time", None) is _wall:
            changed.append((module, "time", _wall))
            module.time = steady  # type: ignore[attr-defined]
    return changed


def dask_setup(worker: Any) -> None:
    """Give a worker process the steady clock for good; called by dask as it begins."""
    _changed()

"""How far long work is, told to whoever watches."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Tell = Callable[[int, int], None]
"""Called with how many parts are done, and how many there are."""
_WATCHER: ContextVar[Tell | None] = ContextVar("watcher", default=None)


@contextmanager
def watched_by(tell: Tell) -> Iterator[None]:
    """Let somebody be told how far the work of the block is.

    Parameters
    ----------
    tell : is told after each part
    """
    token = _WATCHER.set(tell)
    try:
        yield
    finally:
        _WATCHER.reset(token)


def each_told(parts: Collection[Item]) -> Iterator[Item]:
    """Yield the parts of a work, and tell who watches when each is done.

    Parameters
    ----------
    parts : of the work

    Examples
    --------
    >>> with watched_by(lambda done, total: print(f"{done} of {total}")):
    ...     names = list(each_told(["a", "b"]))
    0 of 2
    1 of 2
    2 of 2
    """
    tell = _WATCHER.get()
    if tell is None:
        yield from parts
        return
    tell(0, len(parts))
    for done, part in enumerate(parts, 1):
        yield part
        tell(done, len(parts))

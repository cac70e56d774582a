"""Kernels that several processes want: one compiles each, and the others do something else meanwhile.

Numba looks on disk once, and compiles what is not there yet: processes that begin together would compile
everything at the same time. A claim is a lock on one byte of a file, told by the kernel's name and types; it
ends with its process.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba.core import event

try:
    import fcntl
except ImportError:  # no such locks: every process compiles what it wants
    fcntl = None  # type: ignore[assignment]

__all__ = ["BeingCompiled", "leaving_to_others"]


class BeingCompiled(BaseException):
    """Another process is compiling the kernel that was called; no physics may take it for an error."""

    def __init__(self, descriptor: int, place: int) -> None:
        super().__init__(descriptor, place)
        self.descriptor, self.place = descriptor, place

    def wait(self) -> None:
        """Return when the other process has written what it compiled, or has ended."""
        fcntl.lockf(self.descriptor, fcntl.LOCK_EX, 1, self.place)
        fcntl.lockf(self.descriptor, fcntl.LOCK_UN, 1, self.place)


@contextmanager
def leaving_to_others() -> Iterator[None]:
    """Claim the kernels compiled inside, or raise `BeingCompiled` where another process has."""
    with ExitStack() as opened:
        if fcntl is not None:
            file = Path(numba.config.CACHE_DIR) / "claims"  # type: ignore[attr-defined]
            with suppress(OSError):
                descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o600)
                opened.callback(os.close, descriptor)
                claims = _Claims(descriptor)
                opened.enter_context(event.install_listener("numba:compile", claims))
                opened.enter_context(event.install_listener("numba:compiler_lock", claims))
        yield


def place_of(dispatcher: Any, types: Any) -> int:
    """Return the byte that stands for a kernel compiled for arguments of some types."""
    function = dispatcher.py_func
    name = f"{function.__module__}.{function.__qualname__}{types}"
    return int.from_bytes(sha256(name.encode()).digest()[:7], "big")


class _Claims(event.Listener):
    """Claims what is called from Python; what kernels call is part of theirs."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor, self.under_way, self.locks = descriptor, 0, 0
        self.held: int | None = None

    def on_start(self, told: Any) -> None:
        """Claim the outermost kernel, before anything of it is compiled."""
        if told.kind == "numba:compiler_lock":
            self.locks += 1
            return
        self.under_way += 1
        if self.under_way == 1 and told.data is not None:
            place = place_of(told.data["dispatcher"], told.data["args"])
            try:
                fcntl.lockf(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            except (BlockingIOError, PermissionError):
                raise BeingCompiled(self.descriptor, place) from None
            except OSError:
                return  # a file system without locks
            self.held = place

    def on_end(self, told: Any) -> None:
        """Give the claim back when the kernel is on disk, which is after its compilation."""
        if told.kind == "numba:compile":
            self.under_way -= 1
            return
        self.locks -= 1
        if self.locks == 0 and self.held is not None:
            fcntl.lockf(self.descriptor, fcntl.LOCK_UN, 1, self.held)
            self.held = None

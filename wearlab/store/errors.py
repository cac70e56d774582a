"""What a store says when it cannot do what it is asked, and what is wrong in it."""

from pathlib import Path
from typing import NamedTuple


class StoreError(Exception):
    """The store cannot be read, written or understood; the message names the path and the remedy."""


class Problem(NamedTuple):
    """Something in a store that is not as it should be.

    Parameters
    ----------
    path : the file
    kind : missing | truncated | altered | foreign | unfinished | unknown | unreadable
    message : one sentence
    """

    path: Path
    kind: str
    message: str


def stray(path: Path, *, held: bool) -> Problem | None:
    """Return what is wrong with a file in a folder of the store: half-written, or not one it ``held``."""
    if path.suffix == ".part":
        return Problem(path, "unfinished", "left by a process that died while writing; can be deleted")
    return None if held else Problem(path, "foreign", "not a file of this store")

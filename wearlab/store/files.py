"""Files that are there whole or not at all."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wearlab.store.errors import StoreError


@contextmanager
def written(path: Path) -> Iterator[None]:
    """Say which file the disk refuses.

    Raises
    ------
    StoreError : the disk refuses
    """
    try:
        yield
    except OSError as error:
        raise StoreError(f"{path}: cannot be written ({error.strerror or error})") from error


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it.

    Raises
    ------
    StoreError : the disk refuses; nothing half-written remains
    """
    part = part_of(path)
    with written(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            part.write_bytes(content)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Return a temporary name beside a file, that nobody else uses."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")

"""Which code this is: a hash of all of wearlab's Python sources, found without importing any of them."""

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parent


@cache
def source_hash() -> str:
    """Return the hash of all of wearlab's Python sources, 16 hexadecimal digits."""
    return hash_of(sorted(PACKAGE.rglob("*.py")))


def hash_of(files: Iterable[Path]) -> str:
    """Return the hash of some of the sources: their names and bytes."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]

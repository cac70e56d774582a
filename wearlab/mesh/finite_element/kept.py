"""Teeth of solid elements kept on disk: set up once for each shape, whatever runs and processes follow.

A file is named by what its tooth was made from: shape, slices, options, and the sources that compute. It
holds numbers alone, then its SHA-256, looked at before anything is read out of it; one that was cut short or
changed is made anew. The folder
(`wearlab.files.cache_folder`) keeps the teeth used last.
"""

import hashlib
import os
import time
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
from threadpoolctl import threadpool_limits

from wearlab.arrays import Array
from wearlab.files import cache_folder, read_regular
from wearlab.sources import PACKAGE, hash_of

KEPT_BYTES = 500_000_000
"""Of teeth on disk: 2 MB each of 26 slices, 10 MB of 53, 90 MB of 161."""
DIGEST = hashlib.sha256().digest_size
Arrays = tuple[Array, Array]


def kept_or_made(given: tuple[object, ...], make: Callable[[], Arrays]) -> Arrays:
    """Return two arrays as they were kept, or made and kept.

    Parameters
    ----------
    given : what they are made from, told in full by its repr
    make : makes them
    """
    name = hashlib.sha256(f"{_sources()} {given!r}".encode()).hexdigest()
    file = cache_folder() / "teeth" / f"{name}.npz"
    found = _read(file)
    if found is None:
        with threadpool_limits(1, user_api="blas"):  # threads would wait for each other on busy cores
            found = make()
        _write(file, found)
    return found


@cache
def _sources() -> str:
    """Return the hash of what computes: elements, outlines and gears."""
    return hash_of(sorted([*(PACKAGE / "mesh" / "finite_element").glob("*.py"), *PACKAGE.glob("gears/*.py")]))


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def _used(file: Path) -> None:
    """Note when a tooth was used last, to the nanosecond: file systems themselves count milliseconds."""
    now = time.time_ns()
    os.utime(file, ns=(now, now))


def _read(file: Path) -> Arrays | None:
    try:
        whole = read_regular(file, KEPT_BYTES)
        _used(file)
    except OSError:
        return None
    content, digest = whole[:-DIGEST], whole[-DIGEST:]
    if _digest(content) != digest:
        return None
    with np.load(BytesIO(content), allow_pickle=False) as kept:
        return kept["first"], kept["second"]


def _write(file: Path, arrays: Arrays) -> None:
    """Put a file in place whole, and drop those used longest ago; where it cannot be written keep none."""
    content = BytesIO()
    np.savez(content, first=arrays[0], second=arrays[1])
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=file.parent, suffix=".part", delete=False) as part:
            part.write(content.getvalue() + _digest(content.getvalue()))
        _used(Path(part.name))
        os.replace(part.name, file)
        kept = sorted(((one.stat(), one) for one in file.parent.iterdir()), key=lambda one: -one[0].st_mtime)
        for size, (_, old) in zip(np.cumsum([status.st_size for status, _ in kept]), kept, strict=True):
            if size > KEPT_BYTES:
                old.unlink(missing_ok=True)
    except OSError:
        pass

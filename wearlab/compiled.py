"""The one way to compile a kernel: ``@jit``, cached in a folder named by the sources it may contain.

Numba's disk cache does not notice an edit in another file that a kernel calls. So the cache folder carries
a hash of every source that holds kernels: an edit anywhere among them starts from an empty folder.
"""

import hashlib
import os
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

PACKAGE = Path(__file__).parent
KEPT_FOLDERS = 6


@cache
def source_hash() -> str:
    """Return the hash of all of wearlab's Python sources, 16 hexadecimal digits."""
    return _hash(sorted(PACKAGE.rglob("*.py")))


def _hash(files: list[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    """Return this build's folder of compiled code, and drop the folders of builds long gone."""
    root = Path(os.environ.get("WEARLAB_CACHE") or Path.home() / ".cache" / "wearlab")
    kernels = [f for f in sorted(PACKAGE.rglob("*.py")) if b"wearlab.compiled import" in f.read_bytes()]
    folder = root / f"{_hash(kernels)}-numba{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        for old in sorted(root.iterdir(), key=lambda f: f.stat().st_mtime)[:-KEPT_FOLDERS]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # an unwritable home: numba falls back to its own choice
    return folder


numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel without the interpreter, IEEE arithmetic kept, cached on disk."""
    compiled: Callable[..., Any] = numba.njit(cache=True, error_model="numpy")(function)
    return compiled

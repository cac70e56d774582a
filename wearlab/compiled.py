"""The one way to compile a kernel: ``@jit``, cached in a folder named by the sources it may contain.

Numba's disk cache does not notice an edit in another file that a kernel calls. So the cache folder carries
a hash of every source that holds kernels: an edit anywhere among them starts from an empty folder.
"""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

from wearlab.sources import PACKAGE, hash_of, source_hash

KEPT_FOLDERS = 6
__all__ = ["jit", "source_hash"]


def _cache_folder() -> Path:
    """Return this build's folder of compiled code, and drop the folders of builds long gone."""
    root = Path(os.environ.get("WEARLAB_CACHE") or Path.home() / ".cache" / "wearlab")
    kernels = [f for f in sorted(PACKAGE.rglob("*.py")) if b"wearlab.compiled import" in f.read_bytes()]
    folder = root / f"{hash_of(kernels)}-numba{numba.__version__}"
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

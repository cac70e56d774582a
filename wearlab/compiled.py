"""The one way to compile a kernel: ``@jit``, cached in a folder named by the sources it may contain.

Numba's disk cache does not notice an edit in another file that a kernel calls. So the cache folder carries
a hash of every source that holds kernels: an edit anywhere among them starts from an empty folder.
"""

import os
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.extending import overload

from wearlab.cache import cache_folder, writable
from wearlab.linking import Apart, Joined, Within
from wearlab.sources import PACKAGE, hash_of

KEPT_FOLDERS = 6
__all__ = ["jit", "jit_apart", "jit_inner", "jit_inner_apart", "jit_within", "overload_inner"]


def _cache_folder() -> Path:
    """Return this build's folder of compiled code, and drop the folders of builds long gone."""
    root = cache_folder()
    parts = (b"wearlab.compiled import", b"class KernelLibrary")
    kernels = [f for f in sorted(PACKAGE.rglob("*.py")) if any(part in f.read_bytes() for part in parts)]
    folder = root / f"{hash_of(kernels)}-numba{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        for old in sorted(root.glob("*-numba*"), key=lambda f: f.stat().st_mtime)[:-KEPT_FOLDERS]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # an unwritable home: said below
    return folder


numba.config.CACHE_DIR = str(writable(_cache_folder()))  # type: ignore[attr-defined]


KERNEL: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
"""IEEE arithmetic; no code by which C would call it."""
INNER: dict[str, Any] = {**KERNEL, "no_cpython_wrapper": True}
"""Nor code by which Python would call it: with large arguments that alone takes seconds."""


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel without the interpreter, IEEE arithmetic kept, cached on disk."""
    compiled: Callable[..., Any] = numba.njit(cache=True, pipeline_class=Joined, **KERNEL)(function)
    return compiled


def jit_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel as `jit` does, but never into its callers: for large bodies.

    A body copied into every caller, and these into theirs, is optimised again each time: compilation of the
    located contact changes alone took minutes.
    """
    compiled: Callable[..., Any] = numba.njit(cache=True, pipeline_class=Apart, **KERNEL)(function)
    return compiled


def jit_inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that is called from kernels alone: a part of theirs, on disk with them."""
    compiled: Callable[..., Any] = numba.njit(pipeline_class=Joined, **INNER)(function)
    return compiled


def jit_within(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a small kernel that is called from kernels alone, always into them.

    A call hands tuples over by value and indexes them in memory: looking at a step's contact that way takes
    four times as long, and the optimiser alone decides by the size of the caller.
    """
    compiled: Callable[..., Any] = numba.njit(pipeline_class=Within, **INNER)(function)
    return compiled


def jit_inner_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that is called from kernels alone, and never into them."""
    compiled: Callable[..., Any] = numba.njit(pipeline_class=Apart, **INNER)(function)
    return compiled


def overload_inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Choose by type what kernels do where they call ``function``: as `numba.extending.overload` does."""
    options: Any = {**INNER, "pipeline_class": Joined}
    chosen: Callable[..., Any] = overload(function, jit_options=options)
    return chosen


class SlowFunction(UserWarning):
    """A user's function that numba cannot compile runs as plain Python."""


def compiled_if_possible(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Return a user's function that compiles at its first call, or runs as it is, with a warning.

    Parameters
    ----------
    function : of numbers, arrays and named tuples of them
    name : by which the warning calls it
    """
    chosen: list[Callable[..., Any]] = []

    def call(*arguments: Any) -> Any:
        if chosen:
            return chosen[0](*arguments)
        compiled: Callable[..., Any] = numba.njit(error_model="numpy")(function)
        try:
            found = compiled(*arguments)
        except (numba.core.errors.NumbaError, NotImplementedError) as error:
            reason = str(error).strip().splitlines()[0]
            warnings.warn(f"{name} runs as plain Python: {reason}", SlowFunction, stacklevel=2)
            compiled, found = function, function(*arguments)
        chosen.append(compiled)
        return found

    call.__qualname__ = name
    return call

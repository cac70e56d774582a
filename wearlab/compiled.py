"""Compilation of kernels by ``@jit``, cached in a folder named by their sources.

Numba's disk cache does not notice an edit in another file that a kernel calls. So the
cache folder carries a hash of every source that holds kernels: an edit anywhere among
them starts from an empty folder.
"""

import os
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
from numba.extending import overload

from wearlab.files import cache_folder, writable
from wearlab.sources import PACKAGE, hash_of

KEPT_FOLDERS = 6


def _cache_folder() -> Path:
    """Return the folder of compiled code of these sources, and remove old ones."""
    root = cache_folder()
    parts = (b"wearlab.compiled import",)
    kernels = [
        f
        for f in sorted(PACKAGE.rglob("*.py"))
        if any(part in f.read_bytes() for part in parts)
    ]
    folder = root / f"{hash_of(kernels)}-numba{numba.__version__}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        for old in sorted(root.glob("*-numba*"), key=lambda f: f.stat().st_mtime)[
            :-KEPT_FOLDERS
        ]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # an unwritable home: said below
    return folder


numba.config.CACHE_DIR = str(writable(_cache_folder()))  # type: ignore[attr-defined]


KERNEL: Any = {"error_model": "numpy"}
"""IEEE arithmetic: a division by zero is infinite, not an exception."""


def _counting(counted: bool) -> dict[str, Any]:
    """Return the option that counts references or does not; {} where numba has none."""
    option: Any = {"_nrt": counted}
    try:
        numba.njit(**option)(lambda: None)
    except (KeyError, TypeError, NameError):
        return {}
    return option


COUNTED: Any = {**KERNEL, **_counting(True)}
"""The same for a kernel called from one without counted references: numba hands its
options down."""
UNCOUNTED: Any = {**KERNEL, **_counting(False)}
"""The same without counted references, for kernels that make no arrays.

Numba counts a reference to an array wherever one is read from a tuple: the steps of
small systems then take four to six times as long, and compile twice as long. Its manual
does not name the option; where a release drops it, kernels are slower, and right. """


def jit(
    function: Callable[..., Any] | None = None, *, counted: bool = True
) -> Callable[..., Any]:
    """Compile a kernel without the interpreter, IEEE arithmetic kept, cached on disk.

    Parameters
    ----------
    counted : False for a kernel that makes no arrays, and calls none that returns one,
        see `UNCOUNTED`
    """
    compiled: Callable[..., Any] = numba.njit(
        function, cache=True, **(COUNTED if counted else UNCOUNTED)
    )
    return compiled


def jit_inner(
    function: Callable[..., Any] | None = None,
    *,
    counted: bool = True,
    inline: bool = False,
) -> Callable[..., Any]:
    """Compile a kernel that only kernels call: it is part of theirs, also on disk.

    Parameters
    ----------
    counted : see `jit`
    inline : become part of every caller, however large, before it is compiled. For
        kernels called at every step that are handed tuples: a call hands these over by
        value, seven words an array or more, and indexes them in memory, which takes
        four times as long, and fifteen times where it is called for every part of a
        step. A kernel with one caller is compiled once less
    """
    options = COUNTED if counted else UNCOUNTED
    compiled: Callable[..., Any] = numba.njit(
        function, inline="always" if inline else "never", **options
    )
    return compiled


def by_type(choose: Callable[..., Any], *, counted: bool = False) -> Callable[..., Any]:
    """Return a function that compiled code chooses by the types of its arguments.

    Parameters
    ----------
    choose : returns the function for the types; ``instance_class`` of a named tuple's
        is its class
    counted : see `jit`
    """

    def call(*arguments: Any) -> Any:
        types = (
            SimpleNamespace(instance_class=type(argument)) for argument in arguments
        )
        return choose(*types)(*arguments)

    overload(call, jit_options=COUNTED if counted else UNCOUNTED, strict=False)(choose)
    return call


class SlowFunction(UserWarning):
    """A user's function that numba cannot compile runs as plain Python."""


def compiled_if_possible(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Return a user's function compiled at its first call, or as it is, with a warning.

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
            result = compiled(*arguments)
        except (numba.errors.NumbaError, NotImplementedError) as error:
            reason = str(error).strip().splitlines()[0]
            warnings.warn(
                f"{name} runs as plain Python: {reason}", SlowFunction, stacklevel=2
            )
            compiled = function
            result = function(*arguments)
        chosen.append(compiled)
        return result

    call.__qualname__ = name
    return call

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
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from wearlab.sources import PACKAGE, hash_of, source_hash

KEPT_FOLDERS = 6
__all__ = ["jit", "jit_apart", "jit_inner", "jit_inner_apart", "source_hash"]


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


class _ApartLower(Lower):
    """Marks the function so that its callers call it."""

    def post_lower(self) -> None:
        """Add the attribute once the body is there."""
        super().post_lower()
        self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _ApartLowering(NativeLowering):
    _name = "apart_lowering"

    @property
    def lowering_class(self) -> type[Lower]:
        return _ApartLower


class _Apart(CompilerBase):
    """The default pipeline with the lowering that keeps a function apart."""

    def define_pipelines(self) -> list[Any]:
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.passes = [
            (_ApartLowering if one is NativeLowering else one, said) for one, said in pipeline.passes
        ]
        pipeline.finalize()
        return [pipeline]


APART: dict[str, Any] = {"pipeline_class": _Apart}
INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Without the code by which Python would call it: with large arguments that alone takes seconds."""


def jit_inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel as `jit` does, to be called from kernels alone."""
    compiled: Callable[..., Any] = numba.njit(cache=True, error_model="numpy", **INNER)(function)
    return compiled


def jit_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel as `jit` does, but never into its callers: for large bodies off the hot path.

    A body copied into every caller, and these into theirs, is optimised again each time: compilation of the
    located contact changes alone took minutes.
    """
    compiled: Callable[..., Any] = numba.njit(cache=True, error_model="numpy", **APART)(function)
    return compiled


def jit_inner_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that is called from kernels alone, and never into them."""
    compiled: Callable[..., Any] = numba.njit(cache=True, error_model="numpy", **APART, **INNER)(function)
    return compiled

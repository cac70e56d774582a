"""How compiled kernels are put together: each is optimised once, and translated to machine code once.

Numba copies a kernel's code into every kernel that calls it, optimises the copy again with the caller, and
turns both into machine code: a kernel eight calls deep is optimised eight times. Here

- a kernel *apart* stays a declaration while its callers are optimised, and its own code, optimised already,
  is added when theirs is about to become machine code;
- an *inner* kernel, which only kernels call, never becomes machine code of its own.
"""

from typing import Any

import llvmlite.binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering


class KernelLibrary(JITCodeLibrary):
    """The code of one kernel.

    Parameters
    ----------
    codegen, name : as numba makes libraries
    apart : callers call it; its code is never copied into theirs
    inner : only kernels call it
    """

    def __init__(self, codegen: Any, name: str, *, apart: bool, inner: bool) -> None:
        super().__init__(codegen, name)
        self.apart, self.inner = apart, inner
        self.called: dict[KernelLibrary, None] = {}

    @property
    def codegen(self) -> Any:
        """The code generator; an inner kernel's knows no addresses, for there is no machine code."""
        return _NoAddresses if self.inner else self._codegen

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 for an inner kernel's."""
        if not self.inner:
            return int(super().get_pointer_to_function(name))
        self._ensure_finalized()
        return 0

    def add_linking_library(self, library: Any) -> None:
        """Take up the code of a kernel called: now, or at the end if it is apart."""
        library._ensure_finalized()
        if isinstance(library, KernelLibrary):
            self.called |= library.called
            if library.apart:
                self.called[library] = None
                return
        super().add_linking_library(library)

    def _finalize_final_module(self) -> None:
        """Keep what callers take up, add the kernels apart, and make machine code if Python calls it."""
        self._shared_module = _linkable(self._final_module)
        if self.inner:
            self._finalize_dynamic_globals()
            self._finalized = True
            return
        for library in reversed(self.called):  # callers first: what nothing calls yet would be left out
            self._final_module.link_in(library._shared_module, preserve=True)
        super()._finalize_final_module()

    def serialize_using_object_code(self) -> Any:
        """Return the library for the disk: its machine code, and the whole code for later callers."""
        self._ensure_finalized()
        whole = _linkable(self._final_module)
        return self.name, "object", (self._get_compiled_object(), whole.as_bitcode())


class _NoAddresses:
    @staticmethod
    def set_env(name: str, env: Any) -> None:
        """Do nothing: there is no variable to fill."""


def _linkable(module: Any) -> Any:
    """Return a copy of a module that may be linked into several others."""
    copy = module.clone()
    for function in copy.functions:
        if not function.is_declaration and function.linkage == llvm.Linkage.external:
            function.linkage = "linkonce_odr"
    return copy


class _ApartLower(Lower):
    """Marks the function so that its callers call it."""

    def post_lower(self) -> None:
        """Add the attribute once the body is there."""
        super().post_lower()
        self.function.attributes.add("noinline")


class _WithinLower(Lower):
    """Marks the function so that its callers take it in, however large they are."""

    def post_lower(self) -> None:
        """Add the attribute once the body is there."""
        super().post_lower()
        self.function.attributes.add("alwaysinline")


class _Lowering(NativeLowering):
    """The default lowering into a `KernelLibrary`."""

    apart = False

    def run_pass(self, state: Any) -> bool:
        """Lower the function of a compilation."""
        codegen, name = state.targetctx.codegen(), state.func_id.func_qualname
        state.library = KernelLibrary(
            codegen, name, apart=self.apart, inner=bool(state.flags.no_cpython_wrapper)
        )
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class _Joined(_Lowering):
    _name = "joined_lowering"  # type: ignore[assignment]


@register_pass(mutates_CFG=True, analysis_only=False)
class _Apart(_Lowering):
    _name = "apart_lowering"  # type: ignore[assignment]
    apart = True

    @property
    def lowering_class(self) -> type[Lower]:
        return _ApartLower


@register_pass(mutates_CFG=True, analysis_only=False)
class _Within(_Lowering):
    _name = "within_lowering"  # type: ignore[assignment]

    @property
    def lowering_class(self) -> type[Lower]:
        return _WithinLower


class _Compiler(CompilerBase):
    """The default pipeline with another lowering."""

    lowering: type[_Lowering]

    def define_pipelines(self) -> list[Any]:
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.passes = [
            (self.lowering if one is NativeLowering else one, said) for one, said in pipeline.passes
        ]
        pipeline.finalize()
        return [pipeline]


class Joined(_Compiler):
    """Compiles kernels that may be copied into their callers."""

    lowering = _Joined


class Apart(_Compiler):
    """Compiles kernels that stay apart from their callers."""

    lowering = _Apart


class Within(_Compiler):
    """Compiles kernels that become part of every caller: small ones, whose arguments are tuples."""

    lowering = _Within

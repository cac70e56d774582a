"""What holds for every compiled kernel."""

import ast
import gc
from collections.abc import Iterator

import numba
import numpy as np
import pytest
from numba.core.event import trigger_event
from numba.core.runtime import _nrt_python, rtsys

from wearlab.compiled import jit, jit_inner
from wearlab.sources import PACKAGE

ARRAYS_MADE = ("np.empty", "np.zeros", "np.full", "np.dot", ".copy()")


def kernels() -> Iterator[tuple[str, str, ast.FunctionDef]]:
    """Yield file, decorator and definition of every kernel."""
    for file in sorted(PACKAGE.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if "wearlab.compiled import" in text:
            for node in ast.walk(ast.parse(text)):
                for decorator in node.decorator_list if isinstance(node, ast.FunctionDef) else ():
                    if ast.unparse(decorator).startswith("jit"):
                        yield file.name, ast.unparse(decorator), node


def test_references_are_counted_where_arrays_are_made_and_nowhere_else() -> None:
    for file, decorator, kernel in kernels():
        makes = any(word in ast.unparse(kernel) for word in ARRAYS_MADE)
        assert makes == ("allocates=True" in decorator), f"{file}: {kernel.name}"


def test_only_kernels_that_make_arrays_call_those_that_return_one() -> None:
    """Else nobody counts the reference, and the array is never freed."""
    found = {kernel.name: kernel for _, _, kernel in kernels()}
    array = {
        name
        for name, kernel in found.items()
        if kernel.returns is not None and "Array" in ast.unparse(kernel.returns)
    }
    for file, decorator, kernel in kernels():
        called = {ast.unparse(node.func) for node in ast.walk(kernel) if isinstance(node, ast.Call)}
        assert "allocates=True" in decorator or not called & array, f"{file}: {kernel.name}"


@pytest.mark.parametrize("collects", [True, False])
def test_no_garbage_is_looked_for_while_kernels_compile(collects: bool) -> None:
    before = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        with trigger_event("numba:compile"):
            with pytest.raises(ZeroDivisionError), trigger_event("numba:compile"):
                raise ZeroDivisionError
            assert not gc.isenabled()
        assert gc.isenabled() == collects
    finally:
        (gc.enable if before else gc.disable)()


@jit_inner
def _fill(values: np.ndarray, factor: float) -> None:
    part = values[1:]
    for x in range(len(part)):
        part[x] *= factor


@jit_inner(allocates=True)
def _sum_of_doubled(values: np.ndarray) -> float:
    own = values.copy()
    _fill(own, 2.0)
    return float(own.sum())


def _twice(values: np.ndarray) -> float:
    _fill(values, 1.0)
    return _sum_of_doubled(values) + _sum_of_doubled(values[:2])


@pytest.mark.parametrize("allocates", [False, True])
def test_kernels_that_count_no_references_lose_no_memory(allocates: bool) -> None:
    compiled = numba.njit(_twice, **{"_nrt": allocates})
    values = np.arange(4.0)
    compiled(values)
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    for _ in range(100):
        assert compiled(values) == 2.0 * (1.0 + 2.0 + 3.0) + 2.0
    after = rtsys.get_allocation_stats()
    _nrt_python.memsys_disable_stats()
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free


def test_a_kernel_that_makes_arrays_has_to_say_so() -> None:
    def made(n: int) -> float:
        return float(np.empty(n).size)

    with pytest.raises(Exception, match="returning of array"):
        numba.njit(made, **{"_nrt": False})(3)
    assert jit(made, allocates=True) is not None

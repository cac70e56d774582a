"""Small vectors as tuples: their length is known to the compiler and their values stay in registers."""

from typing import Any

import numpy as np
from numba.cpython.unsafe.tuple import tuple_setitem

from wearlab.compiled import jit_inner

put: Any = tuple_setitem
START, MIDST, END = np.int64(0), np.int64(1), np.int64(2)
"""Stages of a step, of one type: for every literal numba would compile once more."""


@jit_inner
def take(like: Any, array: Any, offset: Any, stride: Any) -> Any:
    """Return ``array[offset + i stride]`` as a tuple of the length of ``like``."""
    out = like
    for i in range(len(like)):
        out = put(out, i, array[offset + np.uint64(i) * stride])
    return out


@jit_inner
def write(given: Any, out: Any) -> None:
    """Write ``given`` over the first entries of ``out``.

    Numba compiles for an assignment of arrays also what to say of unequal lengths, in text: seconds.
    """
    for x in range(np.uint64(0), np.uint64(len(given))):
        out[x] = given[x]


@jit_inner
def copy(source: Any, i: Any, target: Any, j: Any, size: Any) -> None:
    """Copy ``source[i : i + size]`` to ``target[j:]``, as `write` does."""
    for x in range(np.uint64(0), np.uint64(size)):
        target[j + x] = source[i + x]


@jit_inner
def add(a: Any, factor: float, b: Any) -> Any:
    """Return ``a + factor b`` of two tuples."""
    out = a
    for i in range(len(a)):
        out = put(out, i, a[i] + factor * b[i])
    return out

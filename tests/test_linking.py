"""Kernels are put together right: all compiled, all from the disk, and some of each."""

import subprocess
import sys

from wearlab.compiled import jit, jit_inner, jit_inner_apart

KERNELS = """
from wearlab.compiled import jit, jit_apart, jit_inner, jit_inner_apart

@jit_inner
def add(x, y):
    return x + y

@jit_inner_apart
def twice(x):
    return add(x, x)

@jit_inner_apart
def four_times(x):
    return twice(twice(x))

@jit_apart
def nine_times(x):
    return add(four_times(x), add(four_times(x), x))

@jit
def first(x):
    return add(nine_times(x), twice(x))
"""
LATER = """
@jit
def second(x):
    return nine_times(four_times(x)) + twice(x)
"""


def test_kernels_work_compiled_and_from_the_disk_and_mixed(tmp_path):
    module = tmp_path / "kernels_of_a_test.py"
    command = (
        "import kernels_of_a_test as k, sys; f = getattr(k, sys.argv[1]);"
        "print(f(1.5), sum(f.stats.cache_hits.values()), sum(k.nine_times.stats.cache_hits.values()))"
    )

    def run(name):
        done = subprocess.run(
            [sys.executable, "-c", command, name],
            cwd=tmp_path, capture_output=True, text=True, check=True, timeout=100,
        )  # fmt: skip
        return done.stdout.split()

    module.write_text(KERNELS + LATER)
    assert run("first") == ["16.5", "0", "0"]
    assert run("first") == ["16.5", "1", "0"]
    assert run("second") == ["57.0", "0", "1"]
    assert run("second") == ["57.0", "1", "0"]


def test_code_of_kernels_apart_is_in_their_callers_once_and_called():
    @jit_inner
    def add(x, y):
        return x + y

    @jit_inner_apart
    def twice(x):
        return add(x, x)

    @jit
    def outer(x):
        return twice(twice(add(x, 1.0)))

    assert outer(1.0) == 8.0
    code = next(iter(outer.inspect_llvm().values()))
    bodies = [line for line in code.splitlines() if line.startswith("define")]
    assert sum("twice" in line for line in bodies) == 1
    assert not any("3add" in line for line in bodies)

"""One process compiles a kernel, the others leave it to that one."""

import subprocess
import sys
from pathlib import Path

import numba
import pytest

from wearlab.claims import BeingCompiled, leaving_to_others, place_of
from wearlab.simulation.warm import is_done

OTHER = """
import fcntl, os, sys
descriptor = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
fcntl.lockf(descriptor, fcntl.LOCK_EX, 1, int(sys.argv[2]))
print("claimed", flush=True)
sys.stdin.read(int(sys.argv[3]))
"""


def double(x):
    return 2.0 * x


@pytest.fixture
def kernel():
    return numba.njit(double)


@pytest.fixture
def other(kernel):
    """Begin another process that compiles the kernel until it is told to end, or only for a moment."""
    begun = []

    def begin(asked: int = 1) -> subprocess.Popen:
        file = Path(numba.config.CACHE_DIR) / "claims"
        words = [str(file), str(place_of(kernel, (numba.float64,))), str(asked)]
        process = subprocess.Popen(
            [sys.executable, "-S", "-c", OTHER, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        begun.append(process)
        assert process.stdout.readline() == b"claimed\n"
        return process

    yield begin
    for process in begun:
        process.communicate()


def test_a_kernel_that_another_process_compiles_is_left_to_it(kernel, other):
    process = other()
    with leaving_to_others():
        with pytest.raises(BeingCompiled) as claimed:
            kernel(1.0)
        assert not kernel.signatures
        process.communicate()
        claimed.value.wait()
        assert kernel(1.0) == 2.0


def test_without_others_nothing_is_left(kernel, other):
    other()
    assert kernel(1.0) == 2.0


def test_a_job_is_left_undone_or_waits(kernel, other):
    done = []

    def job(scene):
        done.append(kernel(scene))

    process = other()
    assert not is_done((job, 1.0), patient=False)
    process.communicate()
    other(asked=0)  # which ends by itself
    assert is_done((job, 1.0), patient=True)
    assert done == [2.0]


def test_a_claim_is_held_while_the_kernel_compiles_and_then_given_back(kernel):
    """Seen from another process, as one's own locks bar nobody."""
    look = (
        "import fcntl, os, sys\nd = os.open(sys.argv[1], os.O_RDWR)\n"
        "try:\n    fcntl.lockf(d, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, int(sys.argv[2]))\n"
        "except BlockingIOError:\n    sys.exit('barred')\n"
    )
    words = [str(Path(numba.config.CACHE_DIR) / "claims"), str(place_of(kernel, (numba.float64,)))]
    seen = []

    def looked():
        return subprocess.run([sys.executable, "-S", "-c", look, *words], capture_output=True)

    class Looks(numba.core.event.Listener):
        def on_start(self, told):
            pass

        def on_end(self, told):
            seen.append(looked().stderr)

    with leaving_to_others():
        with numba.core.event.install_listener("numba:compile", Looks()):
            kernel(1.0)
        after = looked()
    assert seen[-1] == b"barred\n"
    assert after.returncode == 0

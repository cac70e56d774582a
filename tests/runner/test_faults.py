"""What happens to a store when processes are killed, interrupted, or work at the same
time. All are real.
"""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import fake_campaign
import pytest

from wearlab.store import Store

SCRIPT = Path(fake_campaign.__file__).parent / "run_fake.py"
PATIENCE = 60.0

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")


class Scene:
    """A store, a log of simulations, and a gate that holds
    simulations until it is opened.
    """

    def __init__(self, folder):
        self.folder = folder
        self.store = Store(folder / "store")
        self.log = folder / "log"
        self.gate = folder / "gate"
        self.children = []

    def start(self, count):
        """Run a campaign of ``count`` cases in a process of its own,
        in a session of its own.
        """
        command = [
            sys.executable,
            "-W",
            "error",
            SCRIPT,
            self.store.path,
            count,
            self.log,
            self.gate,
        ]
        child = subprocess.Popen(
            list(map(str, command)),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: signal.signal(
                signal.SIGINT, signal.SIG_DFL
            ),  # a test run in the background has none
        )
        self.children.append(child)
        return child

    def simulations(self):
        """Return (speed, worker) of every simulation begun so far."""
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        return [
            (float(speed), int(worker))
            for speed, worker in (line.split() for line in lines)
        ]

    def until(self, condition):
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "waited in vain"
            time.sleep(0.02)

    def done(self):
        return [i for i, e in self.store.archive.entries().items() if e.state == "done"]


@pytest.fixture
def scene(tmp_path):
    made = Scene(tmp_path)
    yield made
    made.store.close()
    for child in made.children:
        if child.poll() is None:
            child.kill()
        child.communicate(timeout=PATIENCE)


def running(pid):
    """Say whether a process exists and is more than a zombie."""
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        )
    except OSError:
        return False


def test_killed_then_completed(scene):
    """kill -9 of the parent loses the runs in flight; the workers go too.

    The next run does the rest.
    """
    first = scene.start(6)
    scene.until(lambda: len(scene.simulations()) >= 2)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate(timeout=PATIENCE)
    workers = {worker for _, worker in scene.simulations()}
    scene.until(lambda: not any(map(running, workers)))
    entries = scene.store.archive.entries().values()
    assert entries
    assert all(scene.store.archive.is_stale(entry) for entry in entries)
    scene.gate.touch()
    second = scene.start(6)
    output, _ = second.communicate(timeout=PATIENCE)
    assert (second.returncode, output) == (0, "computed 6 of 6\n")
    assert scene.store.verify() == []
    assert not any((scene.store.path / "runners").iterdir())


@pytest.mark.parametrize("whole_group", [False, True], ids=["parent", "terminal"])
def test_interrupted_then_completed(scene, whole_group):
    """Ctrl-C reaches the parent alone or, in a terminal, the workers too: one message,
    nothing in flight.
    """
    first = scene.start(5)
    scene.until(lambda: len(scene.simulations()) >= 2)
    (os.killpg if whole_group else os.kill)(first.pid, signal.SIGINT)
    output, _ = first.communicate(timeout=PATIENCE)
    assert (first.returncode, output) == (
        130,
        "interrupted: 0 done, 5 to go; run again to continue\n",
    )
    assert scene.store.archive.entries() == {}
    assert not any(running(worker) for _, worker in scene.simulations())
    if whole_group:
        scene.gate.touch()
        second = scene.start(5)
        assert second.communicate(timeout=PATIENCE)[0] == "computed 5 of 5\n"


def test_two_runs_share_one_campaign(scene):
    """Two processes on one store compute every case once between them, and both end
    with all of it.
    """
    first = scene.start(10)
    second = scene.start(10)
    scene.until(lambda: len({worker for _, worker in scene.simulations()}) == 4)
    scene.gate.touch()
    outputs = [child.communicate(timeout=PATIENCE)[0] for child in (first, second)]
    assert [child.returncode for child in (first, second)] == [0, 0]
    computed = [int(output.split()[1]) for output in outputs]
    assert sum(computed) == 10
    assert min(computed) >= 2
    assert set(Counter(speed for speed, _ in scene.simulations()).values()) == {1}
    assert len(scene.done()) == 10
    assert scene.store.verify() == []


def test_a_second_run_finishes_what_the_killed_first_had(scene):
    """A run that waits for another takes over when that one dies."""
    first = scene.start(2)
    scene.until(lambda: len(scene.simulations()) >= 2)
    second = scene.start(2)
    scene.until(lambda: len(list((scene.store.path / "runners").glob("*.lock"))) == 2)
    os.kill(first.pid, signal.SIGKILL)
    scene.gate.touch()
    assert second.communicate(timeout=PATIENCE)[0] == "computed 2 of 2\n"
    assert len(scene.done()) == 2


FULL_DISK = """
import resource, signal, sys
import fake_campaign
import wearlab
from wearlab.store import netcdf
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
encoded = netcdf.encoded
def then_full(dataset):
    content = encoded(dataset)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
    return content
netcdf.encoded = then_full
campaign = fake_campaign.sweep(1, updates=100000)
try:
    wearlab.run(campaign, wearlab.Store(sys.argv[1]), simulate=fake_campaign.SIMULATE)
except wearlab.store.StoreError as error:
    print(error)
"""


def test_a_full_disk_is_said_and_leaves_nothing_half_written(scene):
    environment = {**os.environ, "PYTHONPATH": str(SCRIPT.parent)}
    command = [sys.executable, "-W", "error", "-c", FULL_DISK, str(scene.store.path)]
    output = subprocess.run(
        command, capture_output=True, text=True, env=environment, check=True
    ).stdout
    assert "cannot be written (File too large)" in output
    assert scene.store.archive.entries() == {}
    assert scene.store.verify() == []

"""A scheduler and workers that somebody else started: real processes,
as on a cluster.
"""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import dask
import fake_campaign
import fake_life
import numpy as np
import pytest
from fake_campaign import SIMULATE, sweep

import wearlab
from wearlab.runner import RunnerError
from wearlab.sources import PACKAGE, source_hash
from wearlab.store import Store

PATIENCE = 120.0

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them"),
]


class Cluster:
    """Starts ``dask scheduler`` and ``dask worker``, and ends them."""

    def __init__(self, folder, *words):
        self.folder = folder
        self.children = []
        self.file = folder / "scheduler.json"
        self.start(
            "scheduler",
            "--port",
            "0",
            "--host",
            "127.0.0.1",
            "--scheduler-file",
            self.file,
            *words,
        )
        until(self.file.exists)

    def start(self, role, *words, path=()):
        support = str(Path(fake_campaign.__file__).parent)
        here = os.environ.get("PYTHONPATH", "")
        places = os.pathsep.join([*map(str, path), support, *here.split(os.pathsep)])
        command = [
            sys.executable,
            "-m",
            f"distributed.cli.dask_{role}",
            "--no-dashboard",
            *map(str, words),
        ]
        child = subprocess.Popen(
            command,
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": places},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.children.append(child)
        return child

    def worker(self, *, path=()):
        words = (
            "--scheduler-file",
            self.file,
            "--nthreads",
            "1",
            "--no-nanny",
            "--host",
            "127.0.0.1",
        )
        return self.start("worker", *words, path=path)

    @property
    def address(self):
        import json

        return json.loads(self.file.read_text())["address"]

    def close(self):
        for child in self.children:
            child.kill()
        for child in self.children:
            child.wait(PATIENCE)


@pytest.fixture
def there(tmp_path):
    source_hash.cache_clear()
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.close()


@pytest.fixture
def edited(tmp_path):
    """Return a folder with another wearlab: one comment more."""
    folder = tmp_path / "edited"
    shutil.copytree(
        PACKAGE, folder / "wearlab", ignore=shutil.ignore_patterns("__pycache__")
    )
    with (folder / "wearlab" / "units.py").open("a") as file:
        file.write("# edited\n")
    return folder


def until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def begun(log):
    """Return the process of every simulation begun so far."""
    return (
        [int(line.split()[1]) for line in log.read_text().splitlines()]
        if log.exists()
        else []
    )


def run(campaign, store, cluster):
    return wearlab.run(
        campaign,
        store,
        scheduler=cluster.address,
        simulate=SIMULATE,
        progress=False,
        dashboard=False,
    )


def test_killed_and_strange_workers_lose_nothing(there, edited, tmp_path):
    """One of two workers is killed, a third has other code and gets nothing.

    Only the parent writes.
    """
    log = tmp_path / "log"
    store = Store(tmp_path / "store")
    campaign = sweep(80, log=str(log), act="slow")
    steady = there.worker()
    doomed = there.worker()
    reports = []
    here = threading.Thread(target=lambda: reports.append(run(campaign, store, there)))
    here.start()
    until(lambda: {steady.pid, doomed.pid} <= set(begun(log)))
    strange = there.worker(path=[edited])
    os.kill(doomed.pid, signal.SIGKILL)
    there.worker()
    here.join(PATIENCE)
    (report,) = reports
    assert (report.total, report.computed, report.done) == (80, 80, 80)
    assert strange.pid not in begun(log)
    assert store.verify() == []
    assert all(entry.source_hash == "abc" for entry in store.archive.entries().values())
    store.close()


def test_a_worker_that_dies_while_it_compiles_is_replaced(there, tmp_path):
    log = tmp_path / "log"
    store = Store(tmp_path / "store")
    campaign = sweep(4, log=str(log), act="die compiling")
    there.worker(), there.worker()
    until(lambda: two_workers(there))
    reports = []
    here = threading.Thread(
        target=lambda: reports.append(run(campaign, store, there)), daemon=True
    )
    here.start()
    here.join(PATIENCE)
    assert reports and reports[0].done == 4
    assert len((tmp_path / "log.warm").read_text().splitlines()) == 2
    store.close()


def test_a_worker_with_other_code_is_refused(there, edited, tmp_path):
    log = tmp_path / "log"
    store = Store(tmp_path / "store")
    campaign = sweep(6, log=str(log))
    strange = there.worker(path=[edited])
    with pytest.raises(RunnerError) as caught:
        run(campaign, store, there)
    assert "no worker is left that runs the same code" in str(caught.value)
    assert f"here it is {source_hash()}; install the same version there" in str(
        caught.value
    )
    assert store.archive.entries() == {}
    fit = there.worker()
    until(lambda: two_workers(there))
    report = run(campaign, store, there)
    assert report.ok and report.computed == 6
    assert len(report.notes) == 1 and report.notes[0].startswith(
        "worker tcp://127.0.0.1:"
    )
    assert "is refused: the source hash of its wearlab is" in report.notes[0]
    assert set(begun(log)) == {fit.pid} != {strange.pid}
    store.close()


def two_workers(cluster):
    from dask.distributed import Client

    with Client(cluster.address) as client:
        return len(client.scheduler_info(n_workers=-1)["workers"]) == 2


def test_work_that_reaches_other_code_comes_back(monkeypatch):
    """Between two looks at the workers a strange one may be given
    work: it says so and computes nothing.
    """
    from types import SimpleNamespace

    from dask import distributed

    from wearlab.runner.worker import OtherCode, execute_all

    monkeypatch.setattr(
        distributed, "get_worker", lambda: SimpleNamespace(address="tcp://there")
    )
    with pytest.raises(OtherCode) as caught:
        execute_all([], SIMULATE, "other")
    assert caught.value.args == ("tcp://there", source_hash())
    assert execute_all([], SIMULATE, source_hash()) == []


def test_a_killed_scheduler_is_one_message(there, tmp_path):
    log = tmp_path / "log"
    there.worker()
    script = Path(fake_campaign.__file__).with_name("run_fake.py")
    words = [
        script,
        tmp_path / "store",
        300,
        log,
        "-",
        "act=slow",
        f"scheduler={there.address}",
    ]
    child = subprocess.Popen(
        [sys.executable, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    until(lambda: len(begun(log)) > 10)
    there.children[0].kill()
    said, complaints = child.communicate(timeout=PATIENCE)
    assert child.returncode == 2 and "scheduler" in said.splitlines()[-1], said
    assert "Traceback" not in complaints and len(complaints) < 300, complaints
    assert Store(tmp_path / "store").verify() == []


def test_a_life_goes_on_elsewhere_when_its_worker_dies(there, tmp_path):
    """The scheduler gives it to the other worker by itself, which begins where the
    first one was.
    """
    there.worker(), there.worker()
    until(lambda: two_workers(there))
    rates = {}
    for act in ("finish", "die"):
        log = tmp_path / act
        store = Store(tmp_path / f"{act}-store")
        campaign = sweep(2, act=act, gate=str(tmp_path / "gate"), log=str(log))
        report = wearlab.run(
            campaign,
            store,
            scheduler=there.address,
            simulate=fake_life.SIMULATE,
            progress=False,
        )
        assert report.done == 2
        rates[act] = [int(line.split()[1]) for line in log.read_text().splitlines()]
        if act == "finish":
            whole = [store.run(case.id).wear_depth.values for case in campaign.cases]
        else:
            for case, values in zip(campaign.cases, whole, strict=True):
                np.testing.assert_array_equal(store.run(case.id).wear_depth, values)
        store.close()
    assert min(rates["die"]) < min(rates["finish"])


def test_two_parents_share_a_scheduler_and_a_store(there, tmp_path):
    """Each run is computed once, whoever asks for it."""
    there.worker(), there.worker()
    log = tmp_path / "log"
    reports = []
    parents = [
        threading.Thread(
            target=lambda: reports.append(
                run(
                    sweep(30, log=str(log), act="slow"),
                    Store(tmp_path / "store"),
                    there,
                )
            )
        )
        for _ in range(2)
    ]
    for parent in parents:
        parent.start()
    for parent in parents:
        parent.join(PATIENCE)
    assert [report.done for report in reports] == [30, 30]
    assert sum(report.computed for report in reports) == 30 == len(begun(log))
    assert Store(tmp_path / "store").verify() == []


@pytest.fixture
def secured(tmp_path):
    """Return files of a certificate and its key, which is its own authority."""
    key = tmp_path / "key.pem"
    certificate = tmp_path / "cert.pem"
    words = [
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=127.0.0.1",
    ]
    try:
        subprocess.run(
            ["openssl", *words, "-keyout", key, "-out", certificate],
            check=True,
            capture_output=True,
        )
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no openssl here")
    files = {"ca-file": certificate}
    for role in ("scheduler", "worker", "client"):
        files |= {f"{role}.cert": certificate, f"{role}.key": key}
    return {f"distributed.comm.tls.{name}": str(file) for name, file in files.items()}


def test_work_goes_through_tls(secured, tmp_path, monkeypatch):
    """As dask's documentation has it: the same configuration
    everywhere, a tls:// address.
    """
    secured["distributed.comm.require-encryption"] = "True"
    for name, value in secured.items():
        monkeypatch.setenv(
            f"DASK_{name.upper().replace('.', '__').replace('-', '_')}", value
        )
    cluster = Cluster(tmp_path, "--protocol", "tls")
    try:
        cluster.worker()
        with dask.config.set(secured):
            assert cluster.address.startswith("tls://")
            assert run(sweep(3), Store(tmp_path / "store"), cluster).done == 3
    finally:
        cluster.close()

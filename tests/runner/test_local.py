"""Workers on this machine: forked from what has imported everything,
and ended at once.
"""

import asyncio
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from wearlab.runner import foresee, local
from wearlab.runner.local import ONE_THREAD, local_client
from wearlab.runner.report import RunnerError
from wearlab.sources import code_and_place


def test_workers_find_everything_imported_and_leave_at_once() -> None:
    with local_client(2, dashboard=False) as client:
        parents = client.run(os.getppid)
        ready = client.run(
            lambda: {"wearlab.simulation", "dask.array", "netCDF4"} <= set(sys.modules)
        )
        single = client.run(
            lambda names: [os.environ[name] for name in names], list(ONE_THREAD)
        )
        workers = list(client.run(os.getpid).values())
    assert len(workers) == 2
    assert not multiprocessing.active_children()
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)
    assert all(set(values) == {"1"} for values in single.values())
    if sys.platform == "linux":
        assert all(ready.values())
        assert len(set(parents.values())) == 1
        assert os.getpid() not in parents.values()


def test_environment_reaches_workers_as_it_is_now(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    local.begin_imports()
    monkeypatch.setenv(
        "WEARLAB_TEST_WORD", "late"
    )  # unknown to the process that workers are forked from
    with local_client(1, dashboard=False) as client:
        assert list(client.run(os.getenv, "WEARLAB_TEST_WORD").values()) == ["late"]


@pytest.mark.parametrize(
    ("done", "scheduler", "begun"),
    [
        ((), None, 1),
        (("a",), None, 1),
        (("a", "b"), None, 0),
        ((), "tcp://127.0.0.1:1", 0),
    ],
)
def test_imports_begin_early_when_workers_will_be_wanted(
    done: tuple[str, ...],
    scheduler: str | None,
    begun: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[int] = []
    monkeypatch.setattr(local, "begin_imports", lambda: calls.append(1))
    campaign = SimpleNamespace(
        cases=[SimpleNamespace(id=name) for name in ("a", "b", "c", "c")]
    )
    archive = SimpleNamespace(
        catalogue=SimpleNamespace(exists=lambda: True), heads=lambda ids: set(done)
    )
    store = SimpleNamespace(archive=archive)
    foresee(campaign, store, scheduler)  # type: ignore[arg-type]
    assert len(calls) == begun
    store.archive.catalogue.exists = lambda: False
    calls.clear()
    foresee(campaign, store, scheduler)  # type: ignore[arg-type]
    assert len(calls) == (scheduler is None)


def test_a_replacement_that_never_began_is_not_joined() -> None:
    from distributed.core import Status

    kind = local.swift_nanny()
    nanny = kind.__new__(kind)
    nanny.process = SimpleNamespace(
        status=Status.failed, process=SimpleNamespace(pid=None)
    )
    asyncio.run(nanny.kill())


@pytest.fixture
def impostor(tmp_path: Path) -> Path:
    """Return a folder in which lies another package of our name."""
    (tmp_path / "wearlab").mkdir()
    (tmp_path / "wearlab" / "__init__.py").write_text(
        "raise RuntimeError('another wearlab')"
    )
    return tmp_path


RUN = """
from wearlab.runner.local import local_client
from wearlab.sources import code_and_place
with local_client(1, dashboard=False) as client:
    assert list(client.run(code_and_place).values()) == [code_and_place()]
print("same code")
"""


def test_workers_import_what_their_parent_does_wherever_it_stands(
    impostor: Path,
) -> None:
    script = impostor / "scripts" / "run.py"
    script.parent.mkdir()
    script.write_text(RUN)
    found = subprocess.run(
        [sys.executable, script],
        cwd=impostor,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (found.stdout, found.stderr) == ("same code\n", "")


def test_workers_with_other_code_are_one_message() -> None:
    answers = {"tcp://1": OSError("gone"), "tcp://2": ("feed", "/elsewhere/wearlab")}
    client = SimpleNamespace(run=lambda function, on_error: answers)
    with pytest.raises(
        RunnerError,
        match="another wearlab than this process \\(/elsewhere/wearlab there",
    ):
        local._refuse_other_code(client)
    answers["tcp://2"] = code_and_place()
    local._refuse_other_code(client)
    answers["tcp://2"] = ImportError("no module named wearlab.sources")
    with pytest.raises(RunnerError, match="no module named"):
        local._refuse_other_code(client)


def test_a_client_is_taken_as_scheduler_and_stays_open(tmp_path: Path) -> None:
    from fake_campaign import SIMULATE, sweep

    import wearlab as wl

    with local_client(1, dashboard=False) as client:
        report = wl.run(
            sweep(2), tmp_path, scheduler=client, simulate=SIMULATE, progress=False
        )
        assert (report.computed, report.done) == (2, 2)
        assert client.status == "running" and client.submit(max, 1, 2).result() == 2
    with pytest.raises(RunnerError, match="the client is closed"):
        wl.run(
            sweep(3),
            tmp_path / "none",
            scheduler=client,
            simulate=SIMULATE,
            progress=False,
        )
    with pytest.raises(RunnerError, match="neither an address nor a dask client"):
        number: Any = 5
        wl.run(sweep(3), tmp_path / "none", scheduler=number, simulate=SIMULATE)
    assert not (tmp_path / "none").exists()


def test_workers_of_several_threads_are_refused(tmp_path: Path) -> None:
    from dask.distributed import Client, LocalCluster
    from fake_campaign import SIMULATE, sweep

    import wearlab as wl

    cluster = LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    )
    with (
        cluster,
        Client(cluster) as client,
        pytest.raises(RunnerError, match="has 2 threads; wearlab needs one a process"),
    ):
        wl.run(
            sweep(2),
            tmp_path / "none",
            scheduler=client,
            simulate=SIMULATE,
            progress=False,
        )
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("cores", [1, 2, 64])
def test_as_many_workers_as_the_process_may_use_cores(
    cores: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        os, "sched_getaffinity", lambda process: set(range(cores)), raising=False
    )
    assert local.available_cores() == cores
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert local.available_cores() == 1


def test_nobody_else_on_this_machine_can_give_work():
    """Was: any local user's graph was computed, as whoever ran the campaign."""
    from dask.distributed import Client
    from distributed import Security

    with local_client(1, dashboard=False) as client:
        address = client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        workers = client.scheduler_info()["workers"]
        assert all(worker.startswith("tls://127.0.0.1:") for worker in workers)
        for stranger in (
            {"address": address.replace("tls://", "tcp://")},
            {"address": address, "security": Security.temporary()},
        ):
            with pytest.raises(OSError):
                Client(timeout=5, **stranger)
        assert client.submit(os.getpid).result() in client.run(os.getpid).values()


def test_no_page_answers_without_being_asked_for():
    """Was: dask's pages about scheduler and workers, to whoever may
    use this machine.
    """
    from urllib.error import HTTPError
    from urllib.request import urlopen

    with local_client(1, dashboard=False) as client:
        information = client.scheduler_info()
        ports = [information["services"]["dashboard"]]
        ports += [
            worker["services"]["dashboard"]
            for worker in information["workers"].values()
        ]
        for port in ports:
            for page in ("/", "/status", "/info/main/workers.html", "/metrics"):
                with pytest.raises(HTTPError, match="404"):
                    urlopen(f"http://127.0.0.1:{port}{page}", timeout=10)

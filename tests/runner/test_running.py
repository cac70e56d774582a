"""Runs of fake campaigns; worker processes are real."""

import io
from collections import Counter
from pathlib import Path

import pytest
import xarray as xr
from fake_campaign import SIMULATE, Campaign, Case, Scene, alter, sweep
from rich.console import Console

import wearlab
from wearlab.runner import Interrupted, RunnerError, cluster, execution, running
from wearlab.runner.progress import ProgressBar
from wearlab.sources import source_hash
from wearlab.store import Store, StoreError


@pytest.fixture
def store(tmp_path):
    made = Store(tmp_path / "store")
    yield made
    made.close()


@pytest.fixture
def log(tmp_path):
    return tmp_path / "log"


def run(campaign, store, workers=0, **options):
    """Run fake cases in this process, unless a number of workers is given."""
    return wearlab.run(
        campaign,
        store,
        workers=workers,
        simulate=SIMULATE,
        progress=False,
        **options,
    )


def simulated(log):
    """Return how often each speed was simulated."""
    lines = Path(log).read_text().splitlines() if Path(log).exists() else []
    return Counter(float(line.split()[0]) for line in lines)


def test_two_workers_end_to_end(store, log):
    campaign = alter(
        alter(sweep(6, static=True, log=str(log)), 1, act="fail"), 3, act="refuse"
    )
    campaign = alter(campaign, 4, act="warn")
    report = run(campaign, store, workers=2)
    assert (
        report.total,
        report.computed,
        report.done,
        report.failed,
        report.refused,
    ) == (7, 7, 5, 1, 1)
    assert not report.ok
    trouble = {case.state: case for case in report.troubled}
    assert (
        trouble["failed"].headline
        == "FloatingPointError: the shooting did not converge"
    )
    assert trouble["refused"].reason.startswith("contact ratio 0.93")
    assert trouble["done"].warnings == ("RuntimeWarning: the film is thin",)
    assert simulated(log) == {
        s: 1 for s in (0.0, 800.0, 900.0, 1000.0, 1100.0, 1200.0, 1300.0)
    }
    processes = {line.split()[1] for line in log.read_text().splitlines()}
    assert len(processes) == 2
    (warm,) = (
        Path(f"{log}.warm").read_text().splitlines()
    )  # the first part of all scenes
    assert warm.split()[0] == "7"
    assert warm.split()[1] in processes
    assert store.verify() == []
    assert not any((store.path / "runners").iterdir())
    assert {m.position.get("speed") for m in store.archive.catalogue.members()} >= {
        "800 rpm",
        None,
    }


@pytest.mark.parametrize("batch", [1, 4])
def test_a_worker_that_dies_takes_only_its_own_case(store, log, monkeypatch, batch):
    monkeypatch.setattr(
        cluster.Pace, "batch", lambda self, waiting, workers: min(batch, waiting)
    )
    campaign = alter(sweep(4, log=str(log)), 1, act="die")
    report = run(campaign, store, workers=1)
    assert (report.done, report.failed) == (3, 1)
    assert report.troubled[0].id == campaign.cases[1].id
    assert "worker process died" in report.troubled[0].reason


def test_a_case_whose_process_was_killed_twice_is_tried_once_more(store, log):
    """Whoever kills workers is seldom the case that they compute."""
    case = Case("base", Scene(act="die twice", log=str(log)))
    quiet = Case("quiet", Scene(speed=7.0))
    report = run(Campaign((case, quiet)), store, workers=1)
    assert report.ok and simulated(log) == {1100.0: 3}


def test_a_single_case_needs_no_cluster(store, log, monkeypatch):
    monkeypatch.setattr(
        cluster, "connect", lambda *_: pytest.fail("a cluster was started")
    )
    monkeypatch.setattr(
        running.cluster, "connect", lambda *_: pytest.fail("a cluster was started")
    )
    assert run(sweep(1, log=str(log)), store, workers=None).ok
    assert simulated(log) == {800.0: 1}


def test_only_what_is_missing_is_computed(store, log):
    run(sweep(2, log=str(log)), store)
    report = run(sweep(4, log=str(log)), store)
    assert (report.computed, report.done) == (2, 4)
    assert run(sweep(4, log=str(log)), store).computed == 0
    assert set(simulated(log).values()) == {1}


def test_equal_scenes_are_one_run(store, log):
    scene = Scene(log=str(log))
    report = run(Campaign((Case("one", scene), Case("two", scene))), store)
    assert (report.total, report.computed) == (1, 1)
    assert {member.label for member in store.archive.catalogue.members()} == {
        "one",
        "two",
    }


@pytest.mark.parametrize("act", ["fail", "refuse"])
def test_trouble_is_kept_and_retried_on_request(store, log, act):
    campaign = alter(sweep(2, log=str(log)), 0, act=act)
    assert not run(campaign, store).ok
    assert not run(campaign, store).ok
    assert simulated(log) == {800.0: 1, 900.0: 1}
    assert not run(campaign, store, retry=True).ok
    assert simulated(log) == {800.0: 2, 900.0: 1}


def test_what_a_dead_process_left_running_is_computed(store, log):
    campaign = sweep(2, log=str(log))
    store.archive.create()
    with store.archive.presence() as dead:
        store.archive.claim([campaign.cases[0].id], dead.token, lambda entry: False)
    assert run(campaign, store).ok
    assert set(simulated(log)) == {800.0, 900.0}


@pytest.mark.parametrize("damage", ["gone", "truncated"])
def test_a_file_that_was_lost_is_made_again(store, log, damage):
    campaign = sweep(2, log=str(log))
    run(campaign, store)
    file = store.archive.files.path(campaign.cases[0].id)
    file.unlink() if damage == "gone" else file.write_bytes(file.read_bytes()[:-1])
    assert run(campaign, store).computed == 1
    assert store.verify() == []


def test_ctrl_c_releases_what_was_running(store, monkeypatch):
    monkeypatch.setattr(execution, "execute", interrupting(execution.execute, after=1))
    with pytest.raises(
        KeyboardInterrupt, match=r"1 done, 2 to go; run again to continue"
    ):
        run(sweep(3), store)
    assert [entry.state for entry in store.archive.entries().values()] == ["done"]
    monkeypatch.undo()
    assert run(sweep(3), store).computed == 2


def interrupting(execute, after):
    count = iter(range(after + 1))

    def interrupted(task, simulate, send):
        if next(count) == after:
            raise KeyboardInterrupt
        return execute(task, simulate, send)

    return interrupted


def test_an_unwritable_store_stops_before_anything_runs(tmp_path, log):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="no store can be made here"):
        run(sweep(1, log=str(log)), Store(tmp_path / "file" / "store"))
    assert not simulated(log)


def test_a_scheduler_that_was_there_before(store, log):
    from dask.distributed import LocalCluster

    source_hash.cache_clear()  # the workers read the sources now
    quiet = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        host="127.0.0.1",
        scheduler_kwargs=quiet,
        worker_dashboard_address=None,
    ) as there:
        assert run(sweep(3, log=str(log)), store, scheduler=there.scheduler_address).ok
        assert (
            run(
                sweep(3, log=str(log)), store, scheduler=there.scheduler_address
            ).computed
            == 0
        )
    assert set(simulated(log).values()) == {1}


def test_nobody_answers(store, log, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.3)
    with pytest.raises(RunnerError, match=r"no dask scheduler answers at tcp://127"):
        run(sweep(2, log=str(log)), store, scheduler="tcp://127.0.0.1:9")
    assert not simulated(log)


def test_the_same_datasets_whoever_computes(store, tmp_path):
    other = Store(tmp_path / "other")
    run(sweep(2), store)
    run(sweep(1), other)
    run(sweep(2), other)
    for case in sweep(2).cases:
        volatile = {"date_created": None}
        mine = store.run(case.id).assign_attrs(volatile)
        theirs = other.run(case.id).assign_attrs(volatile)
        xr.testing.assert_identical(mine, theirs)


def test_the_bar_counts_trouble(store, monkeypatch):
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    monkeypatch.setattr(running, "watched", lambda progress: ProgressBar(console))
    run(alter(alter(sweep(4), 1, act="fail"), 2, act="refuse"), store)
    assert "1 failed, 1 refused" in screen.getvalue()
    assert "4/4" in screen.getvalue()


def test_a_scheduler_that_does_not_answer_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.2)
    store = Store(tmp_path / "store")
    with pytest.raises(RunnerError, match="no dask scheduler answers"):
        wearlab.run(
            sweep(2),
            store,
            scheduler="tcp://127.0.0.1:9",
            simulate=SIMULATE,
            progress=False,
        )
    monkeypatch.setattr(cluster, "find_spec", lambda name: None)
    with pytest.raises(RunnerError, match="the dashboard needs bokeh"):
        wearlab.run(sweep(2), store, dashboard=True, simulate=SIMULATE, progress=False)
    assert not store.path.exists()


def test_an_interruption_between_file_and_catalogue_leaves_no_unknown_file(
    store, monkeypatch
):
    """Ctrl-C may come when a run's file is in place and nothing is recorded of it."""
    from wearlab.store.catalogue import Catalogue

    original = Catalogue.record
    calls = []

    def record(self, outcomes, *words):
        calls.append(1)
        if len(list(outcomes)) and len(calls) > 3:
            monkeypatch.setattr(Catalogue, "record", original)
            raise KeyboardInterrupt
        return original(self, outcomes, *words)

    monkeypatch.setattr(Catalogue, "record", record)
    with pytest.raises(Interrupted, match="2 done, 4 to go"):
        run(sweep(6), store)
    assert store.verify() == []
    assert run(sweep(6), store).computed == 4
